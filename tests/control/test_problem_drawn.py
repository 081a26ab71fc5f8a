"""Problems of other people, and drawn ones: riccati against Ipopt at a tolerance of 1e-10."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from nmpcrl import Vector
from nmpcrl.control import Ipopt, Nmpc, Problem, Riccati, Series, Soft, Solution
from nmpcrl.study.problems import gros_zanon


def strict(solution: Solution) -> bool:
    """Whether every row and bound is clearly active or clearly not: no kink is near."""
    m, ocp = solution.multipliers, solution.ocp
    discount = ocp.gamma ** np.arange(len(ocp.states))
    shares = m.obstacles / np.outer(discount, ocp.slack_weights)
    doubtful = (np.minimum(shares, 1 - shares) > 1e-7) & (np.minimum(shares, 1 - shares) < 1e-4)
    slack_of_bounds = np.abs(np.abs(solution.inputs) - 1)
    weak = (np.abs(m.inputs) > 1e-7) & (np.abs(m.inputs) < 1e-4)
    between = (slack_of_bounds < 1e-4) & (np.abs(m.inputs) < 1e-4)
    return not (doubtful.any() or weak.any() or between.any())


def draws(problem: Problem, count: int) -> list[tuple[Vector, Vector, Vector]]:
    rng = np.random.default_rng(7)
    return [
        (
            rng.uniform([0.0, -1.0], [1.0, 1.0]),
            problem.theta + rng.normal(scale=0.05, size=problem.theta.size),
            rng.uniform(-1.0, 1.0, 1),
        )
        for _ in range(count)
    ]


@pytest.mark.slow
def test_machine_code_finds_the_values_and_all_derivatives_of_gros_and_zanon():
    """Among them one with an active row of a small multiplier, which the costates depend on."""
    problem = gros_zanon.problem()
    compiled = Nmpc(problem, solver=Riccati(1e-10))
    ipopt = Nmpc(problem, solver=Ipopt(1e-10))
    along = np.linspace(-1, 1, problem.theta.size)
    compared = 0
    for state, theta, action in draws(problem, 200):
        for fixed in (None, action):
            ours = compiled.solve(state, theta, action=fixed)
            theirs = ipopt.solve(state, theta, action=fixed)
            assert ours.value == pytest.approx(theirs.value, rel=1e-6, abs=1e-6)
            if not strict(ours):
                continue
            size = max(1.0, np.abs(theirs.features).max())
            np.testing.assert_allclose(ours.features, theirs.features, atol=1e-6 * size)
            dense = compiled.value_hessian(ours)
            product = compiled.value_hessian_times(ours, along)
            np.testing.assert_allclose(product, dense @ along, atol=1e-3 * np.abs(dense).max())
            policy = ipopt.policy_jacobian(ours)
            np.testing.assert_allclose(
                compiled.policy_jacobian(ours), policy, atol=1e-3 * max(1.0, np.abs(policy).max())
            )
            compared += 1
    assert compared > 300


def random_problem(seed: int) -> Problem:
    """Any sizes, a curved model, rows that mix states, inputs, parameters and data."""
    rng = np.random.default_rng(seed)
    n, m, horizon = rng.integers(1, 4), rng.integers(1, 3), rng.integers(1, 6)
    rows = rng.integers(0, 3)
    W, c = rng.normal(size=(n, n)), ca.DM(rng.normal(size=(max(rows, 1), n)))
    e = ca.DM(rng.normal(size=(max(rows, 1), m)))

    def soft(x, u, th, d):
        return c @ ca.sin(x) + e @ (th["h"] * u) - th["limit"] + d["shift"]

    return Problem(
        states=int(n),
        inputs=int(m),
        horizon=int(horizon),
        gamma=float(rng.uniform(0.8, 1)),
        theta={
            "A": np.eye(n) + 0.1 * rng.normal(size=(n, n)),
            "B": rng.normal(size=(n, m)),
            "bend": 0.1 * rng.normal(),
            "root": rng.uniform(0.3, 1.5, n),
            "h": 0.5,
            "limit": 0.5,
        },
        model=lambda x, u, th, d: th["A"] @ x + th["B"] @ u + th["bend"] * ca.sin(ca.DM(W) @ x),
        stage=lambda x, u, th, d: ca.sumsqr(th["root"] * (x - d["shift"])) + 0.3 * ca.sumsqr(u),
        terminal=lambda x, th, d: 2 * ca.sumsqr(x) + th["h"] * ca.sum1(x**4),
        soft=[Soft(soft, weight=3.0)] if rows else (),
        lower=-1.0,
        upper=1.0,
        data={"shift": Series(rng.normal(scale=0.3, size=horizon + 1))},
    )


@pytest.mark.slow
@pytest.mark.usefixtures("interpreted")
@settings(
    derandomize=True,
    deadline=None,
    max_examples=15,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(seed=st.integers(0, 10**6))
def test_a_drawn_problem_has_the_solution_that_ipopt_finds_from_there(seed):
    problem, rng = random_problem(seed), np.random.default_rng(seed)
    riccati, ipopt = (Nmpc(problem, solver=s) for s in (Riccati(1e-10), Ipopt(1e-10)))
    state = rng.normal(size=problem.states)
    for fixed in (None, rng.uniform(-0.9, 0.9, problem.inputs)):
        ours = riccati.solve(state, problem.theta, action=fixed)
        assert riccati.kkt_residual(ours, relative=True) < 1e-6
        theirs = ipopt.solve(state, problem.theta, ours, fixed)
        assume(np.abs(theirs.inputs - ours.inputs).max() < 1e-2)
        assert ours.value == pytest.approx(theirs.value, rel=1e-6, abs=1e-6)
        if strict(ours) and strict(theirs):
            size = max(1.0, np.abs(theirs.features).max())
            np.testing.assert_allclose(ours.features, theirs.features, atol=1e-5 * size)
            dense = ipopt.policy_jacobian(ours)
            found = riccati.policy_jacobian(ours)
            np.testing.assert_allclose(found, dense, atol=1e-3 * max(1.0, np.abs(dense).max()))

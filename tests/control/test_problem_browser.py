"""A `Problem` as WebAssembly: solved in wasmtime as by the machine code."""

import casadi as ca
import numpy as np
import pytest
from wasm_host import Controller, Module

from nmpcrl.control import Hard, Nmpc, Problem, Series, Soft
from nmpcrl.control.browser import texts
from nmpcrl.control.codegen.browser import from_texts

AROUND = [1500.0, -1000.0], [4500.0, 1000.0]  # where states are drawn


def tank() -> Problem:
    """A tank that is filled against a demand: data, lines of data, hard rows, and large units."""
    demand = 1000 * np.sin(np.arange(9))[:, None]
    return Problem(
        states=2,
        inputs=1,
        horizon=8,
        gamma=0.95,
        theta={"gain": 1.0, "level": 3000.0, "price": np.array([1.0, 0.1]), "cap": 0.1},
        model=lambda x, u, th, d: ca.vertcat(
            x[0] + th["gain"] * x[1] - d["demand"][0], 0.8 * x[1] + 1e4 * ca.tanh(u[0])
        ),
        stage=lambda x, u, th, d: (
            th["price"][0] * (x[0] / 1000 - th["level"] / 1000) ** 2
            + th["price"][1] * (x[1] / 1000) ** 2
            + u[0] ** 2
        ),
        terminal=lambda x, th, d: 5 * (x[0] / 1000 - th["level"] / 1000) ** 2,
        initial=lambda x, th, d: th["cap"] * x[0] / 1000,
        soft=[
            Soft(lambda x, u, th, d: x[0] / 1000 - 4 + th["cap"], weight=20.0),
            Soft(lambda x, u, th, d: d["walls"][0] - x[1] / 1000 + th["cap"], 9.0, each="walls"),
        ],
        hard=[
            Hard(lambda x, u, th, d: u[0] - x[0] / 1000 - 1),
            Hard(lambda x, u, th, d: 2.5 - x[0] / 1000, stages=8),
        ],
        state_upper=np.array([np.inf, 2500.0]),
        lower=-2.0,
        upper=2.0,
        data={"demand": Series(demand), "walls": np.array([[-2.0], [-2.5]])},
        scale=[1000.0, 500.0],
    )


@pytest.mark.slow
def test_values_gradients_and_slopes_are_those_of_the_machine_code():
    """Cold, warm and shifted; with u_0 free and given; and the model's step and cost."""
    problem = tank()
    data = from_texts(texts(problem))
    assert len(data) < 150_000
    nmpc = Nmpc(problem)
    module = Controller(Module(data), nmpc)
    rng, m = np.random.default_rng(3), problem.inputs
    e = problem.expressions
    both = ca.Function("both", [e.x, e.u, e.theta, e.d], [e.next_x, e.stage])
    warm = kept = None
    for k in range(30):
        theta = problem.theta * rng.uniform(0.97, 1.03, problem.theta.size)
        state, action = rng.uniform(*AROUND), rng.uniform(-1, 1, m) if k % 3 == 2 else None
        if k % 5 == 4:
            state = warm.states[1]
        ours = nmpc.solve(state, theta, warm if k % 2 else None, action)
        theirs = module.solve(state, theta, kept if k % 2 else None, action)
        assert (theirs["iterations"], theirs["restarts"]) == (ours.iterations, ours.restarts)
        assert theirs["value"] == pytest.approx(ours.value, rel=1e-11, abs=1e-11)
        assert theirs["violation"] == pytest.approx(ours.violation, rel=1e-6, abs=1e-11)
        size = np.abs(ours.features).max()
        np.testing.assert_allclose(theirs["features"], ours.features, rtol=1e-11, atol=1e-11 * size)
        np.testing.assert_allclose(theirs["action"], ours.action, rtol=1e-9, atol=1e-9)
        warm, kept = ours, theirs
        if k % 6 == 0:
            along = rng.normal(size=theta.size)
            found = module.slopes(state, theta, theirs, along, action=action)
            product = nmpc.value_hessian_times(ours, along)
            np.testing.assert_allclose(found, product, atol=1e-5 * np.abs(product).max())
            found = module.slopes(state, theta, theirs, weights=np.eye(m)[0], action=action)
            policy = nmpc.policy_jacobian(ours)[0]
            np.testing.assert_allclose(found, policy, rtol=1e-5, atol=1e-7)
        later, cost = both(state, ours.action, theta, problem.own(problem.data[0]))
        found = module.step(state, ours.action, theta)
        np.testing.assert_allclose(found, later.full().ravel(), rtol=1e-12)
        found = module.stage_cost(state, ours.action, theta)
        assert found == pytest.approx(float(cost), rel=1e-12)

"""`Problem`: any symbol learned, compared with closed forms, finite differences and dense KKT."""

import math

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Fatrop, Ipopt, Nmpc, Parameter, Problem, Riccati, Soft

pytestmark = pytest.mark.usefixtures("interpreted")

STEP = 1e-5


def pendulum(**changes) -> Problem:
    """A curved plant with everything that a problem may have; each symbol is learned."""
    fields = {
        "states": 2,
        "inputs": 1,
        "horizon": 6,
        "gamma": 0.95,
        "theta": {
            "rate": 1.3,
            "damping": Parameter(0.2, 0.0, 2.0),
            "Q": np.diag([1.0, 0.3]),
            "r": 0.2,
            "limit": np.array([0.7, 0.9]),
            "offset": 0.5,
        },
        "model": lambda x, u, th, d: ca.vertcat(
            x[0] + 0.2 * x[1],
            x[1] + 0.2 * (-th["rate"] * ca.sin(x[0]) - th["damping"] * x[1] ** 3 + u) + d["wind"],
        ),
        "stage": lambda x, u, th, d: (
            ca.bilin(th["Q"], x - d["target"], x - d["target"]) + th["r"] * u**2
        ),
        "terminal": lambda x, th, d: 3 * ca.sumsqr(th["Q"] @ (x - d["target"])),
        "initial": lambda x, th, d: th["offset"] ** 2 * ca.cos(x[0]),
        "soft": [
            Soft(lambda x, u, th, d: x[1] - th["limit"][0], weight=4.0),
            Soft(lambda x, u, th, d: x[1] * u - th["limit"][1] * ca.cos(x[0]), weight=2.0),
            Soft(lambda x, u, th, d: [x[0] - 1.2, -x[0] - 1.2], weight=[3.0, 5.0], stages=[-1]),
        ],
        "lower": -1.5,
        "upper": 1.5,
        "data": {"wind": 0.0, "target": np.zeros(2)},
    }
    return Problem(**fields | changes)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return pendulum()


@pytest.fixture(scope="module")
def solvers(problem) -> dict[str, Nmpc]:
    kinds = (Riccati(1e-11), Ipopt(1e-10), Fatrop(1e-10))
    return {kind.name: Nmpc(problem, solver=kind) for kind in kinds}


def drawn(problem, count, seed):
    """States, thetas, actions and data of the pendulum."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        data = {
            "wind": rng.normal(scale=0.05, size=problem.horizon + 1),
            "target": rng.normal(scale=0.5, size=2),
        }
        theta = problem.theta + rng.uniform(-0.1, 0.1, problem.theta.size)
        yield rng.uniform(-1.2, 1.2, 2), theta, rng.uniform(-1, 1, 1), data


def pressed(solution):
    """Which rows and bounds hold as equalities; None if a multiplier leaves it in doubt."""
    m, ocp = solution.multipliers, solution.ocp
    weights = np.outer(ocp.gamma ** np.arange(len(ocp.states)), ocp.slack_weights)
    shares = np.concatenate([(m.obstacles / weights).ravel(), np.abs(m.inputs).ravel()])
    if ((shares > 1e-6) & (shares < 1e-3)).any() or (np.abs(shares - 1) < 1e-3).sum() > (
        np.abs(shares - 1) < 1e-6
    ).sum():
        return None
    return tuple(shares > 1e-3) + tuple(shares > 1 - 1e-3)


def beside(nmpc, solution, data, fixed):
    """Solutions on both sides in each theta; None where a constraint changes sides."""
    here, pairs = pressed(solution), []
    for e in STEP * np.eye(solution.theta.size):
        pairs.append(
            [
                nmpc.solve(solution.state, solution.theta + d, solution, fixed, data=data)
                for d in (e, -e)
            ]
        )
        if here is None or any(pressed(side) != here for side in pairs[-1]):
            return None
    return pairs


def differences(pairs, read):
    """Central differences of `read(solution)` in theta."""
    columns = [(read(above) - read(below)) / (2 * STEP) for above, below in pairs]
    return np.moveaxis(np.array(columns), 0, -1)


@pytest.mark.parametrize("fixed", [False, True])
def test_all_derivatives_are_finite_differences(problem, solvers, fixed):
    """Gradient, Hessian, policy and any plan entry; with u_0 given as without."""
    nmpc, rng, compared = solvers["riccati"], np.random.default_rng(1), 0
    for state, theta, action, data in drawn(problem, 12, seed=2):
        given = action if fixed else None
        solution = nmpc.solve(state, theta, action=given, data=data)
        pairs = beside(nmpc, solution, data, given)
        if pairs is None:
            continue
        slope = differences(pairs, lambda s: s.value)
        np.testing.assert_allclose(solution.features, slope, atol=1e-6 * np.abs(slope).max())
        hessian = differences(pairs, lambda s: s.features)
        along = rng.normal(size=theta.size)
        product = nmpc.value_hessian_times(solution, along)
        np.testing.assert_allclose(product, hessian @ along, atol=2e-5 * np.abs(hessian).max())
        policy = differences(pairs, lambda s: s.action)
        found = nmpc.policy_jacobian(solution)
        np.testing.assert_allclose(found, policy, atol=2e-5)
        for stage in (1, 3, 6):
            plan = nmpc.plan_jacobian(solution, stage)
            states = differences(pairs, lambda s, i=stage: s.states[i])
            np.testing.assert_allclose(plan.states, states, atol=2e-5)
            if stage < 6:
                inputs = differences(pairs, lambda s, i=stage: s.inputs[i])
                np.testing.assert_allclose(plan.inputs, inputs, atol=2e-5)
        compared += 1
    assert compared >= 6


@pytest.mark.parametrize("other", ["ipopt", "fatrop"])
def test_riccati_and_casadis_solvers_agree_in_everything(problem, solvers, other):
    riccati, casadi, compared = solvers["riccati"], solvers[other], 0
    for state, theta, action, data in drawn(problem, 15, seed=3):
        for given in (None, action):
            ours = riccati.solve(state, theta, action=given, data=data)
            theirs = casadi.solve(state, theta, action=given, data=data)
            if abs(ours.value - theirs.value) > 1e-3 or pressed(ours) is None:
                continue  # another minimum, or a kink
            assert ours.value == pytest.approx(theirs.value, abs=1e-6)
            np.testing.assert_allclose(ours.features, theirs.features, atol=1e-5)
            np.testing.assert_allclose(ours.slacks, theirs.slacks, atol=1e-5)
            np.testing.assert_allclose(ours.states, theirs.states, atol=1e-5)
            np.testing.assert_allclose(ours.constraint_duals, theirs.constraint_duals, atol=1e-4)
            np.testing.assert_allclose(ours.bound_duals, theirs.bound_duals, atol=1e-4)
            assert riccati.kkt_residual(ours) < 1e-6
            dense, fast = casadi.value_hessian(ours), np.linspace(-1, 1, theta.size)
            np.testing.assert_allclose(
                riccati.value_hessian_times(ours, fast),
                dense @ fast,
                atol=1e-5 * np.abs(dense).max(),
            )
            np.testing.assert_allclose(
                riccati.policy_jacobian(ours), casadi.policy_jacobian(ours), atol=1e-5
            )
            for one, two in zip(
                riccati.plan_jacobian(ours, 2), casadi.plan_jacobian(ours, 2), strict=True
            ):
                np.testing.assert_allclose(one, two, atol=1e-5)
            compared += 1
    assert compared >= 20


def test_a_warm_start_leads_to_the_same_minimum_in_fewer_iterations(problem, solvers):
    for nmpc in solvers.values():
        (state, theta, action, data), *_ = drawn(problem, 1, seed=4)
        first = nmpc.solve(state, theta, data=data)
        again = nmpc.solve(state, theta + 1e-3, first, data=data)
        cold = nmpc.solve(state, theta + 1e-3, data=data)
        assert again.value == pytest.approx(cold.value, abs=1e-6)
        shifted = nmpc.solve(first.states[1], theta, first, data=data)
        fresh = nmpc.solve(first.states[1], theta, data=data)
        assert shifted.value == pytest.approx(fresh.value, abs=1e-6)
        with_action = nmpc.solve(state, theta, first, action, data=data)
        assert with_action.action == pytest.approx(action)
        if nmpc.solver.name == "riccati":
            assert again.iterations < cold.iterations


def test_the_gradient_has_names(problem, solvers):
    solution = solvers["riccati"].solve(np.array([0.4, 0.1]), problem.theta)
    by_name = solution.features_by_name
    assert by_name["Q"].shape == (2, 2)
    assert isinstance(by_name["rate"], float)
    flat = np.concatenate([np.ravel(by_name[name]) for name in problem.names])
    np.testing.assert_array_equal(flat, solution.features)
    assert by_name["offset"] == pytest.approx(2 * 0.5 * math.cos(0.4))


def test_a_row_of_stage_zero_that_no_plan_changes_counts_once_it_is_violated(problem, solvers):
    """h(s) > 0 costs W h(s), and its slope in theta is W h_theta: on the boundary it is 0."""
    for name, nmpc in solvers.items():
        limit = problem.split(problem.theta)["limit"][0]
        above = nmpc.solve(np.array([0.0, limit + 0.1]), problem.theta)
        assert above.slacks[0, 0] == pytest.approx(0.1)
        assert above.multipliers.obstacles[0, 0] == pytest.approx(4.0)
        tie = nmpc.solve(np.array([0.0, limit]), problem.theta)
        assert tie.multipliers.obstacles[0, 0] == 0.0, name


def test_data_are_given_once_or_stage_by_stage(problem, solvers):
    nmpc, state = solvers["riccati"], np.array([0.3, -0.2])
    once = nmpc.solve(state, problem.theta, data={"target": [0.2, 0.1]})
    each = nmpc.solve(state, problem.theta, data={"target": np.tile([0.2, 0.1], (7, 1))})
    assert once.value == each.value
    assert nmpc.solve(state, problem.theta).value != once.value
    late = np.zeros((7, 2))
    late[6] = 1.0
    assert nmpc.solve(state, problem.theta, data={"target": late}).value > once.value
    with pytest.raises(ValueError, match=r"data has no 'targt'; did you mean 'target'\?"):
        nmpc.solve(state, problem.theta, data={"targt": 0.0})
    with pytest.raises(
        ValueError, match=r"data 'target' has shape \(3,\); it must be \(2,\) or \(7, 2\)"
    ):
        nmpc.solve(state, problem.theta, data={"target": np.zeros(3)})


def test_a_vector_and_its_names_are_the_same(problem):
    theta = problem.vector(Q=[[1.0, 2.0], [3.0, 4.0]], r=7.0)
    parts = problem.split(theta)
    np.testing.assert_array_equal(parts["Q"], [[1, 2], [3, 4]])
    assert (parts["r"], parts["rate"]) == (7.0, 1.3)
    assert problem.split(problem.theta_lower)["damping"] == 0.0
    assert problem.split(problem.theta_upper)["rate"] == np.inf
    with pytest.raises(ValueError, match="theta has no 'q'"):
        problem.vector(q=1.0)
    with pytest.raises(ValueError, match=r"theta 'Q' has shape \(4,\); it must be \(2, 2\)"):
        problem.vector(Q=np.ones(4))

"""The value's derivatives in theta against finite differences and CasADi's own multipliers."""

import casadi as ca
import numpy as np
import pytest

STEP = 1e-4


def beside(nmpc, solution):
    """Solutions on both sides in each theta, each solve started from the same plan."""
    state, theta, steps = solution.state, solution.theta, STEP * np.eye(solution.theta.size)
    return [[nmpc.solve(state, theta + d, solution) for d in (e, -e)] for e in steps]


def differences(pairs, read):
    """Central differences of `read(solution)` in theta."""
    return np.array([(read(above) - read(below)) / (2 * STEP) for above, below in pairs])


def active(solution):
    """Which inequalities hold as equalities; None if some multiplier leaves that in doubt."""
    m = solution.multipliers
    size = np.abs(np.concatenate([part.ravel() for part in (m.states[1:], m.inputs)]))
    pressed = np.concatenate([m.obstacles.ravel(), -m.slacks.ravel(), size])
    if ((pressed > 1e-6) & (pressed < 1e-1)).any():
        return None
    return tuple(pressed > 1e-3)


def same_side_throughout(nmpc, solution):
    """Whether the active set stays as it is within a few steps of theta, in every direction."""
    steps = STEP * np.vstack([np.eye(9), -np.eye(9)])
    around = [nmpc.solve(solution.state, solution.theta + 3 * e, solution) for e in steps]
    here = active(solution)
    return here is not None and all(active(other) == here for other in around)


def test_features_are_the_differences_of_the_value(robot, draw):
    for state, theta in draw(10, seed=10):
        solution = robot.solve(state, theta)
        slope = differences(beside(robot, solution), lambda s: s.value)
        scale = np.abs(slope).max()
        np.testing.assert_allclose(solution.features, slope, atol=2e-6 * scale)


def test_features_of_a_fixed_action_are_differences_as_well(fatrop, draw):
    rng = np.random.default_rng(11)
    for state, theta in draw(5, seed=11):
        action = rng.uniform(fatrop.plant.lower, fatrop.plant.upper) / 2
        slope = []
        for e in STEP * np.eye(9):
            above, below = (fatrop.solve(state, theta + d, None, action).value for d in (e, -e))
            slope.append((above - below) / (2 * STEP))
        found = fatrop.solve(state, theta, None, action).features
        np.testing.assert_allclose(found, slope, atol=1e-5 * np.abs(slope).max())


def test_features_are_minus_the_parameter_multipliers_of_casadi(fatrop, draw):
    """The solver's own sensitivity, from an Ipopt of this test's making."""
    ocp = fatrop.ocp
    nlp = {"x": ocp.variables, "p": ocp.parameters, "f": ocp.objective, "g": ocp.constraints}
    exact = {"print_level": 0, "sb": "yes", "tol": 1e-10, "bound_relax_factor": 0}
    ipopt = ca.nlpsol("ipopt", "ipopt", nlp, {"print_time": False, "ipopt": exact})
    for state, theta in draw(10, seed=12):
        solution = fatrop.solve(state, theta)
        result = ipopt(
            x0=solution.primal,
            p=np.concatenate([state, theta]),
            lbx=ocp.lower,
            ubx=ocp.upper,
            lbg=np.where(ocp.equality, 0, -np.inf),
            ubg=0,
        )
        assert float(result["f"]) == pytest.approx(solution.value, rel=1e-6)
        multipliers = result["lam_p"].full().ravel()[state.size :]
        scale = np.abs(multipliers).max()
        np.testing.assert_allclose(solution.features, -multipliers, atol=2e-6 * scale)


def test_the_hessian_is_the_differences_of_the_features(fatrop, draw):
    compared = 0
    for state, theta in draw(20, seed=13):
        solution = fatrop.solve(state, theta)
        if not same_side_throughout(fatrop, solution):
            continue
        slope = differences(beside(fatrop, solution), lambda s: s.features)
        found = fatrop.value_hessian(solution)
        np.testing.assert_allclose(found, slope, atol=1e-5 * np.abs(slope).max())
        compared += 1
    assert compared >= 8


def test_the_hessian_is_symmetric(robot, draw):
    for state, theta in draw(10, seed=14):
        hessian = robot.value_hessian(robot.solve(state, theta))
        np.testing.assert_allclose(hessian, hessian.T, atol=1e-11 * np.abs(hessian).max())


def test_the_hessian_of_a_fixed_action_exists_too(fatrop, theta):
    solution = fatrop.solve(fatrop.task.start, theta, action=np.array([0.3, 0.2]))
    slope = []
    for e in STEP * np.eye(9):
        above, below = (
            fatrop.solve(solution.state, theta + d, None, solution.action).features for d in (e, -e)
        )
        slope.append((above - below) / (2 * STEP))
    found = fatrop.value_hessian(solution)
    np.testing.assert_allclose(found, slope, atol=1e-5 * np.abs(slope).max())


def test_minus_the_multiplier_of_the_action_is_the_slope_of_the_action_value(robot, draw):
    rng, compared = np.random.default_rng(15), 0
    for state, theta in draw(10, seed=15):
        action = rng.uniform(robot.plant.lower, robot.plant.upper) / 2
        solution = robot.solve(state, theta, action=action)
        near = [
            [robot.solve(state, theta, solution, action + d) for d in (e, -e)]
            for e in STEP * np.eye(2)
        ]
        moved = max(np.abs(s.primal - solution.primal).max() for pair in near for s in pair)
        if moved > 0.1:  # fell into another local minimum
            continue
        slope = [(above.value - below.value) / (2 * STEP) for above, below in near]
        np.testing.assert_allclose(-solution.multipliers.action, slope, rtol=1e-3, atol=1e-3)
        compared += 1
    assert compared >= 7


def test_the_kkt_residual_of_every_solution_is_small(robot, draw):
    rng = np.random.default_rng(16)
    for state, theta in draw(50, seed=16):
        free = robot.solve(state, theta)
        action = rng.uniform(robot.plant.lower, robot.plant.upper) / 2
        fixed = robot.solve(state, theta, free, action)
        assert robot.kkt_residual(free) < 1e-4
        assert robot.kkt_residual(fixed) < 1e-4


@pytest.mark.parametrize(
    ("field", "index", "by"),
    [
        ("primal", 3, 0.01),  # u_0: neither feasible nor stationary
        ("constraint_duals", 0, 1.0),
        ("bound_duals", 3, 1.0),
    ],
)
def test_the_kkt_residual_notices_what_is_not_a_solution(fatrop, theta, field, index, by):
    solution = fatrop.solve(fatrop.task.start, theta)
    getattr(solution, field)[index] += by
    assert fatrop.kkt_residual(solution) > 1e-3


def test_the_jacobian_of_the_policy_is_its_differences(robot, draw):
    """And so is that of a later stage; with u_0 given, that of the policy is 0."""
    compared = 0
    for state, theta in draw(12, seed=17):
        solution = robot.solve(state, theta)
        if not same_side_throughout(robot, solution):
            continue
        pairs = beside(robot, solution)
        for stage in (0, 4):
            plan = robot.plan_jacobian(solution, stage)
            for found, part in ((plan.states, "states"), (plan.inputs, "inputs")):
                slope = differences(pairs, lambda s, p=part, i=stage: getattr(s, p)[i])
                size = max(1.0, np.abs(slope).max())
                np.testing.assert_allclose(found, slope.T, atol=1e-3 * size)
        given = robot.solve(state, theta, solution, solution.action * 0.9)
        np.testing.assert_allclose(robot.policy_jacobian(given), 0, atol=1e-10)
        compared += 1
    assert compared >= 4


def test_the_jacobian_of_the_policy_is_that_of_the_dense_conditions(controllers, draw):
    riccati, ipopt = controllers["riccati"], controllers["ipopt"]
    for state, theta in draw(20, seed=18):
        solution = riccati.solve(state, theta)
        dense = ipopt.policy_jacobian(solution)
        found = riccati.policy_jacobian(solution)
        assert found.shape == (2, 9)
        np.testing.assert_allclose(found, dense, atol=1e-4 * max(1.0, np.abs(dense).max()))


def test_relative_to_its_plan_and_multipliers_a_solution_violates_less(robot, theta):
    solution = robot.solve(robot.task.start, theta)
    relative = robot.kkt_residual(solution, relative=True)
    assert relative <= robot.kkt_residual(solution)
    solution.primal[3] += 0.1
    assert robot.kkt_residual(solution, relative=True) > 1e-3

"""The Hessian of the value times a vector, beside the dense Hessian and finite differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Obstacle, Riccati, Solution, Task, differential_drive
from nmpcrl.control.codegen import jit
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
START = np.array(paper.START)
STEP = 1e-5
CASADI_SOLVERS = ("fatrop", "ipopt")


@pytest.fixture(scope="module")
def exact() -> Nmpc:
    """The paper's controller, solved so well that features can be subtracted."""
    return paper.nmpc(solver=Riccati(tolerance=1e-11))


def differences(nmpc: Nmpc, solution: Solution, vector: Vector, step: float = STEP) -> Vector:
    """Central differences of the features along a vector, with u_0 fixed if it was."""
    fixed = solution.action if solution.ocp.fixed_action.size else None
    above, below = (
        nmpc.solve(solution.state, solution.theta + d, solution, fixed).features
        for d in (step * vector, -step * vector)
    )
    return (above - below) / (2 * step)


def smooth(nmpc: Nmpc, solution: Solution, vector: Vector) -> Vector | None:
    """The `differences`, if those of twice the step agree: there is no kink within either."""
    near, far = (differences(nmpc, solution, vector, step) for step in (STEP, 2 * STEP))
    return near if np.abs(near - far).max() <= 1e-5 * np.abs(near).max() else None


@pytest.mark.parametrize("fixed", [False, True])
def test_the_product_is_the_difference_of_the_features(exact, draw, fixed):
    """Along drawn directions; where u_0 is fixed as where it is free."""
    rng, compared = np.random.default_rng(50), 0
    for state, theta in draw(40, seed=50):
        action = rng.uniform(exact.plant.lower, exact.plant.upper) / 2 if fixed else None
        solution = exact.solve(state, theta, action=action)
        along = rng.normal(size=9) * theta
        slope = smooth(exact, solution, along)
        if slope is None:
            continue
        product = exact.value_hessian_times(solution, along)
        np.testing.assert_allclose(product, slope, atol=1e-5 * np.abs(slope).max())
        compared += 1
    assert compared >= 36


@pytest.mark.parametrize("fixed", [False, True])
def test_the_product_is_that_of_the_dense_hessian(exact, draw, fixed):
    rng = np.random.default_rng(51)
    for state, theta in draw(60, seed=51):
        action = rng.uniform(exact.plant.lower, exact.plant.upper) if fixed else None
        solution = exact.solve(state, theta, action=action)
        along = rng.normal(size=9) * theta
        dense = exact.value_hessian(solution) @ along
        product = exact.value_hessian_times(solution, along)
        np.testing.assert_allclose(product, dense, atol=1e-5 * np.abs(dense).max())


def test_the_products_with_unit_vectors_are_the_columns_of_the_dense_hessian(exact):
    solution = exact.solve(START, THETA)
    columns = [exact.value_hessian_times(solution, e) for e in np.eye(9)]
    dense = exact.value_hessian(solution)
    np.testing.assert_allclose(np.transpose(columns), dense, atol=1e-6 * np.abs(dense).max())


@pytest.mark.parametrize(("horizon", "count"), [(1, 7), (2, 1), (25, 0)])
def test_horizon_and_number_of_obstacles_do_not_matter_to_it(horizon, count):
    obstacles = tuple(Obstacle(-1.0 + x, 2.5) for x in range(count))
    box = np.array([9.0, 9.0, np.inf])
    task = Task(START, np.array(paper.TARGET), -box, box, obstacles)
    nmpc = Nmpc(differential_drive(), task, horizon=horizon, solver=Riccati(tolerance=1e-11))
    solution = nmpc.solve(START, THETA)
    along = THETA * np.linspace(-1, 1, 9)
    slope = smooth(nmpc, solution, along)
    assert slope is not None
    product = nmpc.value_hessian_times(solution, along)
    np.testing.assert_allclose(product, slope, atol=1e-5 * np.abs(slope).max())


@pytest.mark.parametrize("solver", CASADI_SOLVERS)
def test_casadis_solvers_multiply_by_the_dense_hessian(robot, draw):
    rng = np.random.default_rng(52)
    for state, theta in draw(5, seed=52):
        solution, along = robot.solve(state, theta), rng.normal(size=9)
        product = robot.value_hessian_times(solution, along)
        np.testing.assert_array_equal(product, robot.value_hessian(solution) @ along)


@pytest.mark.parametrize("giver", CASADI_SOLVERS)
def test_the_solution_may_be_another_solvers(controllers, draw, giver):
    riccati, rng = controllers["riccati"], np.random.default_rng(53)
    for state, theta in draw(10, seed=53):
        solution, along = controllers[giver].solve(state, theta), rng.normal(size=9) * theta
        dense = riccati.value_hessian(solution) @ along
        product = riccati.value_hessian_times(solution, along)
        np.testing.assert_allclose(product, dense, atol=1e-4 * np.abs(dense).max())


def test_without_numba_the_product_is_that_of_the_dense_hessian(monkeypatch):
    monkeypatch.setattr(jit, "numba_version", lambda: None)
    nmpc = paper.nmpc()
    with pytest.warns(UserWarning, match="fatrop solves instead of riccati"):
        solution = nmpc.solve(START, THETA)
    product = nmpc.value_hessian_times(solution, THETA)
    np.testing.assert_array_equal(product, nmpc.value_hessian(solution) @ THETA)


vectors = st.lists(st.floats(-1, 1), min_size=9, max_size=9).map(lambda v: np.array(v) * THETA)
states = st.tuples(st.floats(-3, 9), st.floats(-3, 9), st.floats(-4, 4)).map(np.array)
thetas = st.lists(st.floats(0.3, 3), min_size=9, max_size=9).map(lambda v: np.array(v) * THETA)


@settings(derandomize=True, deadline=None, max_examples=100)
@given(state=states, theta=thetas, u=vectors, v=vectors)
def test_the_hessian_behind_the_products_is_symmetric(controllers, state, theta, u, v):
    """u'Hv = v'Hu, whichever constraints are active and however weakly."""
    riccati = controllers["riccati"]
    solution = riccati.solve(state, theta)
    one, other = (riccati.value_hessian_times(solution, w) for w in (u, v))
    size = np.abs(u) @ np.abs(other) + np.abs(v) @ np.abs(one)
    assert v @ one == pytest.approx(u @ other, abs=1e-9 + 1e-6 * size)


@settings(derandomize=True, deadline=None, max_examples=50)
@given(state=states, u=vectors, v=vectors, times=st.floats(-100, 100))
def test_the_product_is_linear_in_the_vector(controllers, state, u, v, times):
    riccati = controllers["riccati"]
    solution = riccati.solve(state, THETA)
    product = riccati.value_hessian_times(solution, u + times * v)
    parts = [riccati.value_hessian_times(solution, u), riccati.value_hessian_times(solution, v)]
    size = np.abs(parts[0]).max() + abs(times) * np.abs(parts[1]).max()
    np.testing.assert_allclose(product, parts[0] + times * parts[1], atol=1e-10 + 1e-7 * size)


def test_the_product_with_nothing_is_nothing(controllers):
    for nmpc in controllers.values():
        solution = nmpc.solve(START, THETA)
        np.testing.assert_array_equal(nmpc.value_hessian_times(solution, np.zeros(9)), 0)


@pytest.mark.parametrize("radius", [0.5, 1.25])
def test_the_slack_of_stage_zero_is_straight_on_either_side_of_its_kink(radius):
    """Inside an obstacle as on its boundary, counted as in it or not: it bends nothing."""
    theta = np.append(THETA[:8], 0.0)
    box = np.array([9.0, 9.0, np.inf])
    start = np.array([radius, 0.0, 0.3])
    task = Task(start, np.array([5.0, 4.0, 1.0]), -box, box, (Obstacle(0.0, 0.0),))
    sides = [
        Nmpc(differential_drive(), task, solver=Riccati(1e-11), ties_active=active)
        for active in (False, True)
    ]
    one, other = (nmpc.value_hessian_times(nmpc.solve(start, theta), theta) for nmpc in sides)
    np.testing.assert_array_equal(one, other)
    nmpc = sides[0]
    if radius < 1.25:
        slope = smooth(nmpc, nmpc.solve(start, theta), theta)
        np.testing.assert_allclose(one, slope, atol=1e-5 * np.abs(slope).max())


def test_at_a_bound_that_is_just_reached_the_curvature_lies_between_its_sides(
    point_mass, open_field
):
    """An input free to follow theta bends V down; one that is held does not."""
    theta = np.array([1.2, 0.7, 0.3, 0.2, 0.4, 0.9, 1.5, 2.0, 0.6, 0.8, 0.0])
    state, along = np.array([0.9, -1.5, 0.0, 0.0]), np.linspace(0.5, 1.5, 11)

    def curvature(bound: float) -> float:
        nmpc = Nmpc(point_mass(bound), open_field(), horizon=1)
        return along @ nmpc.value_hessian_times(nmpc.solve(state, theta), along)

    wide = Nmpc(point_mass(), open_field(), horizon=1).solve(state, theta)
    reached = np.abs(wide.action).max()
    free, held = curvature(1.001 * reached), curvature(0.999 * reached)
    assert free < held - 1e-3 * abs(held)
    margin = 0.01 * (held - free)
    assert free - margin <= curvature(reached) <= held + margin


def test_the_product_changes_neither_the_solution_nor_the_vector(controllers):
    riccati, vector = controllers["riccati"], THETA.copy()
    solution = riccati.solve(START, THETA)
    before = solution.point.copy()
    one, other = (riccati.value_hessian_times(solution, vector) for _ in range(2))
    np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(solution.point, before)
    np.testing.assert_array_equal(vector, THETA)


@pytest.mark.parametrize(
    ("vector", "message"),
    [
        (np.zeros(8), r"vector has shape \(8,\); it must be \(9,\)"),
        (np.zeros((9, 9)), r"vector has shape \(9, 9\); it must be \(9,\)"),
        (np.full(9, np.nan), "vector .* must hold finite numbers"),
        ("along", "vector = 'along' must hold 9 numbers"),
    ],
)
def test_a_vector_that_is_none_is_refused(robot, vector, message):
    solution = robot.solve(START, THETA)
    with pytest.raises(ValueError, match=message):
        robot.value_hessian_times(solution, vector)

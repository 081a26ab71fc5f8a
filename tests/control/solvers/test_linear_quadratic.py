"""A point mass without active constraints: Riccati's recursion says what Eq. (2) must give."""

import numpy as np
import pytest

from nmpcrl.control import Nmpc, Obstacle

H, GAMMA = 0.2, 0.9
A = np.block([[np.eye(2), H * np.eye(2)], [np.zeros((2, 2)), np.eye(2)]])
B = np.vstack([H**2 / 2 * np.eye(2), H * np.eye(2)])
STATE = np.array([3.0, 1.0, -0.5, 2.0])
THETA = np.array([1.2, 0.7, 0.3, -0.2, 0.4, 0.9, 1.5, 2.0, 0.6, 0.8, 0.05])
FAR = (Obstacle(500.0, 500.0), Obstacle(-500.0, 0.0))


def riccati(theta, horizon):
    """Cost-to-go matrices P_0, ..., P_N, where V_i(e) = e' P_i e; theta may be complex."""
    Q, R = np.diag(theta[:4] ** 2), np.diag(theta[4:6] ** 2)
    P = [np.diag(theta[6:10] ** 2)]
    for _ in range(horizon):
        feedback = np.linalg.solve(R + GAMMA * B.T @ P[0] @ B, GAMMA * B.T @ P[0] @ A)
        P.insert(0, Q + GAMMA * A.T @ P[0] @ (A - B @ feedback))
    return P


def value(theta, error, horizon):
    return error @ riccati(theta, horizon)[0] @ error


def gradient(theta, error, horizon):
    """By complex steps through the recursion: exact to rounding."""
    step = 1e-30j * np.eye(theta.size)
    return np.array([value(theta + e, error, horizon).imag / 1e-30 for e in step])


def hessian(theta, error, horizon):
    step = 1e-6 * np.eye(theta.size)
    rows = [gradient(theta + e, error, horizon) - gradient(theta - e, error, horizon) for e in step]
    return np.array(rows) / 2e-6


@pytest.fixture(params=[1, 2, 10])
def horizon(request):
    return request.param


@pytest.fixture
def nmpc(point_mass, open_field, horizon, solver):
    return Nmpc(point_mass(), open_field(FAR), horizon=horizon, gamma=GAMMA, solver=solver)


@pytest.fixture
def error(open_field):
    return STATE - open_field().target


def test_the_value_is_riccatis(nmpc, horizon, error):
    solution = nmpc.solve(STATE, THETA)
    assert solution.value == pytest.approx(value(THETA, error, horizon), rel=1e-7)


def test_the_plan_is_riccatis_feedback(nmpc, horizon, error):
    P, R = riccati(THETA, horizon), np.diag(THETA[4:6] ** 2)
    e, inputs = error, []
    for i in range(horizon):
        S = P[i + 1]
        inputs.append(-np.linalg.solve(R + GAMMA * B.T @ S @ B, GAMMA * B.T @ S @ A @ e))
        e = A @ e + B @ inputs[-1]
    solution = nmpc.solve(STATE, THETA)
    np.testing.assert_allclose(solution.inputs, inputs, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(solution.states[-1] - nmpc.task.target, e, atol=1e-5)


def test_the_features_are_the_slope_of_riccatis_value(nmpc, horizon, error):
    exact = gradient(THETA, error, horizon)
    np.testing.assert_allclose(nmpc.solve(STATE, THETA).features, exact, rtol=1e-5, atol=1e-6)


def test_the_hessian_is_the_curvature_of_riccatis_value(nmpc, horizon, error):
    exact = hessian(THETA, error, horizon)
    found = nmpc.value_hessian(nmpc.solve(STATE, THETA))
    np.testing.assert_allclose(found, exact, atol=1e-5 * np.abs(exact).max())


def test_the_hessian_times_a_vector_is_the_curvature_of_riccatis_value_along_it(
    nmpc, horizon, error
):
    along, solution = np.linspace(-1, 1, THETA.size), nmpc.solve(STATE, THETA)
    exact = hessian(THETA, error, horizon)
    found = nmpc.value_hessian_times(solution, along)
    np.testing.assert_allclose(found, exact @ along, atol=1e-5 * np.abs(exact).max())


def test_the_action_value_is_one_step_and_riccati_from_there(nmpc, horizon, error):
    action = np.array([4.0, -1.0])
    step = THETA[:4] ** 2 @ error**2 + THETA[4:6] ** 2 @ action**2
    later = riccati(THETA, horizon)[1]
    e = A @ error + B @ action
    solution = nmpc.solve(STATE, THETA, action=action)
    assert solution.value == pytest.approx(step + GAMMA * e @ later @ e, rel=1e-7)
    slope = 2 * THETA[4:6] ** 2 * action + 2 * GAMMA * B.T @ later @ e
    np.testing.assert_allclose(-solution.multipliers.action, slope, rtol=1e-5)


def test_gamma_one_does_not_discount(point_mass, open_field, error):
    nmpc = Nmpc(point_mass(), open_field(), horizon=1, gamma=1.0)
    stage, inputs, terminal = THETA[:4] ** 2, THETA[4:6] ** 2, np.diag(THETA[6:10] ** 2)
    u = -np.linalg.solve(np.diag(inputs) + B.T @ terminal @ B, B.T @ terminal @ A @ error)
    e = A @ error + B @ u
    by_hand = stage @ error**2 + inputs @ u**2 + e @ terminal @ e
    assert nmpc.solve(STATE, THETA).value == pytest.approx(by_hand, rel=1e-7)


@pytest.mark.parametrize("seed", range(5))
def test_an_input_at_its_bound_costs_what_the_clipped_parabola_says(
    point_mass, open_field, solver, seed
):
    """With one stage the axes are separate parabolas in u, so clipping the minimum is exact."""
    rng = np.random.default_rng(seed)
    state, theta = rng.normal(scale=3, size=4), rng.uniform(0.3, 2, 11)
    nmpc = Nmpc(point_mass(bound=0.3), open_field(), horizon=1, gamma=GAMMA, solver=solver)
    e = state - nmpc.task.target
    P = np.diag(theta[6:10] ** 2)
    curvature = np.diag(theta[4:6] ** 2) + GAMMA * B.T @ P @ B
    u = np.clip(-np.linalg.solve(curvature, GAMMA * B.T @ P @ A @ e), -0.3, 0.3)
    assert (np.abs(u) == 0.3).any()
    after = A @ e + B @ u
    solution = nmpc.solve(state, theta)
    np.testing.assert_allclose(solution.action, u, atol=1e-6)
    np.testing.assert_allclose(
        solution.features,
        [*2 * theta[:4] * e**2, *2 * theta[4:6] * u**2, *2 * GAMMA * theta[6:10] * after**2, 0],
        rtol=1e-5,
        atol=1e-6,
    )


def test_the_box_holds_a_predicted_state_back(point_mass, open_field, solver):
    """Wanting to go faster than the box allows, the mass goes as fast as the box allows."""
    nmpc = Nmpc(point_mass(), open_field(box=2.5), horizon=1, gamma=GAMMA, solver=solver)
    state = np.array([-2.4, 0.0, 2.4, 0.0])
    theta = np.array([1.0, 1.0, 0.1, 0.1, 0.01, 0.01, 9.0, 9.0, 0.1, 0.1, 0.0])
    solution = nmpc.solve(state, theta)
    assert solution.states[1, 2] == pytest.approx(2.5, abs=1e-6)
    assert solution.action[0] == pytest.approx((2.5 - 2.4) / H, abs=1e-5)
    assert solution.multipliers.states[1, 2] > 0

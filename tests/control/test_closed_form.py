"""Riccati's recursion says what Eq. (2) must give where the plant is linear and nothing is active.

All of A, B, Q, R and an offset are learned; the plant is unstable. With one stage each input is a
parabola, which a bound, a wall or a price cuts off.
"""

import casadi as ca
import numpy as np
import pytest
from small_problems import open_field, point_mass

from nmpcrl.control import Nmpc, Problem, Soft
from nmpcrl.control.solvers import SOLVERS

GAMMA = 0.9
A = np.array([[0.9, 0.35], [0.0, 1.5]])
B = np.array([[0.08, 0.3], [0.2, -0.1]])
Q, R = np.array([[1.0, 0.2], [0.2, 0.5]]), np.diag([0.3, 0.6])
STATE = np.array([0.7, -1.1])

pytestmark = pytest.mark.usefixtures("interpreted")


@pytest.fixture(params=[1, 6, 25])
def linear(request) -> Problem:
    return Problem(
        states=2, inputs=2, horizon=request.param, gamma=GAMMA,
        theta={"A": A, "B": B, "Q": Q, "R": R, "b": np.array([0.02, -0.01]), "V0": 0.3},
        model=lambda x, u, th: th["A"] @ x + th["B"] @ u + th["b"],
        stage=lambda x, u, th: ca.bilin(th["Q"], x, x) + ca.bilin(th["R"], u, u),
        terminal=lambda x, th: ca.bilin(th["Q"], x, x),
        initial=lambda x, th: th["V0"],
        soft=[Soft(lambda x, u, th: x - 50.0)],  # which is never reached
    )  # fmt: skip


@pytest.fixture(params=SOLVERS)
def nmpc(request, linear) -> Nmpc:
    return Nmpc(linear, solver=SOLVERS[request.param](tolerance=1e-10))


def recursion(linear, theta, action=None):
    """V(s), or Q(s, action), and the gains K with u_i = -K_i (x_i, 1); theta may be complex."""
    at = {name: linear.names.part(name, theta).reshape(linear.names[name]) for name in linear.names}
    one, zero = np.ones((1, 1)), np.zeros
    plant = np.block([[at["A"], at["b"][:, None]], [zero((1, 2)), one]])
    inputs = np.vstack([at["B"], zero((1, 2))])
    weight = np.block([[(at["Q"] + at["Q"].T) / 2, zero((2, 1))], [zero((1, 3))]])
    price = (at["R"] + at["R"].T) / 2
    P, gains = weight, []
    for _ in range(linear.horizon):
        curved, after = price + GAMMA * inputs.T @ P @ inputs, P
        gains.insert(0, np.linalg.solve(curved, GAMMA * inputs.T @ P @ plant))
        P = weight + GAMMA * plant.T @ P @ (plant - inputs @ gains[0])
    z = np.append(STATE, 1.0)
    if action is None:
        return z @ P @ z + at["V0"], gains
    later = plant @ z + inputs @ action
    stage = z @ weight @ z + action @ price @ action
    return stage + GAMMA * later @ after @ later + at["V0"], gains


def slopes(linear, theta, *action):
    """Of value and policy, by complex steps: exact to rounding."""
    found = [recursion(linear, theta + e, *action) for e in 1e-30j * np.eye(theta.size)]
    policy = [-gains[0] @ np.append(STATE, 1.0) for _, gains in found]
    return np.imag([value for value, _ in found]) / 1e-30, np.imag(policy).T / 1e-30


def test_plan_action_value_and_all_their_derivatives_are_riccatis(linear, nmpc):
    theta, step, along = linear.theta, 1e-6, np.linspace(-1, 1, linear.theta.size)
    value, gains = recursion(linear, theta)
    slope, policy = slopes(linear, theta)
    above, below = (slopes(linear, theta + s * along)[0] for s in (step, -step))
    solution, x = nmpc.solve(STATE, theta), STATE
    assert solution.value == pytest.approx(value, rel=1e-8)
    for K, u in zip(gains, solution.inputs, strict=True):
        np.testing.assert_allclose(u, -K @ np.append(x, 1.0), atol=1e-6)
        x = A @ x + B @ u + [0.02, -0.01]
    np.testing.assert_allclose(solution.states[-1], x, atol=1e-6)
    np.testing.assert_allclose(solution.features, slope, atol=1e-6)
    np.testing.assert_allclose(nmpc.policy_jacobian(solution), policy, atol=1e-6)
    for product in (
        nmpc.value_hessian_times(solution, along), nmpc.value_hessian(solution) @ along,
    ):  # fmt: skip
        np.testing.assert_allclose(product, (above - below) / (2 * step), atol=1e-5)
    action = np.array([4.0, -1.0])
    value, _ = recursion(linear, linear.theta, action)
    solution = nmpc.solve(STATE, linear.theta, action=action)
    assert solution.value == pytest.approx(value, rel=1e-8)
    slope, _ = slopes(linear, linear.theta, action)
    np.testing.assert_allclose(solution.features, slope, atol=1e-5)
    by_action = [recursion(linear, linear.theta, action + e)[0].imag for e in 1e-30j * np.eye(2)]
    pull = solution.multipliers.action
    np.testing.assert_allclose(-pull, np.divide(by_action, 1e-30), rtol=1e-5)
    np.testing.assert_allclose(nmpc.policy_jacobian(solution), 0, atol=1e-12)


# Of the point mass: x+ = AXIS x + PUSH u in each of two axes.
H = 0.2
REACH = np.array([H**2 / 2, H])
THETA = np.array([1.0, 1.0, 0.1, 0.1, 0.01, 0.01, 9.0, 9.0, 0.1, 0.1, 0.0])


def axis(state, target, theta, k: int) -> tuple[float, float, np.ndarray]:
    """Slope and curvature in u of one axis' parabola, and where the axis is with u = 0."""
    rest = np.array([state[k] + H * state[2 + k], state[2 + k]])
    weights = theta[6:][[k, 2 + k]] ** 2
    slope = GAMMA * weights @ ((rest - target[[k, 2 + k]]) * REACH)
    return slope, theta[4 + k] ** 2 + GAMMA * weights @ REACH**2, rest


@pytest.mark.parametrize("seed", range(3))
def test_an_input_at_its_bound_is_the_clipped_minimum(solver, seed):
    rng = np.random.default_rng(seed)
    state, theta = rng.normal(scale=3, size=4), rng.uniform(0.3, 2, 11)
    nmpc = Nmpc(point_mass(bound=0.3), open_field(), horizon=1, gamma=GAMMA, solver=solver)
    target = nmpc.task.target
    axes = [axis(state, target, theta, k) for k in (0, 1)]
    u = np.array([np.clip(-slope / curve, -0.3, 0.3) for slope, curve, _ in axes])
    assert (np.abs(u) == 0.3).any()
    solution = nmpc.solve(state, theta)
    np.testing.assert_allclose(solution.action, u, atol=1e-6)
    later = np.transpose([rest + REACH * u[k] for k, (*_, rest) in enumerate(axes)]).ravel()
    parts = (state - target) ** 2, u**2, GAMMA * (later - target) ** 2
    features = 2 * theta[:10] * np.concatenate(parts)
    np.testing.assert_allclose(solution.features, [*features, 0], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("omega", [None, 0.1, 3.0, 100.0])
def test_a_wall_holds_a_state_back_as_far_as_it_costs(solver, omega):
    """A hard wall of the speed at 2.5, or one whose price is the slope beyond it."""
    price = {} if omega is None else {"slack_weight": omega}
    task, state = open_field(box=2.5, soft_box=omega is not None), np.array([-2.4, -2, 2.3, 0.0])
    nmpc = Nmpc(point_mass(), task, horizon=1, gamma=GAMMA, solver=solver, **price)
    slope, curve, rest = axis(state, task.target, THETA, 0)
    wall, free = (2.5 - rest[1]) / H, -slope / curve
    charged = -np.inf if omega is None else -(slope + GAMMA * omega * H / 2) / curve
    u = free if free <= wall else max(charged, wall)
    left = max(0.0, rest[1] + H * u - 2.5)
    other, bend, aside = axis(state, task.target, THETA, 1)
    v = -other / bend
    solution = nmpc.solve(state, THETA)
    np.testing.assert_allclose(solution.action, [u, v], atol=1e-5)
    assert (left > 0) == (omega in (0.1, 3.0))
    later = np.array([rest[0] + REACH[0] * u, aside[0] + REACH[0] * v,
                      rest[1] + H * u, aside[1] + H * v])  # fmt: skip
    value = THETA[:4] ** 2 @ (state - task.target) ** 2 + THETA[4:6] ** 2 @ [u**2, v**2]
    value += GAMMA * (THETA[6:10] ** 2 @ (later - task.target) ** 2 + (omega or 0) * left)
    assert solution.value == pytest.approx(value, rel=1e-6)
    if omega is None:
        assert solution.multipliers.states[1, 2] > 0
        assert solution.violation == pytest.approx(0, abs=1e-6)
    else:
        np.testing.assert_allclose(solution.slacks[1].sum(), left, atol=1e-6)

"""`Problem` where the truth is known: a linear plant whose A, B, Q and R are learned.

Without active constraints, Riccati's recursion gives the value, its slope, and the policy's.
"""

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Nmpc, Problem, Riccati, Soft
from nmpcrl.control.solvers import SOLVERS

GAMMA, N = 0.9, 6
A = np.array([[0.9, 0.35], [0.0, 1.1]])
B = np.array([[0.08, 0.3], [0.2, -0.1]])
Q, R = np.array([[1.0, 0.2], [0.2, 0.5]]), np.diag([0.3, 0.6])
STATE = np.array([0.7, -1.1])

pytestmark = pytest.mark.usefixtures("interpreted")


@pytest.fixture(scope="module")
def linear() -> Problem:
    return Problem(
        states=2,
        inputs=2,
        horizon=N,
        gamma=GAMMA,
        theta={"A": A, "B": B, "Q": Q, "R": R, "b": np.array([0.02, -0.01]), "V0": 0.3},
        model=lambda x, u, th: th["A"] @ x + th["B"] @ u + th["b"],
        stage=lambda x, u, th: ca.bilin(th["Q"], x, x) + ca.bilin(th["R"], u, u),
        terminal=lambda x, th: ca.bilin(th["Q"], x, x),
        initial=lambda x, th: th["V0"],
        soft=[Soft(lambda x, u, th: x - 50.0)],  # which is never reached
    )


@pytest.fixture(scope="module", params=SOLVERS)
def nmpc(request, linear) -> Nmpc:
    return Nmpc(linear, solver=SOLVERS[request.param](tolerance=1e-10))


def recursion(linear, theta):
    """V(s) = z' P z and u_0 = -K z of z = (s, 1); theta may be complex."""
    at = {name: linear.names.part(name, theta).reshape(linear.names[name]) for name in linear.names}
    one, zero = np.ones((1, 1)), np.zeros
    plant = np.block([[at["A"], at["b"][:, None]], [zero((1, 2)), one]])
    inputs = np.vstack([at["B"], zero((1, 2))])
    weight = np.block([[(at["Q"] + at["Q"].T) / 2, zero((2, 1))], [zero((1, 3))]])
    price = (at["R"] + at["R"].T) / 2
    P = weight
    for _ in range(N):
        curved = price + GAMMA * inputs.T @ P @ inputs
        K = np.linalg.solve(curved, GAMMA * inputs.T @ P @ plant)
        P = weight + GAMMA * plant.T @ P @ (plant - inputs @ K)
    z = np.append(STATE, 1.0)
    return z @ P @ z + at["V0"], -K @ z


def slopes(linear, theta):
    """Of both, by complex steps: exact to rounding."""
    steps = 1e-30j * np.eye(theta.size)
    found = [recursion(linear, theta + step) for step in steps]
    value, policy = zip(*found, strict=True)
    return np.imag(value) / 1e-30, np.imag(policy).T / 1e-30


def test_value_and_policy_are_riccatis(linear, nmpc):
    value, policy = recursion(linear, linear.theta)
    solution = nmpc.solve(STATE, linear.theta)
    assert solution.value == pytest.approx(value, rel=1e-8)
    np.testing.assert_allclose(solution.action, policy, atol=1e-6)


def test_the_features_are_the_slope_of_riccatis_value(linear, nmpc):
    slope, _ = slopes(linear, linear.theta)
    np.testing.assert_allclose(nmpc.solve(STATE, linear.theta).features, slope, atol=1e-6)


def test_the_policys_jacobian_is_that_of_riccatis_feedback(linear, nmpc):
    _, policy = slopes(linear, linear.theta)
    solution = nmpc.solve(STATE, linear.theta)
    np.testing.assert_allclose(nmpc.policy_jacobian(solution), policy, atol=1e-6)
    given = nmpc.solve(STATE, linear.theta, action=np.zeros(2))
    np.testing.assert_allclose(nmpc.policy_jacobian(given), 0, atol=1e-12)


def test_the_hessian_is_the_curvature_of_riccatis_value(linear, nmpc):
    step, along = 1e-6, np.linspace(-1, 1, linear.theta.size)
    above, below = (slopes(linear, linear.theta + s * along)[0] for s in (step, -step))
    product = nmpc.value_hessian_times(nmpc.solve(STATE, linear.theta), along)
    np.testing.assert_allclose(product, (above - below) / (2 * step), atol=1e-5)


def test_the_units_of_a_cost_do_not_matter(linear):
    """A cost a million times as large, or as small, has the same plan and that much value."""
    plain = Nmpc(linear, solver=Riccati()).solve(STATE, linear.theta)
    for times in (1e6, 1e-6):
        problem = Problem(
            states=2,
            inputs=2,
            horizon=N,
            gamma=GAMMA,
            theta={"Q": times * Q},
            model=lambda x, u, th: A @ x + B @ u + ca.DM([0.02, -0.01]),
            stage=lambda x, u, th, t=times: ca.bilin(th["Q"], x, x) + t * ca.bilin(ca.DM(R), u, u),
            terminal=lambda x, th: ca.bilin(th["Q"], x, x),
        )
        solution = Nmpc(problem, solver=Riccati()).solve(STATE, problem.theta)
        assert solution.value == pytest.approx(times * (plain.value - 0.3), rel=1e-6)
        np.testing.assert_allclose(solution.inputs, plain.inputs, atol=1e-5)

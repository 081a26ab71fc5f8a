"""The deterministic policy gradient: its critic in closed form (LQR), and beside mpcrl's."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from learning.small_runs import differences
from scipy.linalg import solve_discrete_lyapunov

from nmpcrl.learning import Transition, Weights, policy_gradient
from nmpcrl.learning.policy_gradient import (
    CriticMeans,
    lstd_advantage,
    lstd_value,
    monomials,
    policy_gradient_estimate,
    policy_statistics,
)

A, B = np.array([[0.9, 0.35], [0.0, 1.1]]), np.array([[0.08], [0.2]])
Q, R, GAMMA = np.diag([1.0, 2.0]), np.array([[0.5]]), 0.9
K = np.array([[1.0, 2.0]])  # stabilises A - B K
E = 0.3  # size of the exploration


class Gain:
    """The policy -K s, theta = K."""

    gamma = GAMMA

    def policy_jacobian(self, solution):
        return -solution.state[None]


def transition(state, exploration, **more):
    plan = -K @ state
    action = plan + exploration
    solution = SimpleNamespace(
        state=state, action=plan, value=0.0, ocp=SimpleNamespace(fixed_action=np.zeros(0))
    )
    cost = float(state @ Q @ state + action @ R @ action)
    return Transition(state, action, cost, A @ state + B @ action, solution, **more)


def pairs(count=30):
    """Exploration of both signs in every state: even terms drop out of the critic."""
    states = np.random.default_rng(1).normal(size=(count, 2))
    steps = [transition(s, sign * np.array([E])) for s in states for sign in (1, -1)]
    return [*steps[:-1], replace(steps[-1], last=True)]


def means_of(transitions):
    rows = [policy_statistics(Gain(), t, np.nan) for t in transitions]
    return CriticMeans(*(np.mean(column, axis=0) for column in zip(*rows, strict=True)))


def value(gain):
    """The P with value s'P s of -K s: P = Q + K'R K + gamma (A - B K)'P (A - B K)."""
    closed = np.sqrt(GAMMA) * (A - B @ gain)
    return solve_discrete_lyapunov(closed.T, Q + gain.T @ R @ gain)


P = value(K)
SLOPE = 2 * (GAMMA * B.T @ P @ (A - B @ K) - R @ K)  # dQ / da in a = -K s, times s


def test_the_critic_has_value_and_slope_and_the_gradient_is_that_of_the_return():
    means = means_of(pairs())
    v = lstd_value(means, 0.0)
    curvature = float((R + GAMMA * B.T @ P @ B).item())
    expected = [E**2 * curvature / (1 - GAMMA), 0, 0, P[0, 0], 2 * P[0, 1], P[1, 1]]
    np.testing.assert_allclose(v, expected, atol=1e-7)
    np.testing.assert_allclose(lstd_advantage(means, v, 0.0), -SLOPE.ravel(), atol=1e-7)  # psi -s e
    learner, weights = policy_gradient(Gain(), 0.1, regularisation=0.0), Weights(K.ravel())
    for step in pairs():
        weights = learner.step(weights, step).weights
    gradient = np.mean([-(SLOPE @ t.state) * t.state for t in pairs()], axis=0)
    np.testing.assert_allclose(weights.theta, K.ravel() - 0.1 * gradient, atol=1e-7)
    starts = np.random.default_rng(2).normal(size=(40, 2))
    covariance = starts.T @ starts / len(starts)
    numeric = differences(lambda gain: np.trace(value(gain[None]) @ covariance), K.ravel(), 1e-6)
    means = means_of(pairs())
    visited = solve_discrete_lyapunov(np.sqrt(GAMMA) * (A - B @ K), covariance)
    found, _ = policy_gradient_estimate(0.0, *means._replace(fisher=visited))
    np.testing.assert_allclose(found, numeric, rtol=1e-5)


@pytest.mark.filterwarnings("ignore")
def test_the_gradient_is_that_of_mpcrl():
    from mpcrl.agents import lstd_dpg

    rng, count, rho = np.random.default_rng(3), 40, 1e-3
    states, costs = rng.normal(size=(count + 1, 2)), rng.normal(size=count)
    jacobian, noise = rng.normal(size=(count, 3, 1)), rng.normal(size=(count, 1, 1))
    Phi, Psi = np.array([monomials(s) for s in states]), (jacobian @ noise)[..., 0]
    v = lstd_dpg._compute_cafa_weight_v.py_func(Phi, costs, GAMMA, rho)
    w = lstd_dpg._compute_cafa_weight_w.py_func(Phi, Psi, costs, v, GAMMA, rho)
    nmpc = SimpleNamespace(gamma=GAMMA, policy_jacobian=lambda solution: solution.jacobian)
    free, statistics = SimpleNamespace(fixed_action=np.zeros(0)), []
    for k in range(count):
        solution = SimpleNamespace(action=np.zeros(1), jacobian=jacobian[k].T, ocp=free)
        step = Transition(states[k], noise[k, 0], costs[k], states[k + 1], solution)
        statistics.append(policy_statistics(nmpc, step, 0.0))
    sums = [np.sum(column, axis=0) for column in zip(*statistics, strict=True)]
    found, fisher = policy_gradient_estimate(rho, *sums)
    np.testing.assert_allclose(fisher, (jacobian @ jacobian.transpose(0, 2, 1)).sum(0))
    np.testing.assert_allclose(found, fisher @ w, rtol=1e-8)


def test_a_state_that_ends_an_episode_is_worth_nothing_and_a_fixed_action_is_refused():
    one = transition(np.array([1.0, 2.0]), np.array([E]), end=True)
    phi = monomials(one.state)
    found, *_ = policy_statistics(Gain(), one, np.nan)
    np.testing.assert_allclose(found, np.outer(phi, phi))
    one.solution.ocp.fixed_action = np.zeros(1)
    with pytest.raises(ValueError, match="call train without constrained"):
        policy_gradient(Gain()).step(Weights(K.ravel()), one)

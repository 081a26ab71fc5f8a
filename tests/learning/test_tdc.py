"""Exact nonlinear gradient TD: it descends the projected Bellman error, and Eq. (16) does not."""

import numpy as np
import pytest
from learning.small_runs import differences

from nmpcrl.learning import Transition, Weights, gradient_expected_sarsa, gradient_tdc

ALPHA, BETA = 0.1, 0.01


def test_tdc_by_hand(quadratic, transition, weights):
    """s'theta = -1 and s+'theta = 3/2; the old w everywhere."""
    step = transition(weights.theta, controller=quadratic)
    update = gradient_tdc(quadratic, ALPHA, BETA).step(weights, step)
    s, after = step.state, step.next_state
    delta = 4.0 + 0.9 * 2.25 - 1.0
    phi, phi_next = -2 * s, 3 * after
    overlap = -2 * (0.1 + 0.6)  # w'phi
    h = (delta - overlap) * 2 * s * (0.1 + 0.6)
    moved = ALPHA * (delta * phi - 0.9 * overlap * phi_next - h)
    assert update.delta == pytest.approx(delta)
    np.testing.assert_allclose(update.weights.theta, weights.theta + moved)
    np.testing.assert_allclose(update.weights.w, weights.w + BETA * (delta - overlap) * phi)
    ((solution, vector),) = quadratic.products
    assert (solution is step.solution, vector is weights.w) == (True, True)


@pytest.mark.parametrize("curvature", [True, False])
def test_theta_is_projected_and_w_is_not(quadratic, transition, weights, curvature):
    """Without the curvature it is GES, which asks for no Hessian."""
    step, (least, most) = transition(weights.theta, controller=quadratic), (-1.5, 0.6)
    free, held = (
        gradient_tdc(quadratic, ALPHA, 10.0, curvature=curvature, projection=bounds)
        .step(weights, step).weights
        for bounds in (None, (least, most))
    )  # fmt: skip
    inside = (free.theta > least) & (free.theta < most)
    assert inside.any()
    assert not inside.all()
    np.testing.assert_array_equal(held.theta, np.clip(free.theta, least, most))
    np.testing.assert_array_equal(held.w, free.w)
    assert (np.abs(held.w) > most).any()
    ges = gradient_expected_sarsa(quadratic, ALPHA, 10.0).step(weights, step).weights
    np.testing.assert_array_equal(free.w, ges.w)
    assert np.array_equal(free.theta, ges.theta) != curvature
    assert bool(quadratic.products) == curvature


class Process:
    """A Markov chain of six states in three dimensions: features cannot fit all Bellman errors."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.states = rng.normal(size=(6, 3))
        self.P = rng.dirichlet(np.ones(6), size=6)  # P[i, j], how likely j follows i
        self.costs = rng.uniform(0, 3, 6)
        self.visits = rng.dirichlet(np.full(6, 5.0))  # share of each state

    def expected_step(self, learner, controller, weights):
        """theta and w after the mean of a learner's step over all transitions."""
        moved = []
        for state, cost in zip(self.states, self.costs, strict=True):
            solution = controller.solve(state, weights.theta)
            for after in self.states:
                step = learner.step(weights, Transition(state, None, cost, after, solution))
                moved.append([step.weights.theta, step.weights.w])
        return np.average(moved, axis=0, weights=np.ravel(self.visits[:, None] * self.P))

    def fit(self, controller, theta):
        """Weights of the least-squares fit of features to Bellman errors, and its size: Eq. (14).

        The projection is on the tangent space of the value in theta.
        """
        values = np.array([controller.value(state, theta) for state in self.states])
        features = np.array([controller.features(state, theta) for state in self.states])
        errors, root = (
            self.costs + controller.gamma * self.P @ values - values,
            np.sqrt(self.visits),
        )
        w = np.linalg.lstsq(root[:, None] * features, root * errors, rcond=None)[0]
        return w, self.visits @ (features @ w) ** 2


@pytest.mark.parametrize("seed", range(5))
def test_with_w_at_its_best_theta_descends_the_projected_bellman_error(quadratic, weights, seed):
    """Maei et al. (2009): the expected step is minus half the gradient; Eq. (16) misses it."""
    process, theta = Process(seed), weights.theta
    w, _ = process.fit(quadratic, theta)
    tdc, printed = (
        process.expected_step(make(quadratic, 1.0, 1.0), quadratic, Weights(theta, w))
        for make in (gradient_tdc, gradient_expected_sarsa)
    )
    descent = -differences(lambda theta: process.fit(quadratic, theta)[1], theta, 1e-5) / 2
    np.testing.assert_allclose(tdc[0] - theta, descent, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(tdc[1], w, atol=1e-12)  # w has nothing left to learn
    assert np.linalg.norm(printed[0] - theta - descent) > 0.02 * np.linalg.norm(descent)

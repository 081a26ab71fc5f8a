"""Exact nonlinear gradient TD: it descends the projected Bellman error, and Eq. (16) does not."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from learning.small_runs import differences

from nmpcrl.learning import (
    Transition,
    Weights,
    gradient_expected_sarsa,
    gradient_tdc,
)

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


@dataclass
class Process:
    """A Markov chain with costs, visited so often in each state."""

    states: np.ndarray  # one row a state, shape (S, n)
    P: np.ndarray  # P[i, j], how likely j follows i, shape (S, S)
    costs: np.ndarray  # shape (S,)
    visits: np.ndarray  # shape (S,), sums to 1

    def expected_step(self, learner, controller, weights):
        """The mean of a learner's step over all transitions."""
        theta, w = np.zeros_like(weights.theta), np.zeros_like(weights.w)
        for i, state in enumerate(self.states):
            solution = controller.solve(state, weights.theta)
            for j in np.flatnonzero(self.P[i]):
                step = Transition(state, np.zeros(2), self.costs[i], self.states[j], solution)
                moved = learner.step(weights, step).weights
                theta += self.visits[i] * self.P[i, j] * moved.theta
                w += self.visits[i] * self.P[i, j] * moved.w
        return Weights(theta, w)

    def fit(self, controller, theta):
        """The least-squares fit of the features to the Bellman errors: its weights and itself."""
        values = np.array([controller.value(state, theta) for state in self.states])
        features = np.array([controller.features(state, theta) for state in self.states])
        errors = self.costs + controller.gamma * self.P @ values - values
        root = np.sqrt(self.visits)
        w = np.linalg.lstsq(root[:, None] * features, root * errors, rcond=None)[0]
        return w, features @ w

    def projected_bellman_error(self, controller, theta):
        """Eq. (14), with the projection on the value's tangent space in theta: from definition."""
        _, projected = self.fit(controller, theta)
        return self.visits @ projected**2


def drawn_process(seed):
    """Six states in three dimensions, so that the features cannot fit every Bellman error."""
    rng = np.random.default_rng(seed)
    parts = rng.normal(size=(6, 3)), rng.dirichlet(np.ones(6), size=6), rng.uniform(0, 3, 6)
    return Process(*parts, rng.dirichlet(np.full(6, 5.0)))


@pytest.mark.parametrize("seed", range(5))
def test_with_w_at_its_best_theta_descends_the_projected_bellman_error(quadratic, weights, seed):
    """Maei et al. (2009): the expected step is minus half the gradient; Eq. (16) misses it."""
    process, theta = drawn_process(seed), weights.theta
    w, _ = process.fit(quadratic, theta)
    tdc, printed = (
        process.expected_step(make(quadratic, 1.0, 1.0), quadratic, Weights(theta, w))
        for make in (gradient_tdc, gradient_expected_sarsa)
    )
    errors = partial(process.projected_bellman_error, quadratic)
    descent = -differences(errors, theta, 1e-5) / 2
    np.testing.assert_allclose(tdc.theta - theta, descent, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(tdc.w, w, atol=1e-12)  # w has nothing left to learn
    missed = np.linalg.norm(printed.theta - theta - descent)
    assert missed > 0.02 * np.linalg.norm(descent)

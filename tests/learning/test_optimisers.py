"""How far a step goes: by hand, and against other minimisers."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from nmpcrl.learning import Descent, GaussNewton, TrustRegion

THETA, GRADIENT = np.array([1.0, -2.0]), np.array([0.5, 3.0])
CURVATURE = np.array([[2.0, 0.5], [0.5, 1.0]])
EDGE = np.array([1.0, -10.0]), np.array([1.0, 10.0])  # holds the first component in place


def moved(optimiser, theta=THETA, gradient=GRADIENT, curvature=CURVATURE):
    return optimiser(theta, gradient, curvature)


def drawn(seed, *, convex=True):
    """A gradient and a curvature of three parameters, and the generator for more."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, 3))
    return rng.normal(size=3), A @ A.T + 0.1 * np.eye(3) if convex else A + A.T, rng


@pytest.mark.parametrize(
    ("optimiser", "by_hand"),
    [
        (Descent(0.1), -0.1 * GRADIENT),
        (GaussNewton(0.7, 0.1), -0.7 * np.linalg.solve(CURVATURE + 0.1 * np.eye(2), GRADIENT)),
        (GaussNewton(1.0, 0.0, EDGE), [0.0, -3.0]),
        (TrustRegion(1e6, np.array([2.0, 0.1])), -np.linalg.solve(CURVATURE, GRADIENT)),
    ],
)
def test_steps_by_hand(optimiser, by_hand):
    np.testing.assert_allclose(moved(optimiser), THETA + by_hand, atol=1e-8)


@pytest.mark.parametrize("optimiser", [GaussNewton(), TrustRegion(1.0, np.ones(2))])
def test_the_second_order_needs_a_curvature_that_is_finite_and_may_be_indefinite(optimiser):
    assert (moved(optimiser, curvature=np.diag([1.0, -4.0])) - THETA) @ GRADIENT < 0
    assert not np.isfinite(moved(optimiser, curvature=np.full((2, 2), np.nan))).any()
    rank_one = 1e20 * np.outer(GRADIENT, GRADIENT)
    assert np.isfinite(moved(optimiser, gradient=1e20 * GRADIENT, curvature=rank_one)).all()


@given(st.integers(0, 10_000))
def test_a_bounded_step_is_the_least_of_the_quadratic_within_the_bounds(seed):
    gradient, H, rng = drawn(seed)
    theta = rng.normal(size=3)
    lower, upper = theta - rng.uniform(0, 3), theta + rng.uniform(0, 3)
    found = moved(GaussNewton(1.0, 0.0, (lower, upper)), theta, gradient, H)
    least = np.inf
    for sides in product((lower, theta, upper), repeat=3):  # each held at a bound, or free
        p = np.array([side[k] for k, side in enumerate(sides)]) - theta
        free = np.array([side is theta for side in sides])
        p[free] = -np.linalg.solve(H[np.ix_(free, free)], (gradient + H @ p)[free])
        cost = gradient @ p + p @ H @ p / 2
        if ((lower <= theta + p) & (theta + p <= upper)).all() and cost < least:
            least, best = cost, theta + p
    np.testing.assert_allclose(found, best, atol=1e-9)


@given(st.integers(0, 1000), st.booleans(), st.floats(0.01, 2))
@settings(max_examples=60)
def test_a_step_in_a_trust_region_is_the_least_of_its_model(seed, convex, radius):
    gradient, H, rng = drawn(seed, convex=convex)
    scale, theta = rng.uniform(0.2, 3, 3), np.ones(3)
    p = moved(TrustRegion(radius, scale), theta, gradient, H) - theta

    def model(q):
        return gradient @ (scale * q) + (scale * q) @ H @ (scale * q) / 2

    assert np.linalg.norm(p / scale) <= radius * (1 + 1e-9)
    inside = {"type": "ineq", "fun": lambda q: radius**2 - q @ q, "jac": lambda q: -2 * q}
    starts = rng.normal(size=(4, 3))
    others = [minimize(model, radius * q / np.linalg.norm(q), constraints=[inside]) for q in starts]
    least = min(one.fun for one in others if one.success)  # which may lie a little outside
    assert model(p / scale) <= least + 1e-3 * abs(least) + 1e-6

"""How far a step goes: by hand, and against other minimisers."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.learning import Adam, Descent, GaussNewton

THETA, GRADIENT = np.array([1.0, -2.0]), np.array([0.5, 3.0])


def moved(optimiser, theta=THETA, gradients=(GRADIENT,), curvature=None):
    memory = optimiser.init(theta)
    for gradient in gradients:
        theta, memory = optimiser.step(memory, theta, gradient, curvature)
    return theta


def test_descent_follows_the_gradient():
    np.testing.assert_allclose(moved(Descent(0.1)), THETA - 0.1 * GRADIENT)


def test_a_heavy_ball_keeps_part_of_its_velocity():
    twice = moved(Descent(0.1, momentum=0.5), gradients=(GRADIENT, GRADIENT))
    np.testing.assert_allclose(twice, THETA - 0.1 * GRADIENT - 0.15 * GRADIENT)


def test_the_first_step_of_adam_has_the_length_alpha_in_each_component():
    np.testing.assert_allclose(moved(Adam(0.1)), THETA - 0.1 * np.sign(GRADIENT), atol=1e-8)


def test_adam_is_that_of_torch():
    torch = pytest.importorskip("torch")
    gradients = np.random.default_rng(0).normal(size=(20, 2))
    theta = torch.tensor(THETA, requires_grad=True)
    other = torch.optim.Adam([theta], lr=0.05)
    for gradient in gradients:
        theta.grad = torch.tensor(gradient)
        other.step()
    np.testing.assert_allclose(moved(Adam(0.05), gradients=gradients), theta.detach(), rtol=1e-10)


def test_a_gauss_newton_step_solves_with_the_curvature():
    curvature = np.array([[2.0, 0.5], [0.5, 1.0]])
    expected = THETA - 0.7 * np.linalg.solve(curvature + 0.1 * np.eye(2), GRADIENT)
    optimiser = GaussNewton(0.7, regularisation=0.1)
    np.testing.assert_allclose(moved(optimiser, curvature=curvature), expected)


def test_an_indefinite_curvature_still_gives_a_descent():
    curvature = np.diag([1.0, -4.0])
    step = moved(GaussNewton(), curvature=curvature) - THETA
    assert step @ GRADIENT < 0


def test_gauss_newton_says_that_it_needs_a_curvature():
    with pytest.raises(ValueError, match="needs a curvature, and this rule estimates none"):
        moved(GaussNewton())


@given(st.integers(0, 10_000))
def test_a_bounded_step_is_the_least_of_the_quadratic_within_the_bounds(seed):
    rng = np.random.default_rng(seed)
    root, theta, gradient = rng.normal(size=(3, 3)), rng.normal(size=3), rng.normal(size=3)
    H = root @ root.T + 0.1 * np.eye(3)
    lower, upper = theta - rng.uniform(0, 1, 3), theta + rng.uniform(0, 1, 3)
    bounds = (lower, upper)
    found = moved(GaussNewton(1.0, 0.0, bounds), theta, (gradient,), H)
    least = np.inf
    for sides in product((lower, theta, upper), repeat=3):  # each held at a bound, or free
        p = np.array([side[k] for k, side in enumerate(sides)]) - theta
        free = np.array([side is theta for side in sides])
        p[free] = -np.linalg.solve(H[np.ix_(free, free)], (gradient + H @ p)[free])
        cost = gradient @ p + p @ H @ p / 2
        if ((lower <= theta + p) & (theta + p <= upper)).all() and cost < least:
            least, best = cost, theta + p
    np.testing.assert_allclose(found, best, atol=1e-9)


def test_a_component_whose_bounds_are_one_stays_there():
    bounds = (np.array([1.0, -10.0]), np.array([1.0, 10.0]))
    curvature = np.array([[2.0, 0.5], [0.5, 1.0]])
    np.testing.assert_allclose(
        moved(GaussNewton(1.0, 0.0, bounds), curvature=curvature), [1.0, -2.0 - 3.0]
    )


def test_gauss_newton_takes_a_curvature_of_any_size_and_infinity_as_divergence():
    rng = np.random.default_rng(3)
    phi = rng.normal(size=(2, 5))
    theta, step = np.zeros(5), GaussNewton().step
    moved, _ = step(None, theta, 1e20 * phi[0], 1e20 * phi.T @ phi)
    assert np.isfinite(moved).all()
    moved, _ = step(None, theta, phi[0], np.full((5, 5), np.inf))
    assert not np.isfinite(moved).any()

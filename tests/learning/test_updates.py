"""Every equation by hand."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from nmpcrl.learning import (
    auxiliary_step,
    curvature_correction,
    gradient_td_step,
    project,
    semi_gradient_step,
    td_error,
)
from nmpcrl.learning.updates import of_length

THETA, W = np.array([1.0, -2.0]), np.array([0.5, 0.25])
PHI, PHI_NEXT = np.array([2.0, 4.0]), np.array([1.0, -1.0])
HESSIAN = np.array([[0.0, 2.0], [2.0, 3.0]])  # times w: (0.5, 1.75)

points = arrays(float, 3, elements=st.floats(-100, 100))


def gradient_td(w):
    return gradient_td_step(THETA, w, 3.0, PHI, PHI_NEXT, alpha=0.1, gamma=0.5)


def test_the_td_error_is_what_was_seen_minus_what_was_expected():
    assert td_error(3.0, 0.5, q=10.0, q_next=8.0) == 3.0 + 0.5 * 8.0 - 10.0
    assert td_error(3.0, 0.5, q=1.0, q_next=8.0) > 0  # worse than expected


@pytest.mark.parametrize(
    ("step", "by_hand"),  # w'phi = 2
    [
        (lambda: semi_gradient_step(THETA, 3.0, PHI, 0.1), [1.0 + 0.6, -2.0 + 1.2]),
        (lambda: semi_gradient_step(THETA, 0.0, PHI, 0.1), THETA),
        (lambda: gradient_td(W), [1.0 + 0.1 * (6 - 1), -2.0 + 0.1 * (12 + 1)]),
        (lambda: gradient_td(0 * W), [1.0 + 0.6, -2.0 + 1.2]),
        (lambda: auxiliary_step(W, 3.0, PHI, 0.1), [0.5 + 0.2, 0.25 + 0.4]),
        (lambda: auxiliary_step(0 * W, 0.0, PHI, 0.1), [0.0, 0.0]),
        (lambda: curvature_correction(3.0, PHI, W, HESSIAN @ W), [0.5, 1.75]),
        (lambda: curvature_correction(5.0, PHI, W, HESSIAN @ W), [1.5, 5.25]),
        (lambda: curvature_correction(W @ PHI, PHI, W, PHI_NEXT), [0.0, 0.0]),
        (lambda: project(np.array([-1.0, 3.0, 12.0]), 0.0, 10.0), [0.0, 3.0, 10.0]),
        (lambda: project(np.array([np.nan, 1.0]), 0.0, 10.0), [np.nan, 1.0]),
        (lambda: of_length(np.zeros(3), 5.0), np.zeros(3)),
    ],
)
def test_an_equation_by_hand(step, by_hand):
    before = [v.copy() for v in (THETA, W, PHI, PHI_NEXT)]
    np.testing.assert_allclose(step(), by_hand)
    for now, then in zip((THETA, W, PHI, PHI_NEXT), before, strict=True):
        np.testing.assert_array_equal(now, then)


@given(theta=points, other=points, bounds=st.tuples(st.floats(-50, 50), st.floats(0, 50)))
def test_the_projection_is_the_nearest_point_of_the_box(theta, other, bounds):
    least, most = bounds[0], sum(bounds)
    nearest, inside = project(theta, least, most), np.clip(other, least, most)
    assert least <= nearest.min() <= nearest.max() <= most
    assert np.linalg.norm(theta - nearest) <= np.linalg.norm(theta - inside) + 1e-12
    np.testing.assert_array_equal(project(inside, least, most), inside)


@given(direction=points, length=st.floats(0, 1e6))
def test_a_step_of_a_length_has_it_and_keeps_its_direction(direction, length):
    assume(np.abs(direction).max() > 1e-3)
    step = of_length(direction, length)
    assert np.linalg.norm(step) == pytest.approx(length)
    assert step @ direction == pytest.approx(length * np.linalg.norm(direction))


def test_the_auxiliary_weights_settle_at_the_least_squares_fit():
    rng = np.random.default_rng(0)
    phis, w = rng.normal(size=(20, 2)), np.zeros(2)
    deltas = rng.normal(size=20)
    for _ in range(4000):
        for phi, delta in zip(phis, deltas, strict=True):
            w = auxiliary_step(w, delta, phi, beta=0.002)
    best = np.linalg.lstsq(phis, deltas, rcond=None)[0]
    np.testing.assert_allclose(w, best, atol=0.02)


def test_a_state_that_leads_to_itself_is_worth_its_discounted_cost_for_ever():
    theta = np.zeros(1)
    for _ in range(2000):
        delta = td_error(2.0, 0.9, q=theta[0], q_next=theta[0])
        theta = semi_gradient_step(theta, delta, np.ones(1), alpha=0.1)
    assert theta[0] == pytest.approx(2.0 / (1 - 0.9))

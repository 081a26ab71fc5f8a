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

points = arrays(float, 3, elements=st.floats(-100, 100))


def test_the_td_error_is_what_was_seen_minus_what_was_expected():
    assert td_error(3.0, 0.5, q=10.0, q_next=8.0) == 3.0 + 0.5 * 8.0 - 10.0
    assert td_error(3.0, 0.5, q=1.0, q_next=8.0) > 0  # worse than expected


def test_the_semi_gradient_moves_theta_along_delta_phi():
    moved = semi_gradient_step(THETA, delta=3.0, phi=PHI, alpha=0.1)
    np.testing.assert_allclose(moved, [1.0 + 0.6, -2.0 + 1.2])


def test_gradient_td_subtracts_what_the_next_value_would_move():
    # w'phi = 2, so theta moves by 0.1 (3 phi - 0.5 * 2 * phi+)
    moved = gradient_td_step(THETA, W, 3.0, PHI, PHI_NEXT, alpha=0.1, gamma=0.5)
    np.testing.assert_allclose(moved, [1.0 + 0.1 * (6 - 1), -2.0 + 0.1 * (12 + 1)])


def test_the_auxiliary_weights_track_delta_by_least_mean_squares():
    # delta - w'phi = 3 - 2 = 1
    np.testing.assert_allclose(auxiliary_step(W, 3.0, PHI, beta=0.1), [0.5 + 0.2, 0.25 + 0.4])


def test_with_w_zero_gradient_td_is_the_semi_gradient():
    gradient = gradient_td_step(THETA, 0 * W, 3.0, PHI, PHI_NEXT, alpha=0.1, gamma=0.5)
    np.testing.assert_array_equal(gradient, semi_gradient_step(THETA, 3.0, PHI, 0.1))


def test_the_curvature_correction_is_what_delta_leaves_unexplained_times_the_hessian():
    # delta - w'phi = 3 - 2 = 1, and the Hessian times w is (0.5, 1.75)
    hessian = np.array([[0.0, 2.0], [2.0, 3.0]])
    np.testing.assert_allclose(curvature_correction(3.0, PHI, W, hessian @ W), [0.5, 1.75])
    np.testing.assert_allclose(curvature_correction(5.0, PHI, W, hessian @ W), [1.5, 5.25])


def test_where_w_explains_delta_there_is_nothing_to_correct():
    np.testing.assert_array_equal(curvature_correction(W @ PHI, PHI, W, PHI_NEXT), [0, 0])


@given(theta=points, other=points, bounds=st.tuples(st.floats(-50, 50), st.floats(0, 50)))
def test_the_projection_is_the_nearest_point_of_the_box(theta, other, bounds):
    least, most = bounds[0], sum(bounds)
    nearest, inside = project(theta, least, most), np.clip(other, least, most)
    assert least <= nearest.min() <= nearest.max() <= most
    assert np.linalg.norm(theta - nearest) <= np.linalg.norm(theta - inside) + 1e-12
    np.testing.assert_array_equal(project(inside, least, most), inside)


def test_the_projection_takes_each_component_by_itself():
    np.testing.assert_array_equal(project(np.array([-1.0, 3.0, 12.0]), 0.0, 10.0), [0, 3, 10])


def test_the_projection_does_not_hide_a_number_that_is_none():
    assert np.isnan(project(np.array([np.nan, 1.0]), 0.0, 10.0)[0])


@given(direction=points, length=st.floats(0, 1e6))
def test_a_step_of_a_length_has_it_and_keeps_its_direction(direction, length):
    assume(np.abs(direction).max() > 1e-3)
    step = of_length(direction, length)
    assert np.linalg.norm(step) == pytest.approx(length)
    assert step @ direction == pytest.approx(length * np.linalg.norm(direction))


def test_where_there_is_no_direction_there_is_no_step():
    np.testing.assert_array_equal(of_length(np.zeros(3), 5.0), np.zeros(3))


def test_updates_leave_their_arguments_alone():
    before = [v.copy() for v in (THETA, W, PHI, PHI_NEXT)]
    curvature_correction(3.0, PHI, W, PHI_NEXT)
    project(THETA, 0.0, 0.5)
    of_length(PHI, 3.0)
    semi_gradient_step(THETA, 3.0, PHI, 0.1)
    gradient_td_step(THETA, W, 3.0, PHI, PHI_NEXT, alpha=0.1, gamma=0.5)
    auxiliary_step(W, 3.0, PHI, 0.1)
    for now, then in zip((THETA, W, PHI, PHI_NEXT), before, strict=True):
        np.testing.assert_array_equal(now, then)


def test_without_a_td_error_nothing_moves_but_what_w_corrects():
    np.testing.assert_array_equal(semi_gradient_step(THETA, 0.0, PHI, 0.1), THETA)
    np.testing.assert_array_equal(auxiliary_step(0 * W, 0.0, PHI, 0.1), 0 * W)


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

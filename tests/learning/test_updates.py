"""The four update rules by hand, and the two-state chain that tells them apart."""

import numpy as np
import pytest

from nmpcrl.learning import auxiliary_step, gradient_td_step, semi_gradient_step, td_error

THETA, W = np.array([1.0, -2.0]), np.array([0.5, 0.25])
PHI, PHI_NEXT = np.array([2.0, 4.0]), np.array([1.0, -1.0])


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


def test_updates_leave_their_arguments_alone():
    before = [v.copy() for v in (THETA, W, PHI, PHI_NEXT)]
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


# Two states with values theta and 2 theta, no cost, and only the step from the first to the second
# is seen (Tsitsiklis and Van Roy 1996; Sutton and Barto 2018, Section 11.2). The true theta is 0.
ONE, TWO, GAMMA = np.array([1.0]), np.array([2.0]), 0.9


def chain(step, steps):
    theta, w = np.ones(1), np.zeros(1)
    for _ in range(steps):
        delta = td_error(0.0, GAMMA, q=ONE @ theta, q_next=TWO @ theta)
        theta, w = step(theta, w, delta)
    return theta[0]


def test_semi_gradient_diverges_on_the_two_state_chain():
    def step(theta, w, delta):
        return semi_gradient_step(theta, delta, ONE, alpha=0.1), w

    # every step multiplies theta by 1 + alpha (2 gamma - 1) = 1.08
    assert chain(step, 100) == pytest.approx(1.08**100)


def test_gradient_td_converges_on_the_two_state_chain():
    def step(theta, w, delta):
        moved = gradient_td_step(theta, w, delta, ONE, TWO, alpha=0.05, gamma=GAMMA)
        return moved, auxiliary_step(w, delta, ONE, beta=0.5)

    assert abs(chain(step, 100)) < 0.2
    assert abs(chain(step, 1000)) < 1e-6


def test_with_the_tables_order_of_step_sizes_the_chain_turns_around_only_later():
    """beta a tenth of alpha, as in Table I: theta first grows, then w has learned enough."""

    def step(theta, w, delta):
        moved = gradient_td_step(theta, w, delta, ONE, TWO, alpha=0.1, gamma=GAMMA)
        return moved, auxiliary_step(w, delta, ONE, beta=0.01)

    assert chain(step, 20) > 1.5

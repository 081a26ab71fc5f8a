"""The two-state chain of chapter 4: what diverges on it, what converges, and when."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.analysis import two_state
from nmpcrl.analysis.two_state import FIRST, SECOND, Chain, expected_matrix, follow, mspbe
from nmpcrl.learning import Weights
from nmpcrl.learning.learners import gradient_td, semi_gradient

CHAIN = Chain(gamma=0.97)
ALPHA = 0.1

discounts = shares = st.floats(0.0, 1.0)
numbers = st.floats(-10.0, 10.0)


@pytest.mark.parametrize(
    ("share", "rule", "diverges"),
    [
        (1.0, semi_gradient(ALPHA), True),
        (0.5, semi_gradient(ALPHA), False),  # on-policy
        (1.0, gradient_td(ALPHA, 4 * ALPHA, CHAIN.gamma), False),
        (1.0, gradient_td(ALPHA, ALPHA / 10, CHAIN.gamma), True),  # w as slow as in Table I
    ],
)
def test_a_rule_diverges_or_converges_on_the_two_state_chain(share, rule, diverges):
    end = np.abs(follow(Chain(share=share), rule, 400)[-1]).max()
    assert end > 1e6 if diverges else end < 1e-6


@given(gamma=discounts, alpha=st.floats(0.01, 0.5))
def test_the_semi_gradient_multiplies_theta_by_one_plus_alpha_times_two_gamma_minus_one(
    gamma, alpha
):
    theta = follow(Chain(gamma), semi_gradient(alpha), 3)[:, 0]
    np.testing.assert_allclose(theta, (1 + alpha * (2 * gamma - 1)) ** np.arange(4))


@given(gamma=st.floats(0.6, 1.0), alpha=st.floats(0.001, 0.3), ratio=st.floats(0.05, 3.0))
def test_gradient_td_converges_just_when_w_is_fast_enough(gamma, alpha, ratio):
    slope = 2 * gamma - 1
    bound = slope / (1 - alpha * slope**2)
    if np.isclose(ratio, bound, rtol=1e-3):
        return
    radius = two_state.spectral_radius(Chain(gamma), gradient_td(alpha, ratio * alpha, gamma))
    assert (radius < 1) == (ratio > bound)


def test_the_semi_gradient_turns_where_the_share_of_the_first_state_passes_its_bound():
    bound, rule = 4 / (3 + 2 * CHAIN.gamma), semi_gradient(0.01)
    below, above = (Chain(share=bound + more) for more in (-0.01, 0.01))
    assert expected_matrix(below, rule)[0, 0] < 1 < expected_matrix(above, rule)[0, 0]


@given(gamma=discounts, share=shares, theta=numbers)
def test_with_w_at_its_fixed_point_theta_descends_the_mspbe_of_either_form(gamma, share, theta):
    chain, h = Chain(gamma, share), 1e-4
    weights = Weights(np.array([theta]), np.array([two_state.auxiliary_fixed_point(chain, theta)]))
    moved = two_state.expected_step(chain, gradient_td(1.0, 1.0, gamma), weights).theta[0] - theta
    slope = (mspbe(chain, theta + h) - mspbe(chain, theta - h)) / (2 * h)
    np.testing.assert_allclose(moved, -slope / 2, atol=1e-6)
    np.testing.assert_allclose(
        two_state.projected_bellman_error(chain, theta), mspbe(chain, theta), atol=1e-9
    )


@given(gamma=discounts, share=shares, theta=numbers, w=numbers)
def test_an_expected_step_is_the_mean_of_the_sampled_ones_and_linear(gamma, share, theta, w):
    chain, weights = Chain(gamma, share), Weights(np.array([theta]), np.array([w]))
    rule = gradient_td(0.1, 0.2, gamma)
    mean = two_state.expected_step(chain, rule, weights)
    first, second = (
        two_state.sampled_step(chain, rule, weights, state) for state in (FIRST, SECOND)
    )
    np.testing.assert_allclose(mean.theta, share * first.theta + (1 - share) * second.theta)
    np.testing.assert_allclose(mean.w, share * first.w + (1 - share) * second.w, atol=1e-12)
    linear = expected_matrix(chain, rule) @ [theta, w]
    np.testing.assert_allclose(linear, np.r_[mean.theta, mean.w], atol=1e-9)


@pytest.mark.parametrize("name", ["gamma", "share"])
def test_a_probability_outside_zero_and_one_is_refused(name):
    with pytest.raises(ValueError, match=rf"{name} = 1\.5 must lie in \[0, 1\]"):
        Chain(**{name: 1.5})

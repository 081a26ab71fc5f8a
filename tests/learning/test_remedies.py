"""Remedies: by hand, on the two-state chain, and beside the learners that they mend."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from nmpcrl.analysis.two_state import Chain, spectral_radius
from nmpcrl.learning import expected_sarsa, gradient_expected_sarsa, lstd_q
from nmpcrl.learning.learners import semi_gradient
from nmpcrl.learning.remedies import (
    averaged,
    directed,
    guard,
    guarded,
    judged_theta,
    normalised_ges,
    tdrc,
    undo,
)

ALPHA = 0.1
COSTS = (1.0, -2.0, 4.0, 0.5)
LEARNERS = [expected_sarsa, lambda c, alpha: gradient_expected_sarsa(c, alpha, 0.2)]


def in_turn(learner, weights, transitions):
    """The weights after each transition."""
    path = []
    for transition in transitions:
        weights = learner.step(weights, transition).weights
        path.append(weights)
    return path


def asked(judge):
    """The thetas that were judged."""
    return [call.args[0] for call in judge.call_args_list]


@pytest.fixture
def ends(transition, weights):
    """Transitions that end an episode each."""
    return [replace(transition(weights.theta, cost=cost), last=True) for cost in COSTS]


@pytest.mark.parametrize(
    ("make", "by_hand"),  # the change of w; ||phi||^2 = 14
    [
        (tdrc, lambda w, error, phi: ALPHA * (error * phi - w)),
        (normalised_ges, lambda w, error, phi: 0.3 / (1 + 0.3 * 14) * error * phi),
    ],
)
def test_a_step_of_w_by_hand_and_of_theta_as_in_ges(controller, transition, weights, make, by_hand):
    one = transition(weights.theta)
    phi, w, found = one.solution.features, weights.w, make(controller, ALPHA).step(weights, one)
    ges = gradient_expected_sarsa(controller, ALPHA, ALPHA).step(weights, one).weights
    moved = by_hand(w, found.delta - w @ phi, phi)
    np.testing.assert_allclose(found.weights.w - w, moved)
    np.testing.assert_array_equal(found.weights.theta, ges.theta)


def test_tdrc_converges_where_a_semi_gradient_diverges_if_it_is_not_regularised_too_much(
    controller,
):
    """The edge is 2 gamma - 1 for small steps."""
    chain, alpha = Chain(gamma=0.97), 0.01
    controller.gamma, up = chain.gamma, 2 * chain.gamma - 1
    assert spectral_radius(chain, semi_gradient(alpha)) > 1
    assert spectral_radius(chain, tdrc(controller, alpha, up - 0.1).rule) < 1
    assert spectral_radius(chain, tdrc(controller, alpha, up + 0.01).rule) > 1


@pytest.mark.parametrize("make", LEARNERS)
def test_a_guard_takes_the_largest_alpha_that_does_not_pass_the_target(
    controller, transition, weights, make
):
    """1 / 14, since ||phi||^2 = 14; every bit is left where it does not bind."""
    one, most = transition(weights.theta), 1 / 14
    wanted = make(controller, most).step(weights, one).weights
    for alpha, rtol in ((most, 0.0), (5.0, 1e-7)):
        found = guarded(make(controller, alpha), alpha).step(weights, one).weights
        np.testing.assert_allclose(found.theta, wanted.theta, rtol)
        np.testing.assert_allclose(found.w, wanted.w, rtol)
    assert guard(0.5, np.zeros(3)) == 0.5


def test_the_control_goes_as_far_as_the_remedy_in_the_direction_of_es(
    controller, transition, weights
):
    one, alpha = transition(weights.theta), 5.0
    remedy = guarded(gradient_expected_sarsa(controller, alpha, 0.2), alpha)
    moved, found = remedy.step(weights, one).weights, directed(remedy, alpha).step(weights, one)
    length, phi = np.linalg.norm(moved.theta - weights.theta), one.solution.features
    step = length * np.sign(found.delta) * phi / np.linalg.norm(phi)
    np.testing.assert_allclose(found.weights.theta, weights.theta + step)
    np.testing.assert_array_equal(found.weights.w, moved.w)


@pytest.mark.parametrize("wrap", [guarded, directed])
@pytest.mark.parametrize("make", [lstd_q, lambda c: averaged(expected_sarsa(c, 0.1))])
def test_remedies_that_need_a_step_size_refuse_a_memory(controller, wrap, make):
    with pytest.raises(ValueError, match=r"a rule that moves theta at every step; .* has a memory"):
        wrap(make(controller), 0.1)


@pytest.mark.parametrize("skip", [0, 2])
def test_an_average_is_the_mean_of_the_thetas_that_are_counted(controller, ends, weights, skip):
    base = expected_sarsa(controller, 0.01)
    path, found = in_turn(base, weights, ends), in_turn(averaged(base, skip), weights, ends)
    thetas = [one.theta for one in path]
    np.testing.assert_array_equal([one.theta for one in found], thetas)
    np.testing.assert_allclose(judged_theta(found[-1]), np.mean(thetas[skip:], axis=0))
    np.testing.assert_array_equal(judged_theta(path[-1]), thetas[-1])


def test_undo_goes_back_to_the_best_theta_and_w(controller, ends, weights):
    judge = Mock(side_effect=[10.0, 8.0, np.inf, 9.0, 7.0])
    learner = undo(gradient_expected_sarsa(controller, 0.01, 0.02), judge)
    first, second, third, fourth = in_turn(learner, weights, ends)
    assert judge.call_count == 5
    np.testing.assert_array_equal(asked(judge)[0], weights.theta)
    for back in (second, third):  # a failed rollout, and one that is worse than the best
        np.testing.assert_array_equal(back.theta, first.theta)
        np.testing.assert_array_equal(back.w, first.w)
    assert not np.array_equal(fourth.theta, first.theta)
    np.testing.assert_array_equal(judged_theta(fourth), fourth.theta)


@pytest.mark.parametrize("wrap", [lambda one: one, averaged])
def test_undo_judges_an_episode_that_failed_as_any_other(controller, transition, weights, wrap):
    """Whether it had a step or none, and under an average, too."""
    judge = Mock(side_effect=[10.0, np.inf, 9.0, 8.0])
    learner = wrap(undo(expected_sarsa(controller, 0.01), judge))
    moved = learner.step(weights, transition(weights.theta)).weights
    back = learner.interrupted(moved)
    np.testing.assert_array_equal(back.theta, weights.theta)
    kept = learner.interrupted(learner.step(back, transition(weights.theta)).weights)
    assert not np.array_equal(kept.theta, weights.theta)
    np.testing.assert_array_equal(learner.interrupted(kept).theta, kept.theta)
    np.testing.assert_array_equal(
        asked(judge), [weights.theta, moved.theta, kept.theta, kept.theta]
    )


def test_undone_and_averaged_theta_stays_within_the_bounds(controller, transition, weights):
    judge, bounds = Mock(side_effect=[2.0, 1.0]), (np.full(3, -1.5), np.ones(3))
    base = replace(expected_sarsa(controller, 1.0), bounds=bounds)
    one = replace(transition(weights.theta, cost=50.0), last=True)
    for learner in (averaged(base), undo(base, judge), averaged(averaged(base))):
        found = learner.step(weights, one).weights
        np.testing.assert_array_equal(judged_theta(found), found.theta)
        np.testing.assert_array_equal(found.theta, np.clip(found.theta, *bounds))
    np.testing.assert_array_equal(asked(judge)[-1], found.theta)

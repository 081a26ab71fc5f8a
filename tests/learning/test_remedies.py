"""Remedies: on the two-state chain by hand, and equal to what they mend where they do not bind."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.analysis.two_state import (
    FIRST,
    SECOND,
    Chain,
    auxiliary_fixed_point,
    expected_matrix,
    sampled_step,
    spectral_radius,
)
from nmpcrl.learning import (
    Exploration,
    Weights,
    expected_sarsa,
    gradient_expected_sarsa,
    lstd_q,
    train,
)
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
from nmpcrl.study import paper

CHAIN, ALPHA = Chain(gamma=0.97), 0.1
COSTS = (1.0, -2.0, 4.0, 0.5)
LEARNERS = [expected_sarsa, lambda c, alpha: gradient_expected_sarsa(c, alpha, 0.2)]


def in_turn(learner, weights, transitions):
    """The weights after each transition."""
    path = []
    for transition in transitions:
        weights = learner.step(weights, transition).weights
        path.append(weights)
    return path


@pytest.fixture
def ends(transition, weights):
    """Transitions that end an episode each."""
    return [replace(transition(weights.theta, cost=cost), last=True) for cost in COSTS]


def test_tdrc_on_the_chain_is_that_of_ghiassian_et_al(controller):
    """It converges where a semi-gradient diverges, if it is not regularised too much."""
    controller.gamma, decay, up = CHAIN.gamma, 0.5, 2 * CHAIN.gamma - 1
    by_hand = [
        [1 + ALPHA * up, -2 * ALPHA * CHAIN.gamma],
        [ALPHA * up, 1 - ALPHA * (1 + decay)],
    ]
    rule = tdrc(controller, ALPHA, decay).rule
    np.testing.assert_allclose(expected_matrix(CHAIN, rule), by_hand)
    alpha = 0.01  # the edge of the regularisation is that of small steps
    assert spectral_radius(CHAIN, semi_gradient(alpha)) > 1
    assert spectral_radius(CHAIN, tdrc(controller, alpha, up - 0.1).rule) < 1
    assert spectral_radius(CHAIN, tdrc(controller, alpha, up + 0.01).rule) > 1


def test_a_normalised_step_of_w_meets_its_error_however_large_beta_is(controller):
    """With a huge beta the error of w on the chain is 0 after one step, and changes no sign."""
    weights = Weights(np.ones(1), np.array([-3.0]))
    for ratio, left in ((1e9, 0.0), (30.0, 1 / (1 + 3.0))):
        rule = normalised_ges(controller, ALPHA, ratio).rule
        moved = sampled_step(CHAIN, rule, weights, FIRST)
        error = auxiliary_fixed_point(CHAIN, 1.0) - np.array([weights.w[0], moved.w[0]])
        assert error[1] == pytest.approx(left * error[0], abs=1e-6)


@pytest.mark.parametrize(
    ("make", "alpha", "beta"),
    [
        (lambda c: tdrc(c, ALPHA, 0.0), ALPHA, ALPHA),
        (lambda c: normalised_ges(c, 1e-9), 1e-9, 3e-9),
    ],
)
def test_ges_is_tdrc_without_decay_and_the_normalised_one_with_a_small_beta(
    controller, transition, weights, make, alpha, beta
):
    one = transition(weights.theta)
    found = make(controller).step(weights, one).weights
    wanted = gradient_expected_sarsa(controller, alpha, beta).step(weights, one).weights
    np.testing.assert_allclose(found.theta, wanted.theta, rtol=1e-12)
    np.testing.assert_allclose(found.w - weights.w, wanted.w - weights.w, rtol=1e-6)


@pytest.mark.parametrize("make", LEARNERS)
def test_a_guard_takes_the_largest_alpha_that_does_not_pass_the_target(
    controller, transition, weights, make
):
    """1 / 14, since ||phi||^2 = 14; every bit is left where it does not bind."""
    one, most = transition(weights.theta), 1 / 14
    wanted = make(controller, most).step(weights, one).weights
    for alpha, compare in (
        (most, np.testing.assert_array_equal),
        (5.0, np.testing.assert_allclose),
    ):
        found = guarded(make(controller, alpha), alpha).step(weights, one).weights
        compare(found.theta, wanted.theta)
        compare(found.w, wanted.w)
    assert guard(0.5, np.zeros(3)) == 0.5


def test_a_guarded_semi_gradient_never_passes_its_target(controller):
    weights, alpha = Weights(np.ones(1)), 100.0
    rule = guarded(expected_sarsa(controller, alpha), alpha).rule
    moved = sampled_step(CHAIN, rule, weights, SECOND)  # whose next state is worth 0
    assert CHAIN.delta(moved.theta, SECOND) == pytest.approx(0, abs=1e-12)


def test_the_control_goes_as_far_as_the_remedy_in_the_direction_of_es(
    controller, transition, weights
):
    one, alpha = transition(weights.theta), 5.0
    remedy = guarded(gradient_expected_sarsa(controller, alpha, 0.2), alpha)
    moved = remedy.step(weights, one).weights
    found = directed(remedy, alpha).step(weights, one)
    step = found.weights.theta - weights.theta
    assert np.linalg.norm(step) == pytest.approx(np.linalg.norm(moved.theta - weights.theta))
    np.testing.assert_array_equal(found.weights.w, moved.w)
    phi = one.solution.features
    np.testing.assert_allclose(
        step / np.linalg.norm(step), np.sign(found.delta) * phi / np.linalg.norm(phi)
    )


@pytest.mark.parametrize("wrap", [guarded, directed])
@pytest.mark.parametrize("make", [lstd_q, lambda c: averaged(expected_sarsa(c, 0.1))])
def test_what_needs_a_step_size_refuses_a_memory(controller, wrap, make):
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


class Judge:
    """Says costs in turn, and notes the thetas."""

    def __init__(self, *costs):
        self.costs, self.asked = list(costs), []

    def __call__(self, theta):
        self.asked.append(theta)
        return self.costs.pop(0)


def test_undo_goes_back_to_the_best_theta_and_w(controller, ends, weights):
    judge = Judge(10.0, 8.0, np.inf, 9.0, 7.0)
    learner = undo(gradient_expected_sarsa(controller, 0.01, 0.02), judge)
    first, second, third, fourth = in_turn(learner, weights, ends)
    assert (len(judge.asked), judge.costs) == (5, [])
    np.testing.assert_array_equal(judge.asked[0], weights.theta)
    for back in (second, third):  # a failed rollout, and one that is worse than the best
        np.testing.assert_array_equal(back.theta, first.theta)
        np.testing.assert_array_equal(back.w, first.w)
    assert not np.array_equal(fourth.theta, first.theta)
    np.testing.assert_array_equal(judged_theta(fourth), fourth.theta)


def test_undo_confirms_only_where_its_episodes_are_over(controller, transition, weights):
    judge = Judge(3.0, 2.0, 1.0)
    learner = undo(expected_sarsa(controller, 0.01), judge, every=2)
    one = transition(weights.theta)
    in_turn(learner, weights, [replace(one, last=last) for last in (0, 1, 0, 1, 1, 0, 1, 1)])
    assert len(judge.asked) == 3


@pytest.mark.parametrize("wrap", [lambda one: one, averaged])
def test_undo_judges_an_episode_that_failed_as_any_other(controller, transition, weights, wrap):
    """Whether it had a step or none, and under an average, too."""
    judge = Judge(10.0, np.inf, 9.0, 8.0)
    learner = wrap(undo(expected_sarsa(controller, 0.01), judge))
    moved = learner.step(weights, transition(weights.theta)).weights
    back = learner.interrupted(moved)
    np.testing.assert_array_equal(back.theta, weights.theta)
    kept = learner.interrupted(learner.step(back, transition(weights.theta)).weights)
    assert not np.array_equal(kept.theta, weights.theta)
    np.testing.assert_array_equal(learner.interrupted(kept).theta, kept.theta)
    np.testing.assert_array_equal(judge.asked, [weights.theta, moved.theta, kept.theta, kept.theta])


def test_what_is_undone_or_averaged_stays_within_the_bounds(controller, transition, weights):
    judge, bounds = Judge(2.0, 1.0), (np.full(3, -1.5), np.ones(3))
    base = replace(expected_sarsa(controller, 1.0), bounds=bounds)
    one = replace(transition(weights.theta, cost=50.0), last=True)
    for learner in (averaged(base), undo(base, judge), averaged(averaged(base))):
        found = learner.step(weights, one).weights
        np.testing.assert_array_equal(judged_theta(found), found.theta)
        np.testing.assert_array_equal(found.theta, np.clip(found.theta, *bounds))
    np.testing.assert_array_equal(judge.asked[-1], found.theta)


@pytest.mark.parametrize("make", [lambda c: expected_sarsa(c, 0.01), lstd_q])
def test_undo_that_never_has_to_and_an_average_are_the_learner(controller, ends, weights, make):
    base = make(controller)
    wanted = in_turn(base, weights, ends)[-1].theta
    for learner in (undo(base, lambda theta: 0.0), averaged(base)):
        np.testing.assert_array_equal(in_turn(learner, weights, ends)[-1].theta, wanted)


@pytest.mark.parametrize("make", [tdrc, normalised_ges])
def test_a_remedy_learns_on_the_robot(make):
    nmpc, theta = paper.nmpc(), np.array(paper.THETA_INIT)
    learner = guarded(make(nmpc, paper.ALPHA), paper.ALPHA)
    noise = Exploration.draw(np.random.default_rng(0), (1, 20, 2))
    steps = list(train(learner, nmpc, Weights(theta, np.full(9, paper.W_INIT)), noise))
    assert len(steps) == 20
    assert not np.array_equal(steps[-1].weights.theta, theta)
    assert np.isfinite(steps[-1].weights.w).all()

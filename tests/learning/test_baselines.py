"""The control arms: their direction from one rule, their length from another, and no more."""

import copy

import numpy as np
import pytest
from scipy.stats import kstest

from nmpcrl.learning import (
    Weights,
    expected_sarsa,
    frozen,
    gradient_expected_sarsa,
    random_direction,
    step_matched,
)

ALPHA, BETA = 0.1, 0.01


def moved(learner, weights, transition):
    """The step that a learner makes in theta."""
    return learner.step(weights, transition).weights.theta - weights.theta


def at_random(controller, seed=0):
    return random_direction(controller, ALPHA, np.random.default_rng(seed))


def test_frozen_never_moves_and_asks_for_nothing(controller, transition, weights):
    learner = frozen(controller)
    for cost in (0.0, 4.0, 1e9):
        update = learner.step(weights, transition(weights.theta, cost=cost))
        assert update.weights is weights
        assert update.delta is None
    assert controller.calls == []


@pytest.mark.parametrize("cost", [4.0, -9.0])
def test_matched_goes_where_es_goes_as_far_as_ges_does(controller, transition, weights, cost):
    step = transition(weights.theta, cost=cost)
    es = moved(expected_sarsa(controller, ALPHA), weights, step)
    ges = moved(gradient_expected_sarsa(controller, ALPHA, BETA), weights, step)
    matched = moved(step_matched(controller, ALPHA, BETA), weights, step)
    assert np.linalg.norm(matched) == pytest.approx(np.linalg.norm(ges))
    np.testing.assert_allclose(matched / np.linalg.norm(matched), es / np.linalg.norm(es))
    assert np.linalg.norm(es) != pytest.approx(np.linalg.norm(ges))


def test_matched_keeps_w_as_ges_does(controller, transition, weights):
    step = transition(weights.theta)
    ges = gradient_expected_sarsa(controller, ALPHA, BETA).step(weights, step)
    matched = step_matched(controller, ALPHA, BETA).step(weights, step)
    np.testing.assert_array_equal(matched.weights.w, ges.weights.w)
    assert matched.delta == ges.delta


def test_matched_stays_where_es_has_no_direction(controller, transition, weights):
    """Without a TD error GES still moves, by what w corrects; ES has nowhere to go."""
    weights = Weights(np.zeros(3), weights.w)  # every value is 0
    step = transition(weights.theta, cost=0.0)
    ges = gradient_expected_sarsa(controller, ALPHA, BETA)
    assert np.linalg.norm(moved(ges, weights, step)) > 0
    update = step_matched(controller, ALPHA, BETA).step(weights, step)
    assert update.delta == 0
    np.testing.assert_array_equal(update.weights.theta, weights.theta)


def test_random_steps_are_as_long_as_those_of_es(controller, transition, weights):
    step, learner = transition(weights.theta), at_random(controller)
    length = np.linalg.norm(moved(expected_sarsa(controller, ALPHA), weights, step))
    for _ in range(20):
        assert np.linalg.norm(moved(learner, weights, step)) == pytest.approx(length)


def test_random_leaves_w_alone(controller, transition, weights):
    update = at_random(controller).step(weights, transition(weights.theta))
    np.testing.assert_array_equal(update.weights.w, weights.w)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (1, -1, 0)])
def test_random_directions_favour_none(controller, transition, weights, axis):
    """Archimedes: on a sphere, the component along any axis is uniform between -1 and 1."""
    step, learner = transition(weights.theta), at_random(controller)
    steps = np.array([moved(learner, weights, step) for _ in range(4000)])
    directions = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    along = directions @ axis / np.linalg.norm(axis)
    assert kstest(along, "uniform", args=(-1, 2)).pvalue > 1e-3


def test_random_directions_come_from_the_given_generator_alone(controller, transition, weights):
    step = transition(weights.theta)

    def path(seed):
        learner = at_random(controller, seed)
        return [moved(learner, weights, step).tolist() for _ in range(3)]

    learner = at_random(controller, 5)
    for one in (copy.deepcopy(learner), learner):
        assert [moved(one, weights, step).tolist() for _ in range(3)] == path(5)
    first = path(5)
    assert path(5) == first
    assert path(6) != first
    assert first[0] != first[1]

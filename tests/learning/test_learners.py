"""learner = bootstrap x update rule: steps by hand, the protocol, and the end of learning."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from nmpcrl.learning import (
    Learner,
    SecondSolve,
    Transition,
    UpdateRule,
    Weights,
    deep_expected_sarsa,
    expected_sarsa,
    frozen,
    gradient_expected_sarsa,
    gradient_tdc,
    q_learning,
    random_direction,
    regularized_deep_expected_sarsa,
    step_matched,
)

ALPHA, BETA = 0.1, 0.01
THETA, W = np.array([1.0, 0.5, -1.0]), np.array([0.1, 0.0, 0.2])
PHI, PHI_NEXT = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.0, -1.0])  # of `transition`
DELTA = 4.0 + 0.9 * 1.5 + 1.0
OVERLAP = 0.1 + 0.6  # w'phi
ES = THETA + ALPHA * DELTA * PHI
GES = THETA + ALPHA * (DELTA * PHI - 0.9 * OVERLAP * PHI_NEXT)
MATCHED = THETA + np.linalg.norm(GES - THETA) * (ES - THETA) / np.linalg.norm(ES - THETA)
DEEP = THETA + ALPHA * (4.0 + 0.9 * 7.0 + 1.0) * PHI  # by the network's answer
MOVED_W = W + BETA * (DELTA - OVERLAP) * PHI
BY_HAND = {  # name: learner, theta and w after the step, TD error
    "ES": (lambda c, _: expected_sarsa(c, ALPHA), ES, W, DELTA),
    "QL": (lambda c, _: q_learning(c, ALPHA), ES, W, DELTA),
    "DES": (lambda c, n: deep_expected_sarsa(c, n, ALPHA), DEEP, W, 11.3),
    "RDES": (lambda c, n: regularized_deep_expected_sarsa(c, n, ALPHA), DEEP, W, 11.3),
    "GES": (lambda c, _: gradient_expected_sarsa(c, ALPHA, BETA), GES, MOVED_W, DELTA),
    "TDC": (lambda c, _: gradient_tdc(c, ALPHA, BETA), GES, MOVED_W, DELTA),  # V is linear
    "matched": (lambda c, _: step_matched(c, ALPHA, BETA), MATCHED, MOVED_W, DELTA),
    "frozen": (lambda c, _: frozen(c), THETA, W, None),
}


def moved(learner, weights, transition):
    """The step that a learner makes in theta."""
    return learner.step(weights, transition).weights.theta - weights.theta


@pytest.mark.parametrize("name", BY_HAND)
def test_a_step_by_hand(controller, network, transition, weights, name):
    """It is pure, too, and a learner goes on from a copy and a pickle of it and of its weights."""
    network.batch = 1
    make, theta, w, delta = BY_HAND[name]
    learner, step = make(controller, network), transition(THETA)
    assert (learner.name, learner.gamma) == (name, controller.gamma)
    for one in (learner, learner, copy.deepcopy(learner), pickle.loads(pickle.dumps(learner))):
        update = one.step(weights, step)
        np.testing.assert_allclose([update.weights.theta, update.weights.w], [theta, w])
    assert update.delta == pytest.approx(delta)
    assert bool(controller.calls) == (name not in ("DES", "RDES", "frozen"))
    given = weights.theta, weights.w, step.solution.features
    np.testing.assert_array_equal(given, [THETA, W, PHI])
    after, expected = update.weights, moved(learner, update.weights, step)
    again = pickle.loads(pickle.dumps(after))
    for one in (copy.deepcopy(after), again, Weights(after.theta, after.w)):
        np.testing.assert_array_equal(moved(learner, one, step), expected)


@pytest.mark.parametrize(
    ("make", "inputs"), [(deep_expected_sarsa, 5), (regularized_deep_expected_sarsa, 8)]
)
def test_a_deep_learner_moves_once_its_network_is_ready_and_has_the_options_of_imitation(
    controller, network, transition, weights, make, inputs
):
    learner, one = make(controller, network, ALPHA, fits=4), transition(THETA)
    first, second, third = (learner.step(weights, one) for _ in range(3))
    assert first.weights is second.weights is weights
    assert (first.delta, first.successor, network.fits) == (None, None, 4)
    np.testing.assert_allclose(third.weights.theta, DEEP)
    assert [asked.size for asked in network.asked] == [inputs]
    network.batch = 9
    literal = make(controller, network, ALPHA, gated=False).step(weights, one)
    np.testing.assert_allclose(literal.weights.theta, DEEP)


def test_functions_for_rules_are_refused(controller):
    with pytest.raises(ValueError, match=r"must be an UpdateRule: write UpdateRule\(step\)"):
        Learner("old", SecondSolve(controller), lambda weights, *_: weights, 0.9)


def test_a_rule_of_the_user_has_a_memory_and_hears_of_failed_episodes(
    controller, transition, weights
):
    """Momentum that forgets its velocity; theta stays within the learner's bounds."""

    def step(theta, velocity, transition, delta, successor):
        velocity = 0.5 * velocity + ALPHA * delta * transition.solution.features
        return theta + velocity, velocity

    rule = UpdateRule(step, lambda first: 0 * first.theta, lambda theta, v: (theta, 0 * v))
    learner, one = Learner("own", SecondSolve(controller), rule, 0.9), transition(THETA)
    first = learner.step(weights, one).weights
    np.testing.assert_allclose(first.theta, ES)
    second = learner.step(first, one)
    expected = first.theta + 0.5 * (ES - THETA) + ALPHA * second.delta * PHI
    np.testing.assert_allclose(second.weights.theta, expected)
    np.testing.assert_array_equal(learner.interrupted(first).memory, np.zeros(3))
    np.testing.assert_array_equal(first.w, W)
    bounded = replace(learner, bounds=(np.full(3, -1.5), np.ones(3)))
    np.testing.assert_array_equal(bounded.step(weights, one).weights.theta, np.clip(ES, -1.5, 1.0))


def test_matched_is_as_long_as_ges_in_the_direction_of_es_and_stays_where_that_has_none(
    controller, transition, weights
):
    es, matched = expected_sarsa(controller, ALPHA), step_matched(controller, ALPHA, BETA)
    ges, step = gradient_expected_sarsa(controller, ALPHA, BETA), transition(THETA, cost=-9.0)
    length, there = np.linalg.norm(moved(ges, weights, step)), moved(es, weights, step)
    expected = length * there / np.linalg.norm(there)
    np.testing.assert_allclose(moved(matched, weights, step), expected)
    still, nowhere = Weights(np.zeros(3), W), transition(np.zeros(3), cost=0.0)  # every value is 0
    assert moved(ges, still, nowhere).any()
    assert not moved(matched, still, nowhere).any()


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (1, -1, 0)])
def test_random_steps_are_as_long_as_those_of_es_and_favour_no_direction(
    controller, transition, weights, axis
):
    """Archimedes: on a sphere, the component along any axis is uniform between -1 and 1."""
    step = transition(THETA)
    learner = random_direction(controller, ALPHA, np.random.default_rng(0))
    steps = np.array([moved(learner, weights, step) for _ in range(4000)])
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    np.testing.assert_allclose(lengths, np.linalg.norm(ES - THETA))
    along = steps / lengths @ axis / np.linalg.norm(axis)
    assert kstest(along, "uniform", args=(-1, 2)).pvalue > 1e-3


@pytest.mark.parametrize(
    "make", [lambda c: expected_sarsa(c, 0.5), lambda c: gradient_expected_sarsa(c, 0.4, 0.4)]
)
def test_learning_settles_at_the_bellman_equations_solution(controller, make):
    """Three states in a ring with costs 1, 2, 3; the features tell them apart, so V is exact."""
    states, costs, weights, learner = np.eye(3), (1.0, 2.0, 3.0), Weights(0 * W), make(controller)
    for k in range(9000):
        state, after = states[k % 3], states[(k + 1) % 3]
        solution = controller.solve(state, weights.theta)
        step = Transition(state, np.zeros(2), costs[k % 3], after, solution)
        weights = learner.step(weights, step).weights
    exact = np.linalg.solve(np.eye(3) - 0.9 * np.roll(np.eye(3), 1, axis=1), costs)
    np.testing.assert_allclose(weights.theta, exact, rtol=1e-3)
    np.testing.assert_allclose(weights.w, 0, atol=1e-2)  # no TD error is left to track

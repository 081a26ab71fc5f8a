"""Rules of batches: their memory, when a batch is full, and what LSTD-Q fits."""

import numpy as np
import pytest
from learning.small_runs import noise, run
from scipy.optimize import lsq_linear

from nmpcrl.learning import (
    Descent,
    Learner,
    SecondSolve,
    Transition,
    TrustRegion,
    Weights,
    batched,
    expected_sarsa,
    lstd_q,
    policy_gradient,
    random_direction,
    step_matched,
)
from nmpcrl.learning.batches import td_statistics
from nmpcrl.learning.gauss_newton import closed_loop

THETA = np.array([1.0, 0.5, -1.0])


def drawn(controller, count, theta=THETA):
    """Transitions between random states; the last ends the episode."""
    rng = np.random.default_rng(0)
    return [
        Transition(s, np.zeros(2), rng.normal(), later, controller.solve(s, theta),
                   last=k == count - 1)
        for k, (s, later) in enumerate(rng.normal(size=(count, 2, 3)))
    ]  # fmt: skip


def after(learner, transitions, theta=THETA):
    weights = Weights(theta)
    for transition in transitions:
        weights = learner.step(weights, transition).weights
    return weights.theta


@pytest.mark.parametrize(("every", "count"), [(1, 1), (4, 4), (None, 4)])
def test_theta_waits_for_a_full_batch_and_moves_by_its_mean(controller, every, count):
    steps, rule = drawn(controller, count), batched(td_statistics, Descent(0.1), every)
    learner = Learner("batch", SecondSolve(controller), rule, 0.9)
    np.testing.assert_array_equal(after(learner, steps[:-1]), THETA)
    alone = [after(expected_sarsa(controller, 0.1), [step]) - THETA for step in steps]
    np.testing.assert_allclose(after(learner, steps), THETA + np.mean(alone, axis=0))


def test_a_batch_of_no_step_is_refused():
    with pytest.raises(ValueError, match="every = 0 must be at least 1, or None for an episode"):
        lstd_q(None, every=0)


def test_lstd_q_fits_a_linear_value_to_its_targets_in_one_step(controller):
    steps = drawn(controller, 20)
    phi = np.array([step.state for step in steps])
    target = [step.cost + 0.9 * step.next_state @ THETA for step in steps]
    fitted = after(lstd_q(controller, regularisation=1e-10), steps)
    np.testing.assert_allclose(fitted, np.linalg.lstsq(phi, target)[0], rtol=1e-6)
    bounds = THETA - 0.7, THETA + 0.7
    bounded = after(lstd_q(controller, regularisation=1e-10, bounds=bounds), steps)
    np.testing.assert_allclose(bounded, lsq_linear(phi, target, bounds).x, rtol=1e-6)
    assert not np.allclose(bounded, np.clip(fitted, *bounds))
    scale = np.array([1.0, 0.5, 2.0])
    trusted = after(lstd_q(controller, optimiser=TrustRegion(0.1, scale)), steps)
    assert np.linalg.norm((trusted - THETA) / scale) == pytest.approx(0.1)


def filling(state, action, rng):
    cost = float((state[0] - 1) ** 2 + 0.1 * action[0] ** 2)
    return 0.9 * state + 0.3 * action + rng.normal(scale=0.01, size=1), cost, False


def trained(learner, tank, episodes, steps):
    how = {"plant": filling, "start": [0.0], "rng": 5}
    return run(learner, tank, noise(episodes, steps, 1, deviation=0.2), **how)


@pytest.mark.parametrize("make", [lambda nmpc: lstd_q(nmpc, 0.5, every=4), policy_gradient])
def test_a_run_goes_on_from_the_weights_of_any_of_its_steps(tank, make):
    shared = make(tank)
    steps, again = (trained(shared, tank, 2, 6) for _ in range(2))
    np.testing.assert_array_equal(steps[-1].weights.theta, again[-1].weights.theta)
    assert not np.array_equal(steps[-1].weights.theta, tank.problem.theta)
    assert steps[6].weights.memory.steps == (3 if shared.values_actions else 1)


@pytest.mark.parametrize(
    "make",
    [
        lambda tank: expected_sarsa(tank, 1e3),
        lambda tank: lstd_q(tank, regularisation=1e-6, every=1),
        lambda tank: policy_gradient(tank, 1e3, every=3),
        lambda tank: closed_loop(tank, TrustRegion(9.0, np.ones(2)), cost=lambda x, u, d: -x),
        lambda tank: step_matched(tank, 1e3, 1e-3),
        lambda tank: random_direction(tank, 1e3, np.random.default_rng(0)),
    ],
)
def test_learners_keep_theta_within_the_bounds_of_the_problem(tank, make):
    steps = trained(make(tank), tank, 2, 6)
    gains = np.array([step.weights.theta[0] for step in steps if not step.failure])
    assert ((gains >= 0.2) & (gains <= 0.6)).all()
    assert len(set(gains)) > 1

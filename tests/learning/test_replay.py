"""Replay, by hand and beside learning without it; schedules of step sizes."""

import numpy as np
import pytest

from nmpcrl.learning import (
    Exploration,
    Weights,
    lstd_q,
    policy_gradient,
    q_learning,
    replayed,
    scheduled,
    train,
)

ALPHA = 0.05


def plant(x, u, rng, t):
    return 0.9 * x + 0.7 * u + 0.1 * np.sin(t), float((x[0] - 1) ** 2 + 0.1 * u[0] ** 2), False


WORLD = {"plant": plant, "start": lambda rng: rng.uniform(0, 1, 1),
         "data": {"price": 0.1 * np.sin(np.arange(40))}}  # fmt: skip


def steps(learner, nmpc, count):
    explore = Exploration(episodes=1, steps=count, deviation=0.2)
    return list(train(learner, nmpc, Weights(nmpc.problem.theta), explore, **WORLD))


def test_a_replayed_step_is_a_step_along_the_transition_solved_anew(tank):
    """Only the last transition is kept, so that it is the one that is drawn."""
    base = q_learning(tank, ALPHA)
    (plain,), (found,) = steps(base, tank, 1), steps(replayed(base, tank, 1, size=1), tank, 1)
    theta, price = plain.weights.theta, WORLD["data"]["price"]
    now, after = ({"price": price[t : t + 4]} for t in (0, 1))
    again = tank.solve(plain.state, theta, action=plain.action, data=now)
    value = tank.solve(plain.next_state, theta, data=after).value
    delta = plain.cost + 0.9 * value - again.value
    by_hand = theta + ALPHA * delta * again.features
    np.testing.assert_allclose(found.weights.theta, by_hand, atol=1e-7)


@pytest.mark.parametrize("make", [lstd_q, policy_gradient])
def test_a_learner_of_batches_is_refused(tank, make):
    with pytest.raises(ValueError, match="replay needs a rule that moves theta at every step"):
        replayed(make(tank), tank)


def test_a_schedule_takes_a_part_of_each_step(tank):
    base = q_learning(tank, ALPHA)
    parts = [1.0, 0.5, 0.0, 0.0]
    found = steps(scheduled(base, parts.__getitem__), tank, 4)
    thetas = [tank.problem.theta, *(step.weights.theta for step in found)]
    for k, step in enumerate(found):
        whole = ALPHA * step.update.delta * step.solution.features
        np.testing.assert_allclose(thetas[k + 1] - thetas[k], parts[k] * whole, atol=1e-12)

"""A layout that changes: when, what a chart notices, and what a learner then does."""

import numpy as np
import pytest
from scipy.stats import t

from nmpcrl.learning import Diverged, Exploration
from nmpcrl.learning.training import Step
from nmpcrl.studies import shifts
from nmpcrl.studies.shifts import FOR, LIMIT, RAISED, WINDOW, Chart, Recent, changing, schedule
from nmpcrl.study import paper

TWO = (paper.LAYOUTS["A"], paper.LAYOUTS["D"])
RNG = np.random.default_rng


def test_a_layout_changes_once_every_fifty_episodes_or_by_chance():
    assert schedule("once", 300, RNG(0)) == [0] * 150 + [1] * 150
    assert schedule("every 50", 120, RNG(0)) == [0] * 50 + [1] * 50 + [2] * 20
    drawn = [schedule("random", 300, RNG(seed)) for seed in range(400)]
    assert np.mean([one[-1] for one in drawn]) == pytest.approx(299 / 50, abs=0.4)
    assert {one[0] for one in drawn} == {0}


def test_the_false_alarms_of_stationary_costs_are_as_many_as_the_law_of_t_says():
    rng, values = RNG(0), 60_000
    chart = Chart()
    fired = sum(chart(one) for one in rng.normal(4000.0, 30.0, values))
    falsely = 2 * t.sf(LIMIT / np.sqrt(1 + 1 / WINDOW), WINDOW - 1)  # each, as its class says
    assert fired == pytest.approx(falsely * (values - WINDOW), rel=0.35)
    assert 20 < fired < 100


def test_a_chart_fires_on_a_jump_at_once_either_way_and_then_begins_anew():
    for jump in (500.0, -500.0):
        rng, chart = RNG(0), Chart()
        before = [chart(one) for one in rng.normal(4000.0, 30.0, 40)]
        assert not any(before)
        assert chart(4000.0 + jump)
        assert not any(chart(4000.0 + jump * k) for k in range(WINDOW))


def test_what_is_not_finite_is_an_alarm():
    chart = Chart()
    for one in RNG(2).normal(size=WINDOW):
        chart(one)
    assert chart(np.nan)


def test_a_replay_that_prefers_what_is_late_draws_no_example_twice():
    rng = Recent(np.random.PCG64(0))
    drawn = np.array([rng.choice(20_000, 128, replace=False) for _ in range(200)])
    assert all(len({*row}) == 128 for row in drawn.tolist())
    ages = 19_999 - drawn
    assert ages.mean() == pytest.approx(Recent.AGE, rel=0.15)
    assert {*rng.choice(128, 128, replace=False).tolist()} == {*range(128)}


@pytest.fixture
def trained(monkeypatch):
    """Nothing is trained: each episode adds the factor of alpha to theta."""
    monkeypatch.setattr(shifts, "train", _train)

    def follow(order, costs=None, **reacts):
        _train.costs = iter(costs if costs is not None else [1.0] * len(order))
        noise = Exploration(np.zeros((len(order), 1, 2)), np.zeros((len(order), 1)))
        return [*changing(None, TWO, order, lambda factor: factor, noise, **reacts)]

    return follow


def _train(factor, _, weights, explore, **world):
    assert explore.scale.shape == (1, 1)
    moved = weights.__class__(weights.theta + factor, weights.w)
    cost = next(_train.costs)
    if cost is None:
        raise Diverged("so be it")
    yield Step(0, 0, None, moved, None, cost=cost)


def moved(episodes):
    return [float(one.theta[0] - paper.THETA_INIT[0]) for one in episodes]


def test_a_change_that_is_told_resets_theta_or_raises_the_rate_for_a_while(trained):
    order = [0] * 3 + [1] * (FOR + 2)
    assert moved(trained(order))[-1] == pytest.approx(FOR + 5)
    assert moved(trained(order, reaction="reset"))[2:5] == pytest.approx([3, 1, 2])
    raised = moved(trained(order, reaction="raised"))
    assert raised[2:4] == pytest.approx([3, 3 + RAISED])
    assert raised[-1] == pytest.approx(3 + FOR * RAISED + 2)


STEADY = RNG(0).normal(4000.0, 30.0, 30).tolist()


@pytest.mark.parametrize(
    ("order", "costs", "knows", "seen", "alarms", "theta"),
    [
        ([0, 1, 1], [1.0] * 3, "never", [0, 0, 0], [], [1, 2, 3]),
        ([0] * 30 + [1] * 2, [*STEADY, 5000.0, 5000.0], "cost", [*[0] * 31, 1], [30], [31, 1]),
        ([0] * 32, [*STEADY, 5000.0, 4000.0], "cost", [0] * 32, [30], [31, 1]),  # a false alarm
        ([0, 0, 0], [1.0, None, 1.0], "told", [0, 0, 0], [], [1, 1, 2]),  # diverges, keeps theta
    ],
)
def test_a_learner_reacts_to_what_its_controller_knows(
    trained, order, costs, knows, seen, alarms, theta
):
    found = trained(order, costs, knows=knows, reaction="reset")
    assert [one.layout for one in found] == order
    assert [one.seen for one in found] == seen
    assert [e for e, one in enumerate(found) if one.alarm] == alarms
    assert moved(found)[-len(theta) :] == pytest.approx(theta)

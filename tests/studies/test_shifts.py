"""Layouts that change: when, what a chart notices, and what a learner then does."""

from copy import copy

import numpy as np
import pytest
from scipy.stats import t

from nmpcrl.learning import Diverged, Exploration
from nmpcrl.learning.network import QNetwork
from nmpcrl.learning.training import Step
from nmpcrl.studies import shifts
from nmpcrl.studies.shifts import EVERY, FOR, LIMIT, RAISED, WINDOW, fires, sequence, shifting
from nmpcrl.study import paper
from nmpcrl.study.moving import still

TWO = [still(paper.LAYOUTS[name]) for name in "AD"]
RNG = np.random.default_rng
STEADY = RNG(0).normal(4000.0, 30.0, 30).tolist()


def test_a_layout_changes_once_every_fifty_episodes_or_by_chance_the_same_for_all_arms():
    names, order = sequence("every 50", "S01", 120)
    assert order == [0] * 50 + [1] * 50 + [2] * 20
    assert len({*names}) == 3
    assert sequence("once", "S01", 300) == (names[:2], [0] * 150 + [1] * 150)
    assert sequence("every 50", "S02", 120)[0] != names
    drawn = [sequence("random", f"S{i}", 300)[1] for i in range(400)]
    assert np.mean([one[-1] for one in drawn]) == pytest.approx(299 / 50, abs=0.4)
    assert {one[0] for one in drawn} == {0}


def test_the_false_alarms_of_stationary_costs_are_as_many_as_the_law_of_t_says():
    drawn = RNG(0).normal(4000.0, 30.0, 60_000)
    fired = sum(fires(drawn[: e + 1][-WINDOW - 1 :]) for e in range(len(drawn)))
    falsely = 2 * t.sf(LIMIT / np.sqrt(1 + 1 / WINDOW), WINDOW - 1)  # each, as `fires` says
    assert fired == pytest.approx(falsely * (len(drawn) - WINDOW), rel=0.35)


@pytest.mark.parametrize("last", [4500.0, 3500.0, np.nan])
def test_a_chart_fires_on_a_jump_either_way_and_on_nan_once_its_window_is_full(last):
    assert not fires(STEADY)
    assert fires([*STEADY, last])
    assert fires([*STEADY[:WINDOW], last])
    assert not fires([*STEADY[: WINDOW - 1], last])


def network_of(examples):
    network = QNetwork(1, RNG(1))
    for i in range(examples):
        network.remember(np.array([i / examples]), float(i > examples / 2))
    return network, shifts.Recent(copy(network), RNG(0))


def test_a_late_replay_draws_no_example_twice_and_fits_what_is_late_if_there_is_a_choice():
    _, late = network_of(20_000)
    drawn = np.array([late.draw() for _ in range(200)])
    assert all(len({*row}) == 128 for row in drawn.tolist())
    assert (19_999 - drawn).mean() == pytest.approx(shifts.AGE, rel=0.15)
    network, late = network_of(128)
    assert [late.fit() for _ in range(5)] == pytest.approx([network.fit() for _ in range(5)])
    assert late.weights == pytest.approx(network.weights, abs=1e-6)
    network, late = network_of(20_000)
    for _ in range(50):
        network.fit(), late.fit()
    middle = np.array([0.3])
    assert late.predict(middle) > network.predict(middle) + 0.2  # late targets are 1


@pytest.fixture
def trained(monkeypatch):
    """Nothing is trained: each episode adds the number that is the learner to theta."""

    def follow(order, costs=(), **reacts):
        each = iter([*costs, *[1.0] * (len(order) - len(costs))])

        def train(learner, _, weights, explore, **world):
            assert explore.scale.shape == (1, 1)
            moved, cost = weights.__class__(weights.theta + learner, weights.w), next(each)
            if cost is None:
                raise Diverged("so be it")
            yield Step(0, 0, None, moved, None, cost=cost)

        monkeypatch.setattr(shifts, "train", train)
        noise = Exploration(np.zeros((len(order), 1, 2)), np.zeros((len(order), 1)))
        return [*shifts.changing(None, TWO, order, 1.0, noise, **reacts)]

    return follow


def moved(episodes):
    return [float(theta[0] - paper.THETA_INIT[0]) for _, _, theta in episodes]


def test_a_change_that_is_told_resets_theta_or_raises_the_rate_for_a_while(trained):
    order = [0] * 3 + [1] * (FOR + 2)
    assert moved(trained(order, knows="told"))[-1] == pytest.approx(FOR + 5)
    assert moved(trained(order, knows="told", reset=True))[2:5] == pytest.approx([3, 1, 2])
    raised = moved(trained(order, knows="told", raised=RAISED))
    assert raised[2:4] == pytest.approx([3, 3 + RAISED])
    assert raised[-1] == pytest.approx(3 + FOR * RAISED + 2)


@pytest.mark.parametrize(
    ("order", "costs", "knows", "seen", "alarms", "theta"),
    [
        ([0, 1, 1], [1.0] * 3, "never", [0, 0, 0], [], [1, 2, 3]),
        ([0] * 30 + [1] * 2, [*STEADY, 5000.0, 5000.0], "cost", [*[0] * 31, 1], [30], [31, 1]),
        ([0] * 32, [*STEADY, 5000.0, 9000.0], "cost", [0] * 32, [30], [31, 1]),  # a false alarm
        ([*[0] * 30, 1, 0], [*STEADY, 5000.0, 5000.0], "cost", [*[0] * 31, 1], [30], [31, 1]),
        ([0, 0, 0], [1.0, None, 1.0], "told", [0, 0, 0], [], [1, 1, 2]),  # diverges, keeps theta
    ],
)
def test_a_learner_reacts_to_what_its_controller_knows(
    trained, order, costs, knows, seen, alarms, theta
):
    found = trained(order, costs, knows=knows, reset=True)
    assert [TWO.index(world.motions) for world, _, _ in found] == order
    assert [TWO.index(world.seen) for world, _, _ in found] == seen
    assert [e for e, (_, alarm, _) in enumerate(found) if alarm] == alarms
    assert moved(found)[-len(theta) :] == pytest.approx(theta)


@pytest.mark.parametrize(
    "setting", [("ES", "told", "raised"), ("RDES", "told", "recent"), ("frozen", "never", "plain")]
)
def test_a_changing_layout_is_judged_every_few_episodes_beside_theta_init(setting):
    row = shifting("once", setting, "S01", 2 * EVERY, 0)
    assert len(row["series"]) == 2
    assert row["cost"] == row["series"][-1]
    assert row["events"] == []
    if setting[0] == "frozen":
        assert row["series"][0] == 1.0  # theta_init with a true map
        assert row["series"][1] > 1.0  # and with the map of the first layout


def test_a_remedy_begins_anew_in_the_second_layout_with_the_episodes_that_are_left():
    row = shifting("once", ("remedy", "grid"), "S01", 22, 7)
    assert 0 < row["cost"] <= 1

"""Runs in worlds that change: each kind once and short, and the same again by its seed."""

import numpy as np
import pytest

from nmpcrl.analysis.encounters import judged
from nmpcrl.studies import worlds_run
from nmpcrl.studies.worlds import PARTS, WORLDS
from nmpcrl.studies.worlds_problems import controller
from nmpcrl.studies.worlds_run import EVERY, begun_anew, sequence
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, SCENARIOS
from nmpcrl.study.moving import World, frozen, still

FOUR = next(name for name, one in SCENARIOS.items() if len(one) == 4)  # compiled for most tests


def ran(part, arm, place="J001", episodes=2, k=0):
    setting, seed = PARTS[part].arms[arm], WORLDS.seed(place, k)
    return PARTS[part].run(setting, place, episodes, seed)


def test_no_two_places_share_a_seed():
    places = [*JUDGE, *SCENARIOS, *(f"S{i:02}" for i in range(1, 11))]
    seeds = [WORLDS.seed(place, k) for place in places for k in (0, 4)]
    assert len({*seeds}) == len(seeds)


@pytest.mark.parametrize(
    ("part", "arm", "place"),
    [
        ("moving", "frozen ES", FOUR),
        ("moving", "known CMA-ES", FOUR),
        ("model", "noise ES", "J001"),
        ("gradient", "0.05", "J001"),
    ],
)
def test_the_same_run_has_the_same_numbers_and_another_seed_others(part, arm, place):
    one, again, other = (ran(part, arm, place, 3, k) for k in (0, 0, 1))
    assert one == again
    assert one["cost"] != other["cost"]


def test_a_frozen_view_fares_as_its_world_says():
    row = ran("moving", "frozen init", FOUR)
    made = judged(controller(4), np.array(paper.THETA_INIT), World(SCENARIOS[FOUR], frozen))
    assert (row["cost"], row["inside"], row["collisions"]) == (made.cost, *made.counted)


def test_a_body_that_draws_is_judged_by_several_rollouts(monkeypatch):
    one = ran("model", "noise init")
    monkeypatch.setattr(worlds_run, "DRAWS", 1)
    assert ran("model", "noise init")["cost"] != one["cost"]
    assert ran("model", "turn init")["cost"] == ran("model", "turn grid", episodes=1)["cost"]


@pytest.mark.slow
def test_the_parameters_of_the_model_are_learned_and_the_oracle_knows_them():
    learned, oracle = ran("model", "drift ES+model", episodes=5), ran("model", "drift oracle")
    assert len(learned["series"]) == len(oracle["series"]) == 16
    assert learned["series"][9:] != pytest.approx([1, 0, 0, 1, 0, 0, 0], abs=1e-6)
    assert oracle["series"][9:] == pytest.approx([1, 0, 0, 1, 0, 0, 0.08])


def test_a_sequence_brings_another_layout_with_each_change_and_is_the_same_for_all_arms():
    names, order = sequence("every 50", "S01", 300)
    assert len({*names}) == 6 == order[-1] + 1
    assert sequence("every 50", "S01", 300) == (names, order)
    assert sequence("every 50", "S02", 300)[0] != names
    assert sequence("once", "S01", 300)[0] == names[:2]


@pytest.mark.parametrize("arm", ["ES told raised", "RDES told recent", "frozen never plain"])
def test_a_changing_layout_is_judged_every_few_episodes_beside_theta_init(arm):
    row = ran("once", arm, "S01", 2 * EVERY)
    assert len(row["series"]) == 2
    assert row["cost"] == row["series"][-1]
    assert row["events"] == []
    if arm.startswith("frozen"):
        assert row["series"][0] == 1.0  # theta_init with a true map
        assert row["series"][1] > 1.0  # and with the map of the first layout


def test_a_remedy_begins_anew_in_the_second_layout_with_the_episodes_that_are_left():
    row = begun_anew("once", "grid", "S01", 22, 7)
    assert 0 < row["cost"] <= 1


@pytest.mark.slow
def test_theta_is_carried_to_every_layout_and_theta_init_costs_what_it_costs_at_home():
    row = ran("carry", "frozen", "J002", 1)
    assert len(row["series"]) == 120
    assert row["cost"] == row["series"][1]


def test_the_cost_with_a_terminal_cost_is_a_share_of_theta_init_s_in_the_same_layout():
    row = ran("terminal", "diagonal", "J002", 1)
    costs = [
        judged(controller(), theta, World(still(JUDGE["J002"]))).cost
        for theta in (np.array(row["series"]), np.array(paper.THETA_INIT))
    ]
    assert row["cost"] == costs[0] / costs[1] != 1

"""What is run in worlds that change: each kind once and short, and the same again by its seed."""

import numpy as np
import pytest

from nmpcrl.analysis import worlds
from nmpcrl.analysis.encounters import judged
from nmpcrl.analysis.kept import Wanted
from nmpcrl.analysis.worlds import EVERY, JOBS, KEPT, Ran, compile_ahead, run, seed_of, sequence
from nmpcrl.study import paper
from nmpcrl.study.motions import frozen, still
from nmpcrl.study.population import JUDGE
from nmpcrl.study.scenarios import load
from nmpcrl.study.world import World, controller

FOUR = next(name for name, one in load().items() if len(one) == 4)  # compiled for most tests


def wanted(entry, place="J001", budget=2, k=0):
    return Wanted(entry, budget, place, seed_of(place, k))


def test_no_two_places_share_a_seed():
    places = [*JUDGE, *load(), *(f"S{i:02}" for i in range(1, 11))]
    seeds = [seed_of(place, k) for place in places for k in (0, 4)]
    assert len({*seeds}) == len(seeds)


@pytest.mark.parametrize(
    ("entry", "place"),
    [("moving: frozen ES", FOUR), ("moving: known CMA-ES", FOUR), ("model: noise ES", "J001"),
     ("gradient: 0.05", "J001")],
)  # fmt: skip
def test_the_same_run_has_the_same_numbers_and_another_seed_others(entry, place):
    one, again, other = (run(wanted(entry, place, 3, k=k)) for k in (0, 0, 1))
    assert one.cost == again.cost
    assert one.cost != other.cost
    assert one.seconds > 0


def test_who_foretells_the_motion_fares_as_the_world_says():
    ran = run(wanted("moving: frozen init", FOUR))
    made = judged(controller(4), np.array(paper.THETA_INIT), World(load()[FOUR], frozen))
    assert (ran.cost, ran.inside, ran.collisions) == (made.cost, *made.counted)


def test_a_body_that_draws_is_judged_by_several_rollouts(monkeypatch):
    one = run(wanted("model: noise init"))
    monkeypatch.setattr(worlds, "DRAWS", 1)
    assert run(wanted("model: noise init")).cost != one.cost
    assert run(wanted("model: turn init")).cost == run(wanted("model: turn grid", budget=1)).cost


@pytest.mark.slow
def test_the_model_s_own_parameters_are_learned_from_where_the_oracle_has_them():
    learned = run(wanted("model: drift ES+model", budget=5))
    oracle = run(wanted("model: drift oracle"))
    assert len(learned.series) == len(oracle.series) == 16
    assert learned.series[9:] != pytest.approx([1, 0, 0, 1, 0, 0, 0], abs=1e-6)
    assert oracle.series[9:] == pytest.approx([1, 0, 0, 1, 0, 0, 0.08])


def test_a_sequence_brings_another_layout_with_each_change_and_is_the_same_for_all_arms():
    names, order = sequence("every 50", "S01", 300)
    assert len({*names}) == 6 == order[-1] + 1
    assert sequence("every 50", "S01", 300) == (names, order)
    assert sequence("every 50", "S02", 300)[0] != names
    assert sequence("once", "S01", 300)[0] == names[:2]


@pytest.mark.parametrize("arm", ["ES told raised", "RDES told recent", "frozen never plain"])
def test_a_changing_layout_is_judged_every_few_episodes_beside_theta_init(arm):
    ran = run(wanted(f"once: {arm}", "S01", 2 * EVERY))
    assert len(ran.series) == 2
    assert ran.cost == ran.series[-1]
    assert ran.events == []
    if arm.startswith("frozen"):
        assert ran.series[0] == 1.0  # theta_init, and its map is true
        assert ran.series[1] > 1.0  # and is that of the first layout


def test_a_remedy_is_begun_anew_in_the_second_layout_with_what_is_left():
    ran = run(wanted("once: remedy grid", "S01", 22))
    assert 0 < ran.cost <= 1
    assert ran.series == []


@pytest.mark.slow
def test_theta_is_carried_to_every_layout_and_theta_init_costs_what_it_costs_at_home():
    ran = run(wanted("carry: frozen", "J002", 1))
    assert len(ran.series) == 120
    assert ran.cost == ran.series[1]


def test_with_a_terminal_cost_the_share_is_of_what_theta_init_costs_in_the_same_layout():
    ran = run(wanted("terminal: diagonal", "J002", 1))
    costs = [judged(controller(), theta, World(still(JUDGE["J002"]))).cost
             for theta in (np.array(ran.series), np.array(paper.THETA_INIT))]  # fmt: skip
    assert ran.cost == costs[0] / costs[1] != 1


def test_what_is_run_is_kept_and_read_again(tmp_path, monkeypatch, trains_here):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    one = wanted("moving: known init", FOUR)
    made = KEPT.complete([one], run, before=compile_ahead, said=lambda *_: "", progress=False)
    assert KEPT.stored([one]) == made
    assert KEPT.path_of(one).parent.name == "worlds"
    monkeypatch.setattr(worlds, "EPOCH", 2)
    assert KEPT.stored([one]) == {}


def test_nothing_is_said_of_what_a_part_does_not_have():
    parts = {"moving", "model", "once", "every 50", "random", "carry", "gradient", "terminal"}
    assert {*JOBS} == parts
    assert np.isnan(Ran().cost)

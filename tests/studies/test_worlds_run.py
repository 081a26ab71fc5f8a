"""Runs in worlds that move or are not the model: each kind once, short, and again by its seed."""

import numpy as np
import pytest

from nmpcrl.analysis.encounters import judged
from nmpcrl.studies import worlds_run
from nmpcrl.studies.worlds import PARTS, WORLDS
from nmpcrl.studies.worlds_run import TERMINALS, begin, controller
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, SCENARIOS
from nmpcrl.study.moving import World, frozen, still

THETA = np.array(paper.THETA_INIT)
FOUR = next(name for name, one in SCENARIOS.items() if len(one) == 4)  # compiled for most tests


def ran(part, arm, place="J001", episodes=2, k=0):
    setting, seed = PARTS[part].arms[arm], WORLDS.seed(place, k)
    return PARTS[part].run(setting, place, episodes, seed)


@pytest.mark.parametrize(
    ("part", "arm", "place"),
    [("moving", "frozen ES", FOUR), ("moving", "known CMA-ES", FOUR), ("model", "noise ES", "J001"),
     ("gradient", "0.05", "J001")],
)  # fmt: skip
def test_the_same_run_has_the_same_numbers_and_another_seed_others(part, arm, place):
    one, again, other = (ran(part, arm, place, 3, k) for k in (0, 0, 1))
    assert one == again
    assert one["cost"] != other["cost"]


def test_a_frozen_view_fares_as_its_world_says():
    row = ran("moving", "frozen init", FOUR)
    made = judged(controller(), THETA, World(SCENARIOS[FOUR], frozen))
    assert (row["cost"], row["inside"], row["collisions"]) == (made.cost, *made.contacts)


def test_a_body_that_draws_is_judged_by_several_rollouts(monkeypatch):
    one = ran("model", "noise init")
    monkeypatch.setattr(worlds_run, "DRAWS", 1)
    assert ran("model", "noise init")["cost"] != one["cost"]
    assert ran("model", "turn init")["cost"] == ran("model", "turn grid", episodes=1)["cost"]


@pytest.mark.slow
def test_the_parameters_of_the_model_are_learned_and_the_oracle_knows_them():
    learned, oracle = (ran("model", f"drift {how}", episodes=5)["series"]
                       for how in ("ES+model", "oracle"))  # fmt: skip
    assert oracle == pytest.approx([*THETA, 1, 0, 0, 1, 0, 0, 0.08])
    assert len(learned) == 16
    assert learned[9:] != pytest.approx([1, 0, 0, 1, 0, 0, 0], abs=1e-6)


@pytest.mark.slow
def test_theta_is_carried_to_every_layout_and_theta_init_costs_what_it_costs_at_home():
    row = ran("carry", "frozen", "J002", 1)
    assert len(row["series"]) == 120
    assert row["cost"] == row["series"][1]


def test_the_cost_with_a_terminal_cost_is_a_share_of_theta_init_s_in_the_same_layout():
    row = ran("terminal", "diagonal", "J002", 1)
    costs = (judged(controller(), theta, World(still(JUDGE["J002"]))).cost
             for theta in (np.array(row["series"]), THETA))  # fmt: skip
    assert row["cost"] == next(costs) / next(costs) != 1


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.parametrize("terminal", TERMINALS[1:])
def test_a_richer_terminal_cost_begins_as_the_papers_and_can_become_another(terminal):
    richer, data = controller(terminal), {"centres": np.array(paper.LAYOUTS["A"])}
    theta, state = begin(richer), np.array([4.0, 1.4, -0.3])
    np.testing.assert_array_equal(theta[:9], THETA)
    printed, same = (one.solve(state, each, data=data)
                     for one, each in ((controller(), THETA), (richer, theta)))  # fmt: skip
    assert same.value == pytest.approx(printed.value, rel=1e-9)
    for k in range(9, theta.size):
        step = 1e-5 * np.eye(theta.size)[k]
        ahead, behind = (
            richer.solve(state, one, data=data).value for one in (theta + step, theta - step)
        )
        assert same.features[k] == pytest.approx((ahead - behind) / 2e-5, rel=1e-3, abs=1e-4)
        assert same.features[k] != 0

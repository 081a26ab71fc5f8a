"""What is counted in worlds that change, and runs in them: short, and again by their seed.

`tests/golden` holds the answers of published rows.
"""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.encounters import crowding, judged
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.studies import worlds_run
from nmpcrl.studies.worlds import PARTS, WORLDS, back, noticing
from nmpcrl.studies.worlds_run import TERMINALS, controller
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, SCENARIOS
from nmpcrl.study.moving import World, frozen, still

COLUMNS = [*WORLDS.table().columns]
THETA = np.array(paper.THETA_INIT)
FOUR = next(name for name, one in SCENARIOS.items() if len(one) == 4)  # compiled for most tests


def rows(part, arm, **values):
    """All runs of an arm; a value may be a function of the place's number."""
    known = {"cost": 1.0, "inside": 0, "collisions": 0, "arrived": True, "series": [],
             "events": [], "seconds": 1.0} | values  # fmt: skip
    places = PARTS[part].places
    return [
        {"part": part, "arm": arm, "place": place, "k": k}
        | {name: one(places.index(place)) if callable(one) else one for name, one in known.items()}
        for place, k in PARTS[part].order(arm)
    ]


def answered(*some):
    table = pd.DataFrame([one for each in some for one in each], columns=COLUMNS)
    return WORLDS.answers(table)


def test_of_nothing_nothing_is_decided_and_costs_alarms_and_solutions_are_as_by_hand():
    found = answered()
    assert [*found] == [one.name for one in WORLDS.questions]
    assert {one.outcome for one in found.values()} == {UNDECIDABLE}
    before = [0.9] * 30
    assert back([*before, 0.91, *[0.9] * 29], 150) == 5
    assert back([*before, 1.2, 0.9, 1.2, *[0.9] * 27], 150) == 20
    assert back([*before, *[1.2] * 30], 150) == np.inf
    delay, false = noticing([50, 100, 150, 200, 250], [30, 54, 104, 154, 204, 254, 280])
    assert delay == 5
    assert false == pytest.approx(2 / (50 + 5 * 45))
    assert noticing([50, 100], []) == (50, 0.0)
    papers = rows("terminal", "diagonal", cost=lambda i: 1.2 if i < 12 else 0.9)
    for row in papers[24:40:2]:  # with the 12 above it fails in 20 of 30 layouts
        row["arrived"] = False
    learned = rows("terminal", "learned", cost=lambda i: 1.1 if i < 19 else 0.8)
    found = answered(papers, rows("terminal", "full", cost=1.0), learned)
    said = [
        (one.outcome, *one.counts.values()) for name, one in found.items() if "terminal" in name
    ]
    assert said == [(NOT, (0, 20)), (REPRODUCED, (19, 20)), (PARTLY, (23, 30))]


@pytest.mark.parametrize(
    ("inside", "outcome", "correlation"),
    [
        (lambda rank: rank, REPRODUCED, 1),
        (lambda rank: -rank, NOT, -1),
        (lambda rank: 0, PARTLY, 0),
        (lambda rank: rank == 39, PARTLY, 0.27),  # one scenario alone shows nothing
    ],
)
def test_states_inside_rise_or_fall_with_crowding(inside, outcome, correlation):
    order = sorted(SCENARIOS, key=lambda name: crowding(SCENARIOS[name]))
    ranks = [order.index(place) for place in PARTS["moving"].places]
    found = answered(rows("moving", "extrapolated init", inside=lambda i: inside(ranks[i])))
    assert found["crowding"].outcome == outcome
    assert found["crowding"].numbers["correlation"] == pytest.approx(correlation, abs=0.01)


# Runs


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


def test_a_frozen_view_fares_as_its_world_says_and_a_body_that_draws_has_several_rollouts(
    monkeypatch,
):
    row = ran("moving", "frozen init", FOUR)
    made = judged(controller(), THETA, World(SCENARIOS[FOUR], frozen))
    assert (row["cost"], row["inside"], row["collisions"]) == (made.cost, *made.contacts)
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
    theta, state = richer.problem.theta, np.array([4.0, 1.4, -0.3])
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

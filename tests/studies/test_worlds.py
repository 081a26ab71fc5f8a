"""The answers of worlds that change, of tables in which they can be told by hand."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims.investigation import WORDS
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.studies.worlds import PARTS, REMEDY, WORLDS, after, back, changes, noticing

COLUMNS = [*WORLDS.table().columns]


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


def test_of_nothing_no_question_can_be_decided():
    found = answered()
    assert [*found] == [one.name for one in WORLDS.questions]
    assert {one.outcome for one in found.values()} == {UNDECIDABLE}
    assert {one.outcome for one in found.values()}.isdisjoint(WORDS)


def test_predictors_are_compared_and_collisions_put_down_to_one_of_them():
    found = answered(
        rows("moving", "known init", cost=100.0),
        rows("moving", "extrapolated init", cost=106.0, inside=lambda i: i // 20),
        rows("moving", "frozen init", cost=121.0, inside=3),
        rows("moving", "frozen ES", cost=lambda i: 105.0 if i < 10 else 107.0),
    )
    enough, more = found["a velocity is enough"], found["a frozen view costs more"]
    assert (enough.outcome, more.outcome) == (REPRODUCED, REPRODUCED)
    assert more.numbers["median ratio"] == pytest.approx(1.21)
    assert found["collisions"].counts == {"scenarios": (20, 40)}
    assert found["learning or looking"].counts == {"scenarios": (10, 40)}
    assert found["crowding"].outcome in (PARTLY, REPRODUCED, NOT)


def test_what_learning_the_model_adds_is_counted_by_fault():
    found = answered(
        *(rows("model", f"{fault} {how}", cost=cost)
          for fault in ("drift", "speed") for how, cost in
          (("init", 100.0), ("oracle", 99.0), ("ES", 95.0), ("ES+model", 94.0 if fault == "drift"
                                                             else 96.0)))
    )  # fmt: skip
    assert found["a perfect model"].counts == {"faults and layouts": (24, 24)}
    assert found["a perfect model"].outcome == REPRODUCED
    adds = found["only drift adds"]
    assert (adds.outcome, adds.counts["layouts"], adds.counts["speed"]) == (
        REPRODUCED, (12, 12), (0, 12))  # fmt: skip
    assert found["recovered by weights"].outcome == REPRODUCED


def test_a_cost_is_back_at_the_rollout_after_which_it_stays():
    before = [0.9] * 30
    assert back([*before, 0.91, *[0.9] * 29], 150) == 5
    assert back([*before, 1.2, 0.9, 1.2, *[0.9] * 27], 150) == 20
    assert back([*before, *[1.2] * 30], 150) == np.inf


def test_a_share_is_averaged_from_the_first_change_on():
    assert changes("every 50", "S01") == [50, 100, 150, 200, 250]
    assert after("every 50", "S01", [*[1.0] * 10, *[0.8] * 50]) == pytest.approx(0.8)


def test_an_alarm_where_the_map_is_true_is_false_and_a_change_unnoticed_counts_whole():
    delay, false = noticing([50, 100, 150, 200, 250], [30, 54, 104, 154, 204, 254, 280])
    assert delay == 5
    assert false == pytest.approx(2 / (50 + 5 * 45))
    assert noticing([50, 100], []) == (50, 0.0)


def test_a_changing_world_is_judged_beside_replanning():
    lower, higher = [0.9] * 60, [1.1] * 60
    told = [rows(part, "ES told plain", series=lower, cost=0.9)
            for part in ("once", "every 50", "random")]  # fmt: skip
    found = answered(
        *told, rows("every 50", "ES never plain", series=higher),
        rows("once", f"remedy {REMEDY}", cost=0.8),
        rows("every 50", "ES cost plain", series=higher, events=[54, 104, 154, 204, 254]),
    )  # fmt: skip
    assert found["learning pays in a changing world"].outcome == REPRODUCED
    assert found["being told"].outcome == REPRODUCED
    assert found["detecting"].outcome == NOT
    assert found["a chart on the cost"].counts == {"sequences": (10, 10)}
    assert found["begun anew"].counts == {"sequences": (10, 10)}
    assert found["back soon"].numbers == {"median episodes": 5.0}


def test_theta_is_carried_over_if_it_costs_less_in_most_others():
    half = [0.5] * 60 + [1.5] * 60  # 59 of 119 others for the first 60, and 60 for the rest
    found = answered(
        rows("carry", "frozen", series=[1.0] * 120)[:1], rows("carry", "ES", series=half)
    )
    assert found["carried over"].counts == {"layouts": (60, 120)}


def test_a_richer_terminal_cost_is_asked_where_the_paper_s_fails():
    """Of 30 layouts the paper's fails in 20: 12 cost more, and in 8 a seed does not arrive."""
    paper_s = rows("terminal", "diagonal", cost=lambda i: 1.2 if i < 12 else 0.9)
    for one in paper_s[24:40:2]:
        one["arrived"] = False
    found = answered(
        paper_s,
        rows("terminal", "full", cost=0.95),
        rows("terminal", "learned", cost=lambda i: 1.1 if i < 19 else 0.8),
    )
    assert found["full terminal cost"].counts == {"layouts": (0, 20)}
    assert found["learned terminal cost"].counts == {"layouts": (19, 20)}
    pays = found["a richer terminal cost pays"]
    assert pays.counts == {"layouts": (23, 30)}
    assert pays.numbers["median ratio"] == pytest.approx(1.1 / 1.2)

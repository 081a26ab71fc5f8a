"""What is counted in worlds that change; `tests/golden` holds the answers of published rows."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis.encounters import crowding
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.studies.worlds import PARTS, WORLDS, back, noticing
from nmpcrl.study.drawn import SCENARIOS

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


def test_a_cost_is_back_at_the_rollout_after_which_it_stays():
    before = [0.9] * 30
    assert back([*before, 0.91, *[0.9] * 29], 150) == 5
    assert back([*before, 1.2, 0.9, 1.2, *[0.9] * 27], 150) == 20
    assert back([*before, *[1.2] * 30], 150) == np.inf


def test_an_alarm_where_the_map_is_true_is_false_and_a_change_unnoticed_counts_whole():
    delay, false = noticing([50, 100, 150, 200, 250], [30, 54, 104, 154, 204, 254, 280])
    assert delay == 5
    assert false == pytest.approx(2 / (50 + 5 * 45))
    assert noticing([50, 100], []) == (50, 0.0)


def test_a_cost_of_1_solves_and_a_terminal_cost_is_asked_where_the_papers_does_not_solve():
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

"""What the comparison of remedies says of made-up runs: shares, settings, advice and answers."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims.remedies import (
    advice,
    answers,
    best_setting,
    expectations,
    greatest,
    rows,
    shares,
    solved,
)
from nmpcrl.claims.remedy_questions import (
    FIRST,
    LATER,
    NEVER,
    OPEN,
    PARTS,
    REMEDY_QUESTIONS,
    SECOND,
)
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE

RUN = {
    "part": "judge 50",
    "entry": "ES",
    "name": "ES",
    "layout": "J001",
    "k": 0,
    "initial": 4000.0,
    "best": 3000.0,
    "cost": 3500.0,
    "arrived": True,
    "episodes": 50,
    "over": False,
    "seconds": 1.0,
}


def run(**fields):
    return {**RUN, **fields}


def block(entry, part="judge 50", gains=0.5, name=None, layouts=20, **fields):
    """One run a layout, whose share of the possible gain is given, alike or layout by layout."""
    given = np.broadcast_to(gains, layouts)
    where = PARTS[part].layouts[:layouts]
    return [
        run(entry=entry, name=name or entry, part=part, layout=layout, **fields)
        | {"cost": 4000 - 1000 * gain}
        for layout, gain in zip(where, given, strict=True)
    ]


def table(*blocks):
    return pd.DataFrame([one for some in blocks for one in some])


def word(found, entry):
    return next(one.word for one in advice(found) if one.entry == entry)


def answer(found, name):
    return next(one for one in answers(found) if one.question == name)


def test_a_share_is_of_the_possible_gain_and_its_seeds_are_averaged_first():
    found = shares(pd.DataFrame([run(), run(k=1, cost=3100.0), run(layout="J002", cost=2900.0)]))
    assert found.to_dict() == pytest.approx({"J001": 0.7, "J002": 1.1})


def test_a_failed_solve_is_infinitely_bad_and_is_no_error():
    assert shares(pd.DataFrame([run(), run(k=1, cost=np.inf)])).tolist() == [-np.inf]


def test_where_hardly_any_gain_is_possible_a_layout_is_left_out_and_counted():
    runs = [run(), run(layout="J002", best=3981.0), run(layout="J003", best=3979.0)]
    assert [*shares(pd.DataFrame(runs)).index] == ["J001", "J003"]
    (row,) = rows(pd.DataFrame(runs), "judge 50")
    assert (row.layouts, row.left_out) == (3, 1)


def test_a_layout_is_solved_under_every_seed_and_for_no_more_than_before():
    runs = [run(), run(layout="J002", cost=4000.0), run(layout="J003", cost=4000.1)]
    runs += [run(layout="J004"), run(layout="J004", k=1, arrived=False)]
    assert solved(pd.DataFrame(runs)).tolist() == [True, True, False, False]


def test_the_best_setting_is_the_one_with_the_greatest_gain_and_the_first_of_equal_ones():
    first = block("ES", "tune", 0.2, layouts=15)
    other = block("ES", "tune", 0.4, name="ES[alpha=3e-07]", layouts=15)
    again = block("ES", "tune", 0.4, name="ES[alpha=1e-06]", layouts=15)
    failed = block("ES", "tune", -np.inf, name="ES[alpha=3e-08]", layouts=15)
    assert best_setting(table(first, failed, other, again)) == "ES[alpha=3e-07]"
    assert best_setting(table(failed)) == "ES[alpha=3e-08]"


def test_what_is_disqualified_is_advised_neither_way():
    assert advice(table(block("ES", over=True), block("ES", "judge 300"))) == ()


def test_the_greatest_lower_end_is_first_and_not_the_greatest_value():
    wide = block("CMA-ES", gains=np.r_[np.full(6, 0.1), np.full(14, 1.0)])
    narrow = block("SPSA", gains=0.8)
    found = table(wide, narrow, block("ES", gains=0.3), block("GES", gains=0.2))
    by = {one.entry: one for one in rows(found, "judge 50")}
    assert by["CMA-ES"].gain.value > by["SPSA"].gain.value
    assert by["CMA-ES"].gain.low < by["SPSA"].gain.low
    assert next(one.entry for one in advice(found)) == "SPSA"
    assert word(found, "SPSA") == FIRST
    assert word(found, "ES") == LATER


def test_what_ties_with_50_episodes_is_ordered_by_300_and_then_by_time():
    found = table(
        block("SPSA", gains=0.801), block("CMA-ES", gains=0.799), block("ES", gains=0.8, seconds=9),
        block("SPSA", "judge 300", 0.5), block("CMA-ES", "judge 300", 0.9),
        block("ES", "judge 300", 0.5),
    )  # fmt: skip
    assert [one.entry for one in advice(found)] == ["CMA-ES", "SPSA", "ES"]
    assert [one.word for one in advice(found)] == [FIRST, SECOND, LATER]


def test_who_loses_at_every_budget_is_never_advised_and_who_gains_at_one_is_open():
    found = table(
        block("DPG", gains=-0.5), block("DPG", "judge 300", -0.2),
        block("ES", gains=-0.5), block("ES", "judge 300", 0.2),
    )  # fmt: skip
    assert word(found, "DPG") == NEVER
    assert word(found, "ES") == OPEN
    assert expectations(found)["DPG is never advised"]


def test_a_gain_is_sure_if_its_whole_interval_is_above_0():
    found = table(block("ES", gains=np.tile([-0.5, 1.0], 10)), block("GES", gains=0.01))
    by = {one.entry: one for one in rows(found, "judge 50")}
    assert by["ES"].gain.low < 0 < by["ES"].gain.value
    assert word(found, "ES") == OPEN
    assert word(found, "GES") == FIRST


def test_who_solves_fewer_than_half_is_never_advised_whatever_it_gains():
    found = table(block("CMA-ES", gains=0.9, arrived=False), block("SPSA", gains=0.1))
    assert word(found, "CMA-ES") == NEVER
    assert word(found, "SPSA") == FIRST


def test_the_tuning_is_part_of_the_price():
    found = table(block("ES"), block("ES", "tune", layouts=15), block("frozen", gains=0.0))
    (one,) = advice(found)
    assert (one.entry, one.tuning) == ("ES", 15 * 50)


def test_what_was_expected_is_held_against_what_came():
    found = table(
        block("undone-GN-J", gains=0.9), block("CMA-ES", gains=0.8),
        block("undone-GN-J", "judge 300", 0.9), block("CMA-ES", "judge 300", 0.8),
    )  # fmt: skip
    assert greatest(found) == {50: "undone-GN-J", 300: "undone-GN-J"}
    assert expectations(found) == {
        "undone-GN-J is first with 50 episodes": True,
        "CMA-ES is first with 300 episodes": False,
    }


def test_every_question_has_an_answer_and_without_runs_none_is_decided():
    found = table(block("frozen", gains=0.0))
    assert [one.question for one in answers(found)] == [*REMEDY_QUESTIONS]
    assert {one.outcome for one in answers(found)} == {UNDECIDABLE}


def test_search_is_held_against_learning_in_the_same_layouts():
    found = table(
        block("CMA-ES", "judge 300", 0.95),
        block("ES", "judge 300", 0.5),
        [run(part="named 300", entry="ES", name="ES", layout="A", cost=3470.0)],
    )
    one = answer(found, "search and learning")
    assert (one.outcome, one.counts) == (REPRODUCED, {"layouts": (20, 20)})
    assert one.numbers["ES in A"] == pytest.approx(0.53)
    assert answer(found, "search nears the best").outcome == REPRODUCED


def test_undo_gains_where_it_costs_less_than_before():
    found = table(block("undone-GN-J", gains=np.r_[np.zeros(10), np.full(10, 0.1)]))
    one = answer(found, "undone steps on the loop's cost gain")
    assert (one.outcome, one.counts["layouts"]) == (PARTLY, (10, 20))


def test_the_grid_is_asked_only_where_the_robot_arrives():
    lost = [{**one, "arrived": False} for one in block("grid", "judge 300", 0.1, layouts=10)]
    won = block("grid", "judge 300", 0.9)[10:]
    found = table(lost, won, block("GES", "judge 300", 0.5))
    assert answer(found, "one number by hand").counts == {"layouts": (10, 10)}


@pytest.mark.parametrize(
    ("more", "outcome", "words"),
    [
        (0.1, REPRODUCED, "confirmed"),
        (-0.1, NOT, "contradicted"),
        (np.tile([0.1, -0.1], 10), PARTLY, "no difference shown"),
    ],
)
def test_a_difference_is_read_by_its_interval_and_confirms_nothing_in_part(more, outcome, words):
    found = table(block("GES", gains=0.5), block("GES-3", gains=0.5 + more))
    one = answer(found, "faster auxiliary weights")
    assert (one.outcome, one.words, one.counts) == (outcome, words, {})
    assert sum(yes for yes, _ in one.beside.values()) == np.sum(np.resize(more, 20) > 0)


def test_who_fails_together_does_not_differ():
    found = table(block("ES", gains=-np.inf), block("averaged-ES", gains=-np.inf))
    one = answer(found, "averaging")
    assert (one.outcome, one.numbers["difference"]) == (PARTLY, 0)


def test_the_guard_is_asked_with_the_step_sizes_that_fail_without_it():
    def tune(entry, setting, arrived):
        return block(entry, "tune", name=f"{entry}{setting}", layouts=15, arrived=arrived)

    unguarded = [tune("RDES", "", True), tune("RDES", "[alpha=1e-06]", False)]
    helps = [tune("guarded-RDES", "", False), tune("guarded-RDES", "[alpha=1e-06]", True)]
    one = answer(table(*unguarded, *helps), "guard")
    assert (one.outcome, one.counts) == (REPRODUCED, {"layouts": (15, 15)})
    fails = [tune("guarded-RDES", "", True), tune("guarded-RDES", "[alpha=1e-06]", False)]
    assert answer(table(*unguarded, *fails), "guard").outcome == NOT


def test_an_answer_is_said_in_words():
    one = answer(table(block("frozen")), "undo")
    assert replace(one, outcome=NOT).words == "contradicted"

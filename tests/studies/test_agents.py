"""The answers on SAC and TD3, on tables that leave no doubt."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.studies.agents import (
    AGENTS,
    CHECKPOINTS,
    PARTS,
    SAC_AND_TD3,
    SETTINGS,
    NotTuned,
    answers,
    course,
    rows,
    tuned,
)
from nmpcrl.studies.agents_run import EVERY, judged_in, trained_in
from nmpcrl.study.drawn import JUDGE, TUNE

COLUMNS = [*SAC_AND_TD3.table().columns]
NOTHING = pd.DataFrame(columns=["part", "entry", "place", "initial", "best", "cost"])


def runs(part, agent, share, there="a", seen=None):
    """All runs of an agent: the shares go down to the last, in layouts seen to another one."""
    found = []
    for place, k in PARTS[part].order(agent):
        known, points = judged_in(place), CHECKPOINTS[part]
        last = [seen if seen and name in TUNE else share for name in known]
        costs = [[200.0 * one for one in last]] * (len(points) - 2)
        found.append(
            {"part": part, "arm": f"{agent}[turn=0.5]", "place": place, "k": k,
             "initial": [100.0] * len(known),
             "costs": [*costs, [100.0 * one for one in last], [100.0 * one for one in last]],
             "arrived": [there * len(known)] * len(points), "episodes": points[-1],
             "steps": 130 * points[-1], "seconds": 1.5}
        )  # fmt: skip
    return pd.DataFrame(found, columns=COLUMNS)


def suite(share=0.95, layouts=(*JUDGE,), part="judge 50"):
    """The best search."""
    return pd.DataFrame(
        [{"part": part, "entry": "Bayes", "place": one, "initial": 100.0, "best": 90.0,
          "cost": 100.0 * share + k} for one in layouts for k in (-1, 1)]
    )  # fmt: skip


def by(table, compared=NOTHING):
    return answers(table, compared)


def test_of_nothing_nothing_can_be_decided():
    found = by(pd.DataFrame(columns=COLUMNS))
    assert [*found] == [*SAC_AND_TD3.asked]
    assert {one.outcome for one in found.values()} == {UNDECIDABLE}


def test_an_agent_matches_where_it_costs_no_more_and_solves_where_it_also_arrives():
    found = by(
        pd.concat([runs("judge", "SAC", 1.0, there="-"), runs("judge", "TD3", 0.9)]), suite()
    )
    assert found["SAC matches in 300 episodes"].outcome == REPRODUCED
    assert found["SAC solves in 300 episodes"].outcome == NOT
    assert found["TD3 solves in 300 episodes"].outcome == REPRODUCED
    assert found["SAC or TD3"].outcome == NOT
    assert found["SAC or the best search"].outcome == NOT
    assert found["TD3 or the best search"].outcome == REPRODUCED
    assert found["TD3 or the best search"].numbers["median ratio"] == pytest.approx(0.9 / 0.95)


def test_in_one_layout_it_is_said_after_how_many_episodes_the_median_matches():
    table = runs("one", "TD3", 0.9)
    found = by(table, suite(0.8, ["A"], "named 50"))
    said = found["TD3 matches in one layout"]
    assert said.outcome == REPRODUCED
    assert said.counts == {"seeds": (4, 4)}
    assert said.numbers["matches first"] == said.numbers["matches from"] == 500
    assert found["TD3 or the best search in one layout"].outcome == NOT
    assert found["SAC matches in one layout"].outcome == UNDECIDABLE


def test_a_match_that_does_not_last_is_no_match_from_then_on():
    table = runs("one", "TD3", 0.9)
    table["costs"] = [[[90.0], *each[1:-1], [101.0]] for each in table.costs]
    one = course(table, "one", "TD3")
    assert one.matched == (25, np.inf)


def test_one_agent_for_all_is_judged_in_what_it_saw_and_in_what_it_did_not():
    found = by(runs("all", "SAC", 1.1, seen=0.9), suite())
    assert found["SAC matches over the 60"].outcome == REPRODUCED
    assert found["SAC matches over the 60"].counts == {"layouts": (60, 60)}
    assert found["SAC matches on the 120"].outcome == NOT
    assert found["SAC matches on the 120"].counts == {"layouts": (0, 120)}
    assert found["SAC or the best search on the 120"].counts == {"layouts": (0, 120)}
    assert np.isinf(found["SAC matches on the 120"].numbers["matches first"])


def test_between_all_and_none_a_question_is_answered_in_part():
    table = runs("judge", "SAC", 0.9)
    table["costs"] = [
        each if i % 2 else [*each[:-1], [130.0]] for i, each in enumerate(table.costs)
    ]
    assert by(table)["SAC matches in 300 episodes"].outcome == PARTLY


def test_an_agent_has_a_row_of_the_suite_by_the_share_of_the_possible_gain():
    table = pd.concat([runs("judge", "SAC", 0.95), runs("judge", "TD3", 1.2, there="-")])
    first, second = rows(table, suite())
    assert (first.entry, first.name, first.rollouts) == ("SAC", "SAC[turn=0.5]", 300)
    assert first.gain.value == pytest.approx(0.5)
    assert first.solved.value == 1
    assert second.gain.value == pytest.approx(-2)
    assert second.solved.value == 0
    assert not first.disqualified


def test_an_agent_is_judged_with_the_setting_that_costs_least_and_not_before_it_is_known():
    tuning = [
        {"part": "tune", "arm": str(AGENTS["SAC"].with_settings(**setting)), "place": place,
         "initial": [100.0], "costs": [[100.0 + abs(i - 2)]]}
        for i, setting in enumerate(SETTINGS["SAC"]) for place in PARTS["tune"].places
    ]  # fmt: skip
    assert str(tuned(pd.DataFrame(tuning), "SAC")) == "SAC[gradient=0.5,width=128]"
    with pytest.raises(NotTuned, match="the part 'tune' comes first"):
        tuned(pd.DataFrame(tuning[1:]), "SAC")


def test_the_published_settings_are_those_of_the_published_tuning():
    table = SAC_AND_TD3.table()
    for part in PARTS:
        assert {*PARTS[part].settings(table)} == {*table[table.part == part].arm}


def test_one_agent_for_all_is_judged_in_layouts_that_it_never_saw():
    assert {*trained_in(EVERY)} == {*TUNE}
    assert {*judged_in(EVERY)} == {*TUNE, *JUDGE}
    assert {*judged_in("J001")} == {*trained_in("J001")} == {"J001"}

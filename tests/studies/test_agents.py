"""The answers on SAC and TD3, on tables that leave no doubt."""

import pandas as pd
import pytest

from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.studies.agents import AGENTS, CHECKPOINTS, PARTS, SAC_AND_TD3, SETTINGS, tuned
from nmpcrl.studies.agents_run import EVERY, judged_in, trained_in
from nmpcrl.study.drawn import JUDGE, TUNE
from nmpcrl.study.refusal import Refusal

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


def every_other(table):
    """The same runs, every second of which costs 1.3 times as much as theta_init at the end."""
    ends = [each[-1] if i % 2 else [130.0] for i, each in enumerate(table.costs)]
    costs = [[*each[:-1], end] for each, end in zip(table.costs, ends, strict=True)]
    return table.assign(costs=costs)


def test_without_runs_no_question_is_decided():
    found = SAC_AND_TD3.judge((pd.DataFrame(columns=COLUMNS), NOTHING))
    assert [*found] == [*SAC_AND_TD3.asked]
    assert {one.outcome for one in found.values()} == {UNDECIDABLE}


@pytest.mark.parametrize(
    ("table", "compared", "expected"),
    [
        (pd.concat([runs("judge", "SAC", 1.0, there="-"), runs("judge", "TD3", 0.9)]), suite(),
         {"SAC matches in 300 episodes": (REPRODUCED, 6, 6),
          "SAC solves in 300 episodes": (NOT, 0, 6),
          "TD3 solves in 300 episodes": (REPRODUCED, 6, 6),
          "SAC or TD3": (NOT, 0, 6),
          "SAC or the best search": (NOT, 0, 6),
          "TD3 or the best search": (REPRODUCED, 6, 6)}),
        (every_other(runs("judge", "SAC", 0.9)), NOTHING,
         {"SAC matches in 300 episodes": (PARTLY, 3, 6)}),
        (runs("one", "TD3", 0.9), suite(0.8, ["A"], "named 50"),
         {"TD3 matches in one layout": (REPRODUCED, 4, 4),
          "TD3 or the best search in one layout": (NOT, 0, 4),
          "SAC matches in one layout": (UNDECIDABLE, 0, 0)}),
        (runs("all", "SAC", 1.1, seen=0.9), suite(),
         {"SAC matches over the 60": (REPRODUCED, 60, 60),
          "SAC matches on the 120": (NOT, 0, 120),
          "SAC or the best search on the 120": (NOT, 0, 120)}),
    ],
)  # fmt: skip
def test_answers_follow_from_costs_and_arrivals(table, compared, expected):
    found = SAC_AND_TD3.judge((table, compared))
    said = {name: (found[name].outcome, *found[name].counts.values()) for name in expected}
    assert said == {name: (outcome, (yes, of)) for name, (outcome, yes, of) in expected.items()}


def test_an_agent_is_judged_with_the_setting_that_costs_least_and_not_before_it_is_known():
    tuning = [
        {"part": "tune", "arm": str(AGENTS["SAC"].with_settings(**setting)), "place": place,
         "initial": [100.0], "costs": [[100.0 + abs(i - 2)]]}
        for i, setting in enumerate(SETTINGS["SAC"]) for place in PARTS["tune"].places
    ]  # fmt: skip
    assert str(tuned(pd.DataFrame(tuning), "SAC")) == "SAC[gradient=0.5,width=128]"
    with pytest.raises(Refusal, match="the part 'tune' comes first"):
        tuned(pd.DataFrame(tuning[1:]), "SAC")


def test_the_published_settings_are_those_of_the_published_tuning():
    table = SAC_AND_TD3.table()
    for part in PARTS:
        assert {*PARTS[part].settings(table)} == {*table[table.part == part].arm}


def test_one_agent_for_all_is_judged_in_layouts_that_it_never_saw():
    assert {*trained_in(EVERY)} == {*TUNE}
    assert {*judged_in(EVERY)} == {*TUNE, *JUDGE}
    assert {*judged_in("J001")} == {*trained_in("J001")} == {"J001"}

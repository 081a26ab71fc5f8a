"""The runs of the comparison: in order, each once, and nothing is judged before it is tuned."""

import pytest

from nmpcrl.analysis import judgements
from nmpcrl.analysis.judgements import KEPT, stored
from nmpcrl.analysis.suite import Judgement
from nmpcrl.claims import remedy_runs
from nmpcrl.claims.remedy_questions import PARTS, SETTINGS, YARDSTICK
from nmpcrl.claims.remedy_runs import (
    NotTuned,
    chosen,
    judge_parts,
    planned,
    price,
    settings,
    tuning,
    wanted,
    whole,
    yardsticks,
)


@pytest.fixture(autouse=True)
def quick(tmp_path, monkeypatch, trains_here):
    """Nothing is trained: the second setting gains most, the search all there is."""
    asked = []

    def judge(one):
        asked.append(one)
        cost = {YARDSTICK: 3000.0}.get(one.budget, 3500.0)
        if one.entry == settings("ES")[1]:
            cost = 3200.0
        return Judgement(4000.0, cost, True, min(one.budget, 50), seconds=2.0)

    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path))
    monkeypatch.setattr(judgements, "judge_named", judge)
    monkeypatch.setattr(judgements, "_compile_ahead", lambda missing: None)
    return asked


def test_the_best_of_every_layout_is_searched_for_alike():
    wanted_ = yardsticks()
    assert {*wanted_} == {name for part in PARTS.values() for name in part.layouts}
    assert len({(one.entry, one.budget, one.seed) for one in wanted_.values()}) == 1


def test_every_setting_meets_the_same_layouts_and_seeds():
    by = {}
    for one in tuning("ES"):
        by.setdefault(one.entry, []).append((one.layout, one.seed, one.budget))
    assert [*by] == [*settings("ES")]
    first, *others = by.values()
    assert all(one == first for one in others)
    assert tuning("grid") == ()


def test_nothing_is_judged_before_it_is_tuned():
    with pytest.raises(NotTuned, match="--part best --part tune --entry ES"):
        wanted("judge 50", ["ES"])
    assert {one.entry for one in wanted("judge 50", ["grid", "frozen"])} == {"grid", "frozen"}
    assert {one.entry for one in planned("judge 50", ["ES"])} == {"ES"}


def test_the_best_setting_is_judged_and_the_whole_comes_as_a_table(quick):
    judge_parts(["judge 300", "tune", "best"], ["ES"], progress=False)
    assert [one.budget for one in quick[:141]] == [YARDSTICK] * 141
    assert chosen("ES") == settings("ES")[1]
    found = whole(["ES", "GES"])
    assert {*found.part} == {"tune", "judge 300"}
    assert {*found[found.part == "judge 300"]["name"]} == {"ES[alpha=3e-08]"}
    assert len(found) == 4 * 15 + 60
    assert {*found.k} == {0}
    assert {*found.best} == {3000.0}


def test_a_part_that_is_not_whole_is_left_out():
    judge_parts(["best", "tune"], ["ES"], progress=False)
    judgements.judge_all(wanted("judge 50", ["ES"])[:3], progress=False)
    assert {*whole(["ES"]).part} == {"tune"}


def test_without_the_best_of_a_layout_nothing_is_told(quick):
    judge_parts(["best", "tune"], ["ES"], progress=False)
    KEPT.path_of(next(iter(yardsticks().values()))).unlink()
    assert whole(["ES"]).empty
    with pytest.raises(NotTuned):
        chosen("ES")


def test_the_price_is_that_of_the_same_entry_with_any_setting():
    runs = tuning("ES")
    judgements.judge_all(runs[:2], progress=False)
    assert price(runs[2:4], stored(runs)) == 2 * 2.0
    assert price(runs[:1], {}) == pytest.approx(50 * remedy_runs.SECONDS)


def test_all_that_is_compared_is_planned_once():
    runs = [one for part in remedy_runs.ORDER for one in planned(part)]
    assert len({*runs}) == len(runs)
    assert {one.entry.partition("[")[0] for one in runs} == {*SETTINGS}

"""The comparison of remedies: made-up rows whose shares, advice and answers are known by hand."""

import cloudpickle
import numpy as np
import pandas as pd
import pytest

from nmpcrl.analysis import suite
from nmpcrl.analysis.suite import ENTRIES, Judgement
from nmpcrl.claims.investigation import Condition, rounded
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.report import editions
from nmpcrl.studies import remedies, worlds
from nmpcrl.studies.remedies import FIRST, LATER, NEVER, OPEN, PARTS, REMEDIES, SECOND, arms
from nmpcrl.study.drawn import TUNE
from nmpcrl.study.refusal import Refusal

RUN = {
    "part": "judge 50", "entry": "ES", "arm": "ES", "place": "J001", "k": 0, "initial": 4000.0,
    "best": 3000.0, "cost": 3500.0, "arrived": True, "episodes": 50, "over": False, "seconds": 1.0,
}  # fmt: skip
HALF = np.r_[np.zeros(10), np.full(10, 0.1)]
MIXED = np.tile([0.15, -0.1], 10)  # above 0, but not surely
WIDE = np.r_[np.full(6, 0.1), np.full(14, 1.0)]


def table(*some):
    return pd.DataFrame([RUN | one for one in some])


def block(entry, part="judge 50", gains=0.5, arm=None, layouts=20, **fields):
    """One run a layout, whose share of the possible gain is given, alike or layout by layout."""
    given = np.broadcast_to(gains, layouts)
    where = PARTS[part].places[:layouts]
    return [
        {"entry": entry, "arm": arm or entry, "part": part, "place": place,
         "cost": 4000 - 1000 * share} | fields
        for place, share in zip(where, given, strict=True)
    ]  # fmt: skip


def tune(entry, *gains, **fields):
    """The tuning of an entry, by setting."""
    settings = zip(arms(entry), gains, strict=False)
    return [one for arm, gain in settings for one in block(entry, "tune", gain, arm, 15, **fields)]


@pytest.mark.parametrize(
    ("runs", "share", "well"),
    [
        ([{}, {"k": 1, "cost": 3100.0, "episodes": 49}], [0.7], [True]),  # seeds are averaged first
        ([{}, {"k": 1, "cost": np.inf}], [-np.inf], [False]),  # a failed solve is infinitely bad
        ([{"cost": 2900.0}], [1.1], [True]),  # the search for J_best is no bound
        ([{}, {"place": "J002", "best": 3981.0}], [0.5], [True, True]),  # hardly any is possible
        ([{}, {"place": "J002", "best": 3979.0}], [0.5, 500 / 21], [True, True]),
        ([{"cost": 4000.0}], [0.0], [True]),
        ([{"cost": 4000.1}], [-1e-4], [False]),  # it costs more than before
        ([{}, {"k": 1, "arrived": False}], [0.5], [False]),  # under every seed
    ],
)
def test_what_is_gained_and_what_is_solved(runs, share, well):
    found = table(*runs)
    assert remedies.shares(found).tolist() == pytest.approx(share)
    assert remedies.solved(found).tolist() == well
    (one,) = remedies.rows(found)
    assert (one.layouts, one.left_out, one.rollouts) == (len(well), len(well) - len(share), 50)


def test_the_best_setting_has_the_greatest_gain_and_is_the_first_of_equal_ones():
    assert remedies.best_setting(table(*tune("ES", 0.2, -np.inf, 0.4, 0.4))) == "ES[alpha=3e-07]"
    assert remedies.best_setting(table(*tune("ES", -np.inf))) == "ES"


@pytest.mark.parametrize(
    ("blocks", "expected"),
    [
        ([block("ES", over=True), block("ES", "judge 300")], []),  # beyond its budget
        ([block("frozen", gains=0.9)], []),
        # the greatest lower end, and not the greatest value
        ([block("CMA-ES", gains=WIDE),
          block("SPSA", gains=0.8), block("ES", gains=0.3)],
         [("SPSA", FIRST), ("CMA-ES", SECOND), ("ES", LATER)]),
        # ties at 50 episodes go by the lower end at 300, and then by time
        ([block("SPSA", gains=0.801), block("CMA-ES", gains=0.799),
          block("ES", gains=0.8, seconds=9), block("SPSA", "judge 300", 0.5),
          block("CMA-ES", "judge 300", 0.9), block("ES", "judge 300", 0.5)],
         [("CMA-ES", FIRST), ("SPSA", SECOND), ("ES", LATER)]),
        # never: below 0 at every budget; open: not above 0 at one
        ([block("DPG", gains=-0.5), block("DPG", "judge 300", -0.2), block("ES", gains=-0.5),
          block("ES", "judge 300", 0.2)], [("ES", OPEN), ("DPG", NEVER)]),
        # the interval counts, and not the value
        ([block("ES", gains=np.tile([-0.5, 1.0], 10)), block("grid", gains=0.0),
          block("GES", gains=0.01)], [("GES", FIRST), ("grid", OPEN), ("ES", OPEN)]),
        # fewer than half of the layouts solved
        ([block("CMA-ES", gains=0.9, arrived=False), block("SPSA", gains=0.1)],
         [("SPSA", FIRST), ("CMA-ES", NEVER)]),
    ],
)  # fmt: skip
def test_advice_follows_its_rule(blocks, expected):
    found = remedies.advice(table(*(one for some in blocks for one in some)))
    assert [*dict(zip(found.entry, found.word, strict=True)).items()] == expected


def test_the_tuning_is_part_of_the_price_and_rows_come_by_budget():
    runs = (*tune("ES", 0.1, 0.2), *block("ES", "judge 300"), *block("ES"))
    found = remedies.advice(table(*runs))
    assert [*found.part] == [*remedies.ADVISED]
    assert {*found.tuning} == {2 * 15 * 50}


def test_without_runs_no_question_is_decided():
    found = REMEDIES.answers(table(*block("frozen")))
    assert {one.outcome for one in found.values()} == {UNDECIDABLE}


LOST = block("grid", "judge 300", 0.1, layouts=10, arrived=False)
WON = block("grid", "judge 300", 0.9)[10:]
FAILING, GUARDED = (
    tune(one, 0.5, 0.5, 0.5) + block(one, "tune", arm=[*arms(one)][3], layouts=15, arrived=False)
    for one in ("RDES", "guarded-RDES")
)
HALFWAY = block("ES", "judge 300")[:15]


@pytest.mark.parametrize(
    ("name", "runs", "outcome", "count"),
    [
        ("search and learning", block("CMA-ES", "judge 300", 0.95) + HALFWAY, REPRODUCED, (15, 15)),
        ("search nears the best", block("CMA-ES", "judge 300", 0.95), REPRODUCED, (20, 20)),
        ("search nears the best", block("CMA-ES", "judge 300", 0.89), NOT, (0, 20)),
        ("undone steps on the loop's cost gain", block("undone-GN-J", gains=HALF), PARTLY,
         (10, 20)),
        ("undone steps on the TD error gain", block("undone-LSTD-Q", gains=0.1), REPRODUCED,
         (20, 20)),
        ("one number by hand", LOST + WON + block("GES", "judge 300"), REPRODUCED, (10, 10)),
        ("guard", FAILING + tune("guarded-RDES", *[0.5] * 4), REPRODUCED, (15, 15)),
        ("guard", FAILING + GUARDED, NOT, (0, 15)),
        ("faster auxiliary weights", block("GES") + block("GES-3", gains=0.6), REPRODUCED, None),
        ("lengths or directions", block("guarded-RDES") + block("control-RDES", gains=0.6), NOT,
         None),
        ("averaging", block("ES", gains=-np.inf) + block("averaged-ES", gains=-np.inf), PARTLY,
         None),
        ("undo", block("ES") + block("undone-ES", gains=0.5 + MIXED), PARTLY, None),
    ],
)  # fmt: skip
def test_questions_are_answered_by_their_rule(name, runs, outcome, count):
    one = REMEDIES.answers(table(*runs))[name]
    assert (one.outcome, one.counts) == (outcome, {"layouts": count} if count else {})
    assert (one.words == "no difference shown") == (outcome == PARTLY and not count)


def test_every_entry_is_compared_and_begins_its_tuning_with_its_default():
    assert [*remedies.SETTINGS] == [*ENTRIES]
    for entry, settings in remedies.SETTINGS.items():
        assert bool(settings) == bool(ENTRIES[entry].defaults)
        assert next(iter(arms(entry))) == entry
        assert len(arms(entry)) == max(len(settings), 1)


@pytest.fixture
def judged(tmp_path, monkeypatch, trains_here):
    """Nothing is trained: of ES the second setting gains most."""
    asked = []

    def judge(entry, place, seed, episodes):
        asked.append((str(entry), place, seed, episodes))
        cost = 3000.0 if episodes == remedies.YARDSTICK else 3200.0 if entry.changed else 3500.0
        return Judgement(4000.0, cost, True, min(episodes, 50), seconds=2.0)

    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "published"))
    monkeypatch.setattr(remedies, "judge", judge)
    monkeypatch.setattr(remedies, "SETTINGS", {"grid": (), "ES": ({}, {"alpha": 3e-8})})
    return asked


def test_rows_are_made_in_order_and_the_best_setting_is_judged(judged):
    with pytest.raises(Refusal, match=r"J_best of T01 .* 'best' comes first"):
        REMEDIES.complete(["tune"], workers=1)
    REMEDIES.complete(["best"], workers=1)
    search = ("CMA-ES", 9_000_000, remedies.YARDSTICK)
    assert {(one[0], *one[2:]) for one in judged[-141:]} == {search}
    with pytest.raises(Refusal, match="ES is not tuned yet: the part 'tune' comes first"):
        REMEDIES.conditions("judge 50")
    REMEDIES.complete(["tune", "judge 300"], workers=1)
    made = REMEDIES.made()
    assert {*made[made.part == "judge 300"].arm} == {"grid", "ES[alpha=3e-08]"}
    assert {*made.best} == {3000.0}
    assert {*made[made.part == "tune"].seconds} == {2.0}  # of the entry, not of its judge
    by_arm = [[one[1:] for one in judged if one[0] == arm and one[1] in TUNE] for arm in arms("ES")]
    assert by_arm[0] == by_arm[1]  # all settings meet the same layouts and seeds
    REMEDIES.publish()
    assert len(REMEDIES.table()) == len(made) == 141 + 2 * 15 + 2 * 60


def test_published_arms_are_those_of_the_published_tuning_and_can_be_sent_to_a_worker():
    known = REMEDIES.table()
    for part in [*PARTS][1:]:
        if len({*map(REMEDIES.is_current, ("best", "tune", part))}) > 1:
            continue  # tuned anew, and not yet judged anew
        settings = PARTS[part].settings(known)
        conditions = {
            Condition(part, arm, *at): setting
            for arm, setting in settings.items()
            for at in PARTS[part].order(arm)
        }
        there = known[known.part == part]
        assert {*conditions} == {*there[["part", "arm", "place", "k"]].itertuples(False, None)}
    cloudpickle.dumps((REMEDIES, next(iter(conditions.items()))))


def test_worlds_begin_anew_with_the_entry_to_try_first():
    """By the advice of the first edition, of which the registered arm has its name."""
    said = {one.name for one in editions.first() if one.outcome == f"try {FIRST}"}
    assert said == {f"advice on {suite.entry(worlds.REMEDY).name}"}
    if not any(map(REMEDIES.is_current, PARTS)):
        assert next(remedies.advice(REMEDIES.table()).itertuples()).name == worlds.REMEDY


@pytest.mark.weekly
def test_a_search_for_the_best_cost_made_again_ends_at_the_published_one():
    known = REMEDIES.table()
    if not REMEDIES.is_current("best"):
        pytest.skip("the published searches are of earlier epochs")
    one, setting = next((one, it) for one, it in REMEDIES.conditions("best").items()
                        if one.place == "J003")  # fmt: skip
    made = REMEDIES.make(one, setting)
    assert {rounded(made["cost"], REMEDIES.digits)} == {*known[known.place == "J003"].best}

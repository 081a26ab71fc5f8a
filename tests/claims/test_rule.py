"""The rule by which answers become a verdict, against its definition in words."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.analysis.statistics import rate
from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.claims.rule import CELL, Answers, arms, counted, drawn_anew, read, settle
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE

CLAIM = CLAIMS["C1"]
counts = st.integers(0, 40)


def answers(decay: str = "step", **by_layout: list) -> pd.Series:
    """Answers in the cells of some layouts, seeds counted up."""
    cells = {
        (layout, decay, seed): value
        for layout, values in by_layout.items()
        for seed, value in enumerate(values)
    }
    index = pd.MultiIndex.from_tuples(cells, names=CELL)
    return pd.Series(list(cells.values()), index, dtype="boolean")


@pytest.mark.parametrize(
    ("yes", "of", "outcome"),
    [
        (108, 120, REPRODUCED),  # exactly 0.9
        (107, 120, PARTLY),
        (13, 120, PARTLY),
        (12, 120, NOT),  # exactly 0.1
        (4, 4, REPRODUCED),
        (3, 3, UNDECIDABLE),
        (0, 0, UNDECIDABLE),
    ],
)
def test_nearly_all_reproduce_nearly_none_refute_and_few_decide_nothing(yes, of, outcome):
    assert read(yes, of) == outcome


@given(yes=counts, no=counts)
def test_the_opposite_claim_has_the_opposite_outcome_and_fewer_than_four_decide_nothing(yes, no):
    outcome, opposite = read(yes, yes + no), {REPRODUCED: NOT, NOT: REPRODUCED}
    assert read(no, yes + no) == opposite.get(outcome, outcome)
    assert (outcome == UNDECIDABLE) == (yes + no < 4)
    if outcome == REPRODUCED:
        assert rate(yes, yes + no).low > 0.5


@given(yes=counts, no=counts, missing=st.integers(0, 10))
def test_outcome_and_interval_hold_whatever_the_missing_answers_are(yes, no, missing):
    asked, found = yes + no + missing, Answers(yes, no, missing)
    possible = {read(yes + k, asked) for k in range(missing + 1)}
    assert found.outcome == (possible.pop() if len(possible) == 1 else UNDECIDABLE)
    assert (found.share is None) == (yes + no == 0)
    if found.share:
        assert found.share.value == yes / (yes + no)
        for one in (rate(yes + k, asked) for k in range(missing + 1)):
            assert found.share.low <= one.low <= one.high <= found.share.high


@given(st.lists(st.tuples(st.sampled_from("BAC"), st.sampled_from([True, False, pd.NA]))))
def test_answers_are_counted_by_level_in_order_of_appearance(drawn):
    names = [name for name, _ in drawn]
    given_ = pd.Series([one for _, one in drawn], pd.Index(names, name="layout"), dtype="boolean")
    found = counted(given_, "layout")
    assert list(found) == list(dict.fromkeys(names))
    for name, one in found.items():
        mine = [value for other, value in drawn if other == name]
        yes, no = (sum(value is kind for value in mine) for kind in (True, False))
        assert one == Answers(yes, no, len(mine) - yes - no)


def test_a_verdict_is_given_overall_and_in_each_layout_and_reading_if_there_are_any():
    asked = pd.concat([answers(A=[True] * 10, B=[False] * 10), answers("episode", A=[True] * 10)])
    verdict = settle(CLAIM, asked)
    assert verdict.outcome == PARTLY
    assert verdict.by_layout == {"A": REPRODUCED, "B": NOT}
    assert verdict.by_decay == {"step": PARTLY, "episode": REPRODUCED}
    by_layout, by_decay = {"A": (20, 20), "B": (0, 10)}, {"step": (10, 20), "episode": (10, 10)}
    assert verdict.counts == {"all": (20, 30)} | by_layout | by_decay
    assert verdict.share == 20 / 30
    assert verdict.interval == (rate(20, 30).low, rate(20, 30).high)
    assert verdict.levels == {"layout": 2, "decay": 2, "seed": 10}
    index = pd.MultiIndex.from_product([("end",), (0.5, 1.0), range(6)])
    asked = pd.Series(True, index.set_names(["learner", "ratio", "seed"]), dtype="boolean")
    verdict = settle(CLAIM, asked, unit="runs")
    assert (verdict.outcome, verdict.unit) == (REPRODUCED, "runs")
    assert verdict.by_layout == verdict.by_decay == {}
    assert verdict.counts == {"all": (12, 12)}
    assert verdict.by_learner == {"end": (12, 12)}
    assert verdict.levels == {"ratio": 2, "seed": 6}


@pytest.mark.parametrize(
    ("asked", "outcome", "missing"),
    [
        (answers(A=[True] * 10 + [pd.NA] * 10), UNDECIDABLE, 10),
        (answers(A=[True] * 50 + [pd.NA]), REPRODUCED, 1),
        (answers(A=[pd.NA] * 9), UNDECIDABLE, 9),
        (answers(A=[True])[:0], UNDECIDABLE, 0),
    ],
)
def test_missing_answers_are_counted_and_decide_where_they_could(asked, outcome, missing):
    verdict = settle(CLAIM, asked)
    assert (verdict.outcome, verdict.missing) == (outcome, missing)
    assert verdict.counts["all"][1] == len(asked) - missing
    assert (verdict.share is None) == (verdict.interval is None) == (missing == len(asked))


@pytest.mark.parametrize(
    ("strict", "weaker", "outcome"),
    [
        ([True] * 9, [True] * 9, REPRODUCED),
        ([False] * 9, [True] * 4 + [False] * 5, PARTLY),
        ([False] * 9, [False] * 9, NOT),
        ([True] * 4 + [False] * 5, [True] * 9, PARTLY),
        ([False] * 9, [pd.NA] * 9, UNDECIDABLE),
    ],
)
def test_a_weaker_question_that_is_not_refuted_saves_part_of_the_claim(strict, weaker, outcome):
    verdict = settle(CLAIM, answers(A=strict), weaker=answers(A=weaker))
    assert verdict.outcome == verdict.by_layout["A"] == outcome
    assert verdict.counts["all"] == (sum(strict), 9)


def runs(*named: tuple[str, str, int], episodes: int = 300) -> pd.DataFrame:
    rows = pd.DataFrame(named, columns=["learner", "layout", "seed"])
    numbers = {"stopped": "finished", "final_cost": 9.0, "number": np.arange(len(named))}
    return rows.assign(decay="step", episodes=episodes, **numbers)


def test_arms_have_the_same_order_and_gaps_for_missing_short_and_stopped_runs():
    table = runs(("ES", "A", 0), ("GES", "B", 1), ("GES", "A", 0), ("ES", "A", 2))
    table.loc[0, "stopped"] = "diverged"
    es, ges = arms(pd.concat([table, runs(("GES", "A", 2), episodes=299)]), "ES", "GES")
    assert es.index.equals(ges.index)
    assert es.index.tolist() == [("A", "step", 0), ("B", "step", 1), ("A", "step", 2)]
    np.testing.assert_array_equal(es.number, [0, np.nan, 3])
    np.testing.assert_array_equal(ges.number, [2, 1, np.nan])
    np.testing.assert_array_equal(es.final_cost, [np.inf, np.nan, 9.0])
    assert [len(arm) for arm in arms(table, "ES", "GES", among=("GES",))] == [2, 2]
    with pytest.raises(ValueError, match="ES has several runs in layout A, decay step, seed 0"):
        arms(runs(("ES", "A", 0), ("ES", "A", 0)), "ES")


@pytest.mark.parametrize(
    ("values", "low", "high"),
    [
        ([0.65, 0, 0, 0, 0.65, 0], 0.0, 0.43),  # C1's shares: other seeds would give [0.15, 0.30]
        ([0.0] * 6, 0.0, 0.39),  # Wilson's of none of six layouts: a bootstrap has no width
        ([1.0] * 6, 0.61, 1.0),
        ([0.5] * 4, np.nan, np.nan),  # too few layouts
    ],
)
def test_the_interval_for_layouts_drawn_anew_counts_layouts(values, low, high):
    found = drawn_anew(values)
    assert found.value == pytest.approx(np.mean(values))
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.01, nan_ok=True)

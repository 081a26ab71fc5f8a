"""The rule by which answers become a verdict, against what it says in words."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.analysis.statistics import rate
from nmpcrl.claims.rule import (
    CELL,
    MAJORITY,
    NEARLY_ALL,
    NEARLY_NONE,
    Answers,
    Claim,
    arms,
    drawn_anew,
    median,
    read,
    settle,
    shown,
)
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE


class Open(Claim):
    """A claim that nothing decides."""

    def judge(self, observed):
        return self.verdict(UNDECIDABLE, "Nothing is known.")


CLAIM = Open(
    name="X1",
    statement="It is so.",
    question="Is it?",
    measured="a measure",
    border="a threshold",
    would_change="Elsewhere.",
)

counts = st.integers(0, 40)


def answers(**by_layout: list) -> pd.Series:
    """Answers in the cells of some layouts, seeds counted up, one reading of the decay."""
    cells = {
        (layout, "step", seed): value
        for layout, values in by_layout.items()
        for seed, value in enumerate(values)
    }
    index = pd.MultiIndex.from_tuples(cells, names=CELL)
    return pd.Series(list(cells.values()), index, dtype="boolean")


# The rule


@pytest.mark.parametrize(
    ("yes", "of", "outcome"),
    [
        (120, 120, REPRODUCED),
        (108, 120, REPRODUCED),  # exactly 0.9
        (107, 120, PARTLY),
        (60, 120, PARTLY),
        (13, 120, PARTLY),
        (12, 120, NOT),  # exactly 0.1
        (0, 120, NOT),
        (4, 4, REPRODUCED),
        (3, 4, PARTLY),
        (0, 4, NOT),
        (3, 3, UNDECIDABLE),
        (0, 3, UNDECIDABLE),
        (0, 0, UNDECIDABLE),
    ],
)
def test_nearly_all_reproduce_nearly_none_refute_and_few_decide_nothing(yes, of, outcome):
    assert read(yes, of) == outcome


@given(yes=counts, no=counts)
def test_a_verdict_is_what_its_share_and_interval_say(yes, no):
    outcome = read(yes, yes + no)
    if yes + no < 4:
        assert outcome == UNDECIDABLE
        return
    share = rate(yes, yes + no)
    assert (outcome == REPRODUCED) == (share.low > MAJORITY and share.value >= NEARLY_ALL)
    assert (outcome == NOT) == (share.high < MAJORITY and share.value <= NEARLY_NONE)
    assert outcome != UNDECIDABLE


@given(yes=counts, no=counts)
def test_a_claim_and_its_opposite_are_judged_alike(yes, no):
    opposite = {REPRODUCED: NOT, NOT: REPRODUCED}
    outcome = read(yes, yes + no)
    assert read(no, yes + no) == opposite.get(outcome, outcome)


@given(yes=counts, no=counts, missing=st.integers(0, 10))
def test_a_verdict_stands_only_if_nothing_that_is_missing_could_change_it(yes, no, missing):
    whole = {read(yes + k, yes + no + missing) for k in range(missing + 1)}
    outcome = Answers(yes, no, missing).outcome
    assert outcome in (*whole, UNDECIDABLE)
    assert outcome == UNDECIDABLE or len(whole) == 1


@given(yes=counts, no=counts, missing=st.integers(0, 10))
def test_the_interval_covers_whatever_the_missing_may_say(yes, no, missing):
    share = Answers(yes, no, missing).share
    if yes + no == 0:
        assert share is None
        return
    assert share.value == yes / (yes + no)
    for k in range(missing + 1):
        one = rate(yes + k, yes + no + missing)
        assert share.low <= one.low
        assert one.high <= share.high


# What a verdict says


def test_a_study_with_other_levels_than_ours_is_judged_as_a_whole():
    index = pd.MultiIndex.from_product([("end",), (0.5, 1.0), range(6)])
    asked = pd.Series(True, index.set_names(["learner", "ratio", "seed"]), dtype="boolean")
    verdict = settle(CLAIM, asked, "Numbers.", unit="runs")
    assert verdict.outcome == REPRODUCED
    assert verdict.by_layout == verdict.by_decay == {}
    assert verdict.counts == {"all": (12, 12)}
    assert verdict.evidence.endswith("runs: 100% [76%, 100%]. (2 ratios, 6 seeds.)")


def test_a_verdict_is_given_overall_in_each_layout_and_in_each_reading():
    asked = pd.concat(
        [answers(A=[True] * 10, B=[False] * 10), answers(A=[True] * 10).rename({"step": "episode"})]
    )
    verdict = settle(CLAIM, asked, "Numbers.")
    assert verdict.outcome == PARTLY
    assert verdict.by_layout == {"A": REPRODUCED, "B": NOT}
    assert verdict.by_decay == {"step": PARTLY, "episode": REPRODUCED}
    assert verdict.counts == {
        "all": (20, 30),
        "A": (20, 20),
        "B": (0, 10),
        "step": (10, 20),
        "episode": (10, 10),
    }
    assert verdict.share == 20 / 30
    assert verdict.interval == (rate(20, 30).low, rate(20, 30).high)
    assert verdict.evidence == (
        f"Numbers. It holds in 20 of 30 pairs: {rate(20, 30):.0%}. (2 layouts, 2 readings of the"
        " decay, 10 seeds.)"
    )


def test_what_is_missing_is_counted_in_words_and_decides_where_it_could():
    half = settle(CLAIM, answers(A=[True] * 10 + [pd.NA] * 10), "Numbers.")
    assert half.outcome == UNDECIDABLE
    assert half.counts["all"] == (10, 10)
    assert "10 of 10 pairs" in half.evidence
    assert "10 pairs are missing" in half.evidence
    assert settle(CLAIM, answers(A=[True] * 50 + [pd.NA]), "Numbers.").outcome == REPRODUCED


def test_no_answers_at_all_are_no_verdict():
    for none in (answers(A=[pd.NA] * 9), answers(A=[True])[:0]):
        verdict = settle(CLAIM, none, "Numbers.")
        assert (verdict.outcome, verdict.share, verdict.interval) == (UNDECIDABLE, None, None)
        assert "No pairs are there" in verdict.evidence


@pytest.mark.parametrize(
    ("strict", "weaker", "outcome"),
    [
        ([True] * 9, [True] * 9, REPRODUCED),
        ([False] * 9, [True] * 9, PARTLY),
        ([False] * 9, [True] * 4 + [False] * 5, PARTLY),
        ([False] * 9, [False] * 9, NOT),
        ([True] * 4 + [False] * 5, [True] * 9, PARTLY),
        ([False] * 9, [pd.NA] * 9, UNDECIDABLE),
    ],
)
def test_a_weaker_claim_that_is_not_refuted_saves_part_of_the_claim(strict, weaker, outcome):
    verdict = settle(CLAIM, answers(A=strict), "Numbers.", weaker=answers(A=weaker))
    assert verdict.outcome == verdict.by_layout["A"] == outcome
    assert verdict.counts["all"] == (sum(strict), 9)


# Arms


def runs(*named: tuple[str, str, int], episodes: int = 300) -> pd.DataFrame:
    return pd.DataFrame(
        [
            {"learner": learner, "layout": layout, "decay": "step", "seed": seed}
            for learner, layout, seed in named
        ]
    ).assign(episodes=episodes, stopped="finished", final_cost=9.0, number=np.arange(len(named)))


def test_arms_are_in_the_same_order_and_a_missing_run_leaves_a_gap():
    table = runs(("ES", "A", 0), ("GES", "B", 1), ("GES", "A", 0), ("ES", "A", 2))
    es, ges = arms(table, "ES", "GES")
    assert es.index.equals(ges.index)
    assert es.index.tolist() == [("A", "step", 0), ("B", "step", 1), ("A", "step", 2)]
    np.testing.assert_array_equal(es.number, [0, np.nan, 3])
    np.testing.assert_array_equal(ges.number, [2, 1, np.nan])


def test_a_run_shorter_than_the_paper_s_is_missing():
    table = pd.concat([runs(("ES", "A", 0)), runs(("GES", "A", 0), episodes=299)])
    es, ges = arms(table, "ES", "GES")
    assert es.number.notna().all()
    assert ges.number.isna().all()


def test_runs_of_several_settings_are_refused():
    table = runs(("ES", "A", 0), ("ES", "A", 0))
    with pytest.raises(ValueError, match="ES has several runs in layout A, decay step, seed 0"):
        arms(table, "ES")


# Numbers in sentences


def test_what_could_not_be_finished_is_shown_as_infinite_and_never_as_inf():
    assert [shown(v, ".1%") for v in (0.5, np.inf, -np.inf)] == ["50.0%", "∞", "-∞"]


def test_a_median_is_of_what_is_known():
    assert median([1.0, np.nan, 3.0, np.inf]) == 3
    assert np.isnan(median([np.nan]))


@pytest.mark.parametrize(
    ("values", "low", "high"),
    [
        ([0.65, 0, 0, 0, 0.65, 0], 0.0, 0.43),  # C1's shares: other seeds would give [0.15, 0.30]
        ([0.0] * 6, 0.0, 0.39),  # Wilson's of none of six layouts: a bootstrap would be sure
        ([1.0] * 6, 0.61, 1.0),
        ([0.5] * 4, np.nan, np.nan),  # too few layouts
    ],
)
def test_the_interval_for_layouts_drawn_anew_counts_layouts_and_no_runs(values, low, high):
    found = drawn_anew(values)
    assert found.value == pytest.approx(np.mean(values))
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.01, nan_ok=True)

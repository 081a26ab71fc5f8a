"""What a page counts of the whole study: the verdicts' own counts."""

import pandas as pd
import pytest

from nmpcrl.claims.by_runs import halves
from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.claims.thresholds import divergence, instability
from nmpcrl.report.whole_study import EVERY, main_table, went_wrong
from nmpcrl.study import design, paper

EACH = len(design.LAYOUTS) * len(design.SEEDS)  # runs of a learner in a reading of the decay


@pytest.fixture(scope="module")
def runs() -> pd.DataFrame:
    return main_table()


def test_the_main_table_is_the_plan_with_nothing_trained_here(runs):
    assert set(runs.source) == {"published"}
    assert set(runs.variant) == {design.MAIN_TABLE}
    assert (runs.groupby(["learner", "decay"]).size() == EACH).all()


def test_a_row_is_a_learner_in_a_reading_and_its_layouts_add_up():
    found = went_wrong(divergence, ("RDES", "ES"))
    assert list(found.index) == [
        (decay, name) for decay in ("step", "episode") for name in ("RDES", "ES")
    ]
    assert list(found) == [*paper.LAYOUTS, EVERY, "runs"]
    assert (found[[*paper.LAYOUTS]].sum(axis=1) == found[EVERY]).all()
    assert (found.runs == EACH).all()


@pytest.mark.parametrize(("claim", "wrong"), [("C1", divergence), ("C2", instability)])
def test_the_counts_are_those_of_the_verdict(runs, claim, wrong):
    asked = CLAIMS[claim]
    found = went_wrong(wrong, asked.learners)
    counted = halves(asked.learners, asked.measure(runs, {}), {"": asked.threshold})
    assert counted
    for one in counted:
        assert tuple(found[EVERY][one.decay][[*asked.learners]]) == one.counts


def test_a_run_that_went_wrong_is_counted_where_it_was_made(runs):
    first = runs.index[(runs.learner == "GES") & (runs.layout == "B")][0]
    found = went_wrong(lambda some: pd.Series(some.index == first, some.index), ("ES", "GES"))
    layouts = found[[*paper.LAYOUTS]]
    assert layouts.loc[(runs.decay[first], "GES"), "B"] == 1
    assert layouts.to_numpy().sum() == 1

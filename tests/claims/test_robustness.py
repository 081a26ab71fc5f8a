"""The map: which rows it has, what each is compared with, and which cells are shown."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from quiet_rows import quiet_row

from nmpcrl.analysis.rows import experiment_of
from nmpcrl.claims import paper_claims
from nmpcrl.claims.robustness import (
    WHOLE,
    departure,
    groups,
    not_run,
    robustness_map,
)
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED
from nmpcrl.study import Experiment, design
from nmpcrl.study.departures import DEPARTURES
from nmpcrl.study.experiment import PAPER, frozen_arm

LITERAL, CLIPPED = "literal", "no clipping"
PLACE = np.zeros((3, 3))


def summary(experiment: Experiment, variant: str, **unlike) -> dict:
    """The row of a run that saved a tenth and in which nothing went wrong."""
    return quiet_row(experiment, variant=variant, **{"final_cost": 900.0} | unlike)


def study(**unlike) -> pd.DataFrame:
    """The main table on two layouts, and two variants; `unlike` is so of the literal RDES."""
    main = design.main_table((*PAPER, "frozen"), ("A", "D"), tuple(range(5)))
    rows = [summary(one, design.MAIN_TABLE) for one in main]
    rows += [
        summary(one, LITERAL, **(unlike if one.learner == "RDES" else {}))
        for one in design.variant(LITERAL)
        if one.learner != "frozen"
    ]
    rows += [summary(one, CLIPPED) for one in design.variant(CLIPPED)]
    return pd.DataFrame(rows)


def paths(runs: pd.DataFrame) -> dict[Experiment, np.ndarray]:
    return {experiment_of(row): PLACE for row in runs.to_dict("records")}


@pytest.fixture(scope="module")
def costly():
    """The literal runs of RDES end at a higher cost than they began."""
    runs = study(final_cost=1200.0)
    return runs, robustness_map(runs, paths(runs))


def test_the_rows_are_the_whole_its_parts_and_the_variants_in_order(costly):
    _, found = costly
    parts = ["layout A", "layout D", "decay per step", "decay per episode"]
    assert found.variant.unique().tolist() == [WHOLE, *parts, LITERAL, CLIPPED]
    assert found.claim.unique().tolist() == ["C1", "C2", "C5", "C6", "C7", "C9"]
    assert not found.duplicated(["variant", "claim"]).any()


def test_a_variant_changes_the_cells_of_its_own_row_and_no_others(costly):
    _, found = costly
    changed = found[found.changes.astype(bool)]
    assert set(zip(changed.variant, changed.claim, strict=True)) == {
        (LITERAL, "C5"),
        (LITERAL, "C9"),
    }
    ends = changed.set_index("claim")
    assert (ends.base["C5"], ends.outcome["C5"]) == (REPRODUCED, NOT)
    assert (ends.base["C9"], ends.outcome["C9"]) == (REPRODUCED, PARTLY)  # GES still saves


def test_the_row_of_the_whole_repeats_the_verdicts(costly):
    runs, found = costly
    main = runs[runs.variant == design.MAIN_TABLE]
    whole = found[found.variant == WHOLE].set_index("claim")
    for verdict in paper_claims.judge_runs(main, paths(runs)):
        assert whole.outcome[verdict.claim] == verdict.outcome
        assert whole.share[verdict.claim] == verdict.share


def test_every_row_has_the_letter_of_its_departure():
    letters = [departure(name) for name in (WHOLE, "layout A", "decay per step", LITERAL)]
    assert letters == ["", "B", "C", "G"]
    assert {departure(name) for name in design.VARIANTS} <= {*DEPARTURES, ""}


def test_what_was_not_run_is_named(costly):
    runs, _ = costly
    assert set(not_run(runs)) == set(design.VARIANTS) - {LITERAL, CLIPPED}


def test_a_part_is_compared_with_the_rest_of_the_main_table(costly):
    runs, _ = costly
    here, base = groups(runs, "layout D")
    assert (set(here.layout), set(base.layout)) == ({"D"}, {"A"})
    assert set(here.variant) == set(base.variant) == {design.MAIN_TABLE}
    here, base = groups(runs, "decay per episode")
    assert (set(here.decay), set(base.decay)) == ({"episode"}, {"step"})


def test_a_variant_is_compared_with_its_own_cells_and_borrows_who_it_does_not_change(costly):
    runs, _ = costly
    here, base = groups(runs, LITERAL)
    assert set(base.variant) == {design.MAIN_TABLE}
    assert set(here.decay) == set(base.decay) == {"step"}
    origin = here.groupby("learner").variant.unique().map(list).to_dict()
    assert origin["DES"] == origin["RDES"] == [LITERAL]
    assert origin["ES"] == origin["GES"] == origin["frozen"] == [design.MAIN_TABLE]


def test_a_layout_is_one_observation_and_has_no_p(costly):
    _, found = costly
    layouts = found.variant.str.startswith("layout")
    assert found.p[layouts].isna().all()
    assert found.p[~layouts & (found.variant != WHOLE)].notna().all()


def test_runs_that_are_too_short_decide_nothing():
    short = [replace(one, episodes=4) for one in design.main_table(PAPER, ("A",), (0, 1))]
    short += [frozen_arm(one) for one in short]
    runs = pd.DataFrame([summary(one, design.MAIN_TABLE) for one in dict.fromkeys(short)])
    assert not robustness_map(runs, paths(runs)).changes.any()

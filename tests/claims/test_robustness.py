"""The map: its rows, the runs that each is compared with, and the cells that change a verdict."""

import numpy as np
import pandas as pd
import pytest
from builders import quiet_row

from nmpcrl.analysis.rows import experiment_of
from nmpcrl.analysis.statistics import paired_p
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.robustness import WHOLE, part_changes, readings_of_des, robustness_map
from nmpcrl.claims.rule import judge
from nmpcrl.claims.thresholds import divergence
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, Verdict
from nmpcrl.studies.main_study import gather
from nmpcrl.study import Experiment, design
from nmpcrl.study.experiment import PAPER

LITERAL, CLIPPED, HOT = "literal", "no clipping", "alpha x 3"
CLAIMS = ["C1", "C2", "C5", "C6", "C7", "C9"]


def rows(experiments, variant: str, **unlike) -> list[dict]:
    """Rows of runs that saved a tenth, quiet but for `unlike` of RDES."""
    quiet = {"final_cost": 900.0, "variant": variant}
    return [
        quiet_row(e, **quiet | (unlike if e.learner == "RDES" else {}))
        for e in experiments
        if e.learner != "frozen" or variant in (design.MAIN_TABLE, CLIPPED)
    ]


@pytest.fixture(scope="module")
def runs() -> pd.DataFrame:
    """The main table on two layouts, and variants: RDES is worse in one and diverges in another."""
    main = design.main_table((*PAPER, "frozen"), ("A", "D"), tuple(range(5)))
    controls = [Experiment("random", seed=seed) for seed in range(5)]
    return pd.DataFrame(
        rows(main, design.MAIN_TABLE)
        + rows(design.variant(LITERAL), LITERAL, final_cost=1200.0)
        + rows(design.variant(CLIPPED), CLIPPED)
        + rows([e for e in design.variant(HOT) if e.learner == "RDES"], HOT, cost_ratio=1.6)
        + rows(controls, "controls")
    )


@pytest.fixture(scope="module")
def paths(runs) -> dict[Experiment, np.ndarray]:
    return {experiment_of(row): np.zeros((3, 3)) for row in runs.to_dict("records")}


@pytest.fixture(scope="module")
def found(runs, paths) -> pd.DataFrame:
    return robustness_map(runs, paths)


def test_rows_are_the_main_table_its_parts_and_variants_which_change_their_own_cells(
    runs, paths, found
):
    parts = ["layout A", "layout D", "decay per step", "decay per episode"]
    assert found.variant.unique().tolist() == [WHOLE, *parts, LITERAL, CLIPPED, HOT]
    assert not found.duplicated(["variant", "claim"]).any()
    asked = found.groupby("variant", sort=False).claim.agg(list)
    assert asked[WHOLE] == asked["layout A"] == asked[CLIPPED] == CLAIMS
    assert asked[HOT] == ["C1", "C5", "C6", "C7", "C9"]  # C2 is not about RDES
    main = judge(BY_RUNS, runs[runs.variant == design.MAIN_TABLE], paths)
    known = found[found.variant == WHOLE].set_index("claim")
    assert [known.outcome[one.claim] for one in main] == [one.outcome for one in main]
    assert [known.share[one.claim] for one in main] == [one.share for one in main]
    changed = found[found.changes.astype(bool)].set_index(["variant", "claim"])
    assert changed.index.tolist() == [(LITERAL, "C5"), (LITERAL, "C9")]
    assert changed[["base", "outcome"]].to_numpy().tolist() == [
        [REPRODUCED, NOT],
        [REPRODUCED, PARTLY],  # GES still saves
    ]
    c5 = changed.loc[LITERAL, "C5"]
    assert (c5.share, c5.base_share, c5.pairs) == (0, 1, 10)
    assert c5.p == pytest.approx(2 / 184756)  # of 20 over 10 ways to deal ten yes, the two ends
    one = found.variant.str.startswith("layout") | (found.variant == WHOLE)  # one observation
    assert (found.p.isna() == one).all()


@pytest.mark.parametrize(("other", "changes"), [(PARTLY, False), (REPRODUCED, True)])
def test_a_part_changes_a_verdict_only_if_the_parts_differ(other, changes):
    layouts, counts = {"A": PARTLY, "B": other}, {"all": (19, 20), "A": (9, 10), "B": (10, 10)}
    verdict = Verdict("C1", "", REPRODUCED, by_layout=layouts, counts=counts)
    assert part_changes([verdict]).changes.tolist() == [False, changes, False]


def test_how_often_des_diverges_is_tested_on_its_own_and_not_by_the_p_of_the_claim():
    known = gather("published", variants=True)
    versions, runs = readings_of_des(known.runs, known.paths), known.runs
    assert list(versions.index) == ["lagged", "averaged", "greedy", "late"]
    found = versions.loc["averaged"]
    other, main = (
        divergence(one).set_axis(one.set_index(["layout", "decay", "seed"]).index).astype(bool)
        for one in (
            runs[(runs.variant == name) & (runs.learner == "DES")] for name in ("averaged", "main")
        )
    )
    main = main[other.index]
    assert (found.diverged, found.main) == ((other.sum(), 60), (main.sum(), 60))
    assert (found.gained, found.lost) == ((other & ~main).sum(), (main & ~other).sum())
    assert found.p_diverged == paired_p(found.gained, found.lost)

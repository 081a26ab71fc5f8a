"""On what the verdicts depend: one map of all that was varied, and its most telling cells.

A row of the map is a layout, a reading of the decay, or a variant of the plan; a column is a claim
that runs decide. A cell says what becomes of the claim there, and whether that differs from what it
is held against: for a layout or a reading the others, for a variant the same cells of the main
table. See `flips` for both.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from nmpcrl.claims.paper_claims import BY_RUNS, judge_runs
from nmpcrl.claims.rule import CELL, UNDECIDABLE, Paths, Verdict
from nmpcrl.study import design
from nmpcrl.study.design import MAIN_TABLE
from nmpcrl.study.experiment import PAPER

WHOLE = "main table"
PARTS = {"layout": "B", "decay": "C"}  # of the main table, with the departures they read


def atlas(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """The map: the main table as a whole, the rows of `spread` over it, and those of `flips`.

    Args:
        runs: of `summary.table`, with a column `variant`.
        paths: as `judge` takes them.

    Returns:
        The columns of `flips` after `departure`, a letter of `DEPARTURES` or "".
    """
    verdicts = judge_runs(runs[runs.variant == design.MAIN_TABLE], paths)
    whole = pd.DataFrame([_whole(verdict) for verdict in verdicts])
    found = pd.concat([whole, spread(verdicts), flips(runs, paths)], ignore_index=True)
    found.insert(0, "departure", found.variant.map(departure))
    return found


def left_out(runs: pd.DataFrame) -> tuple[str, ...]:
    """The variants of the plan that there is no run of."""
    return tuple(name for name in design.VARIANTS if name not in set(runs.variant))


def telling(atlas: pd.DataFrame, count: int = 3) -> pd.DataFrame:
    """The cells that flip and that chance explains least, of as many different claims and rows."""
    left = atlas[atlas.flips.astype(bool)].sort_values("p", kind="stable")
    chosen: list[int] = []
    while len(left) and len(chosen) < count:
        chosen.append(left.index[0])
        left = left[(left.claim != left.claim.iloc[0]) & (left.variant != left.variant.iloc[0])]
    return atlas.loc[chosen]


def groups(runs: pd.DataFrame, variant: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The runs behind a row of the map, and those that it is held against.

    Args:
        runs: as `atlas` takes them.
        variant: of the row.
    """
    main = runs[runs.variant == design.MAIN_TABLE]
    if variant not in design.VARIANTS:
        field, value = _part(variant)
        return main[main[field] == value], main[main[field] != value]
    changed = runs[runs.variant == variant]
    before = main.merge(changed[CELL].drop_duplicates(), on=CELL)
    kept = before[~before.learner.isin(changed.learner)]
    return pd.concat([changed, kept], ignore_index=True), before


def departure(variant: str) -> str:
    """The letter of what a row of the map reads otherwise, or "" where the paper is clear."""
    if variant in design.VARIANTS:
        return design.VARIANTS[variant].departure
    return "" if variant == WHOLE else PARTS[_part(variant)[0]]


def _whole(verdict: Verdict) -> dict[str, Any]:
    """The row of the whole main table, which flips nothing."""
    named = {"variant": WHOLE, "claim": verdict.claim, "outcome": verdict.outcome}
    share = np.nan if verdict.share is None else verdict.share
    pairs = verdict.counts["all"][1]
    return named | {"base": verdict.outcome, "flips": False, "share": share, "pairs": pairs}


def _part(variant: str) -> tuple[str, str]:
    """Field and value of a row of `spread`: "layout A", "decay per step"."""
    words = variant.split()
    return words[0], words[-1]


COLUMNS = ("variant", "claim", "outcome", "base", "flips", "share", "base_share", "pairs", "p")


def flips(runs: pd.DataFrame, paths: Paths, base: str = MAIN_TABLE) -> pd.DataFrame:
    """Every variant against the claims that runs decide, beside the same cells of the main table.

    A learner of the paper that a variant does not run is one that it does not change, so its runs
    of the main table stand in for it. A claim that none of the changed learners is asked about is
    left out, for there is nothing to flip, and so are the controls, which change none of them.

    Args:
        runs: of `summary.table`, with a column `variant`.
        paths: as `judge` takes them, of the variants and of the main table.
        base: the `variant` of the main table's rows.

    Returns:
        One row a variant and claim, in order, with the columns variant, claim, outcome, base (the
        outcome of the main table in the cells of the variant), flips (both are decided, and
        differ), share, base_share, pairs (how many answered) and p (the chance of shares so
        different if the variant changed nothing: Fisher's exact test, as if runs were independent).
    """
    paper = runs[runs.learner.isin(PAPER)]
    usual = paper[paper.variant == base]
    rows = []
    for name, changed in paper[paper.variant != base].groupby("variant", sort=False):
        before = usual.merge(changed[CELL].drop_duplicates(), on=CELL)
        kept = before[~before.learner.isin(changed.learner)]
        after = judge_runs(pd.concat([changed, kept], ignore_index=True), paths)
        for verdict, other in zip(after, judge_runs(before, paths), strict=True):
            if not changed.learner.isin(BY_RUNS[verdict.claim].learners).any():
                continue
            judged, held_against = (Cell(v.outcome, *v.counts["all"]) for v in (verdict, other))
            rows.append(_row(str(name), verdict.claim, judged, held_against))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def spread(verdicts: Iterable[Verdict]) -> pd.DataFrame:
    """Every layout and reading of the decay against the claims, with the columns of `flips`.

    `base` is the outcome over all of them, and `base_share` the share in the others.
    """
    rows = []
    for verdict in verdicts:
        named = {name: f"layout {name}" for name in verdict.by_layout}
        named |= {name: f"decay per {name}" for name in verdict.by_decay}
        outcomes = verdict.by_layout | verdict.by_decay
        for name, variant in named.items():
            yes, of = verdict.counts[name]
            all_yes, all_of = verdict.counts["all"]
            others = Cell(verdict.outcome, all_yes - yes, all_of - of)
            rows.append(_row(variant, verdict.claim, Cell(outcomes[name], yes, of), others))
    return pd.DataFrame(rows, columns=list(COLUMNS))


class Cell(NamedTuple):
    """An outcome and the answers that it rests on."""

    outcome: str
    yes: int
    of: int

    @property
    def share(self) -> float:
        """Share of yes; nan without answers."""
        return self.yes / self.of if self.of else np.nan


def _row(variant: str, claim: str, judged: Cell, base: Cell) -> dict[str, Any]:
    decided = UNDECIDABLE not in (judged.outcome, base.outcome)
    answers = [[cell.yes, cell.of - cell.yes] for cell in (judged, base)]
    return {
        "variant": variant,
        "claim": claim,
        "outcome": judged.outcome,
        "base": base.outcome,
        "flips": decided and judged.outcome != base.outcome,
        "share": judged.share,
        "base_share": base.share,
        "pairs": judged.of,
        "p": float(stats.fisher_exact(answers).pvalue) if judged.of and base.of else np.nan,
    }

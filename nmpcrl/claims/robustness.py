"""On what the verdicts depend: one map of all that was varied, and its most telling cells.

A row of the map is a layout, a reading of the decay, or a variant of the plan; a column is a claim
that runs decide. A cell says what becomes of the claim there, and whether that differs from what it
is held against: for a layout or a reading the others, for a variant the same cells of the main
table. See `flips` for both.
"""

from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.claims.flips import flips, spread
from nmpcrl.claims.paper_claims import Paths, judge_runs
from nmpcrl.claims.rule import CELL, Verdict
from nmpcrl.study import plan

WHOLE = "main table"
PARTS = {"layout": "B", "decay": "C"}  # of the main table, with the departures they read


def atlas(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """The map: the main table as a whole, the rows of `spread` over it, and those of `flips`.

    Args:
        runs: of `text.table`, with a column `variant`.
        paths: as `judge` takes them.

    Returns:
        The columns of `flips` after `departure`, a letter of `DEPARTURES` or "".
    """
    verdicts = judge_runs(runs[runs.variant == plan.MAIN_TABLE], paths)
    whole = pd.DataFrame([_whole(verdict) for verdict in verdicts])
    found = pd.concat([whole, spread(verdicts), flips(runs, paths)], ignore_index=True)
    found.insert(0, "departure", found.variant.map(departure))
    return found


def left_out(runs: pd.DataFrame) -> tuple[str, ...]:
    """The variants of the plan that there is no run of."""
    return tuple(name for name in plan.VARIANTS if name not in set(runs.variant))


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
    main = runs[runs.variant == plan.MAIN_TABLE]
    if variant not in plan.VARIANTS:
        field, value = _part(variant)
        return main[main[field] == value], main[main[field] != value]
    changed = runs[runs.variant == variant]
    before = main.merge(changed[CELL].drop_duplicates(), on=CELL)
    kept = before[~before.learner.isin(changed.learner)]
    return pd.concat([changed, kept], ignore_index=True), before


def departure(variant: str) -> str:
    """The letter of what a row of the map reads otherwise, or "" where the paper is clear."""
    if variant in plan.VARIANTS:
        return plan.VARIANTS[variant].departure
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

"""Robustness: each verdict when one choice that the paper leaves open is made differently.

This is a multiverse analysis (Steegen et al. 2016). A row of the map is a layout, a reading of the
decay, or a variant of the design; a column is a claim that runs decide. A cell has the outcome
there beside another: a layout or a reading is compared with the complete main table, a variant with
the main table in the same cells of layout, decay and seed.
"""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from scipy import stats

from nmpcrl.analysis.statistics import paired_p
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.rule import CELL, Observations, Paths, arms
from nmpcrl.claims.thresholds import divergence
from nmpcrl.claims.verdict import Outcome, Verdict, differ
from nmpcrl.study import design
from nmpcrl.study.design import MAIN_TABLE
from nmpcrl.study.experiment import PAPER
from nmpcrl.study.learners import DECAYS

Decision: TypeAlias = tuple[Outcome, tuple[int, int]]  # with yes and all answers

WHOLE = "main table"
PARTS = {"layout": "B", "decay": "C"}  # of the main table, with the departures they read
ROWS = {  # the field and value of each part, by the name of its row
    **{f"layout {name}": ("layout", name) for name in design.LAYOUTS},
    **{f"decay per {name}": ("decay", name) for name in DECAYS},
}
# `outcome` is compared with `base`; `changes` holds if both are decided and differ; `share` and
# `base_share` are of yes; `pairs` is the number of answers; `p` is the probability of shares so
# different without an effect (Fisher's exact test, as if runs were independent). A layout has no p:
# its runs hardly differ from seed to seed, so that it is one observation.
COLUMNS = ["variant", "claim", "outcome", "base", "changes", "share", "base_share", "pairs", "p"]


def robustness_map(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """The map: rows of the main table and its parts (`part_changes`), and of `variant_changes`.

    `runs` have a column `variant`. `COLUMNS` come after `departure`, its letter or "".
    """
    main = Observations(runs[runs.variant == MAIN_TABLE], paths)
    verdicts = [claim.settled(main) for claim in BY_RUNS.values()]
    rows = [part_changes(verdicts), variant_changes(runs, paths)]
    found = pd.concat(rows, ignore_index=True)
    found.insert(0, "departure", found.variant.map(departure))
    return found


def groups(runs: pd.DataFrame, variant: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The runs behind the row of a variant in the map, and the runs that it is compared with."""
    main, changed = (runs[runs.variant == name] for name in (MAIN_TABLE, variant))
    if changed.empty:
        field, value = ROWS[variant]
        return main[main[field] == value], main[main[field] != value]
    before = main.merge(changed[CELL].drop_duplicates(), on=CELL)
    unchanged = before[~before.learner.isin(changed.learner)]
    return pd.concat([changed, unchanged], ignore_index=True), before


def departure(variant: str) -> str:
    """The letter of the departure that a row of the map changes, or ""."""
    if variant in design.VARIANTS:
        return design.VARIANTS[variant].departure
    return "" if variant == WHOLE else PARTS[ROWS[variant][0]]


def variant_changes(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """`COLUMNS` of every claim in every variant, beside the same cells of the main table.

    A variant runs only the learners of the paper that it changes; the others' runs come from the
    main table. A claim that asks none of the changed learners has no row, nor have the controls.
    """
    runs, rows = runs[runs.learner.isin(PAPER)], []
    for name in runs.variant[runs.variant != MAIN_TABLE].unique():
        changed = {*runs.learner[runs.variant == name]}
        after, before = (Observations(one, paths) for one in groups(runs, name))
        for claim in BY_RUNS.values():
            if changed & {*claim.learners}:
                both = (claim.settled(one) for one in (after, before))
                rows.append(_row(name, claim.name, *((v.outcome, v.counts["all"]) for v in both)))
    return pd.DataFrame(rows, columns=COLUMNS)


def readings_of_des(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """How often DES diverges when its description (departure I) is read otherwise, and C1 then.

    Returns:
        By variant: changed (in words), diverged (runs of DES, and all), main (the same of the main
        table in the same cells), gained and lost (pairs of which only one diverged), p_diverged (of
        these, by `paired_p`), outcome and base (of C1 with each) and changes.
    """
    names = [name for name, one in design.VARIANTS.items() if one.departure == "I"]
    asked = runs[runs.variant.isin([MAIN_TABLE, *names])]
    judged = variant_changes(asked, paths).query("claim == 'C1'").set_index("variant")
    rows = {}
    for name in judged.index:
        here, base = (divergence(arms(group, "DES")[0]) for group in groups(asked, name))
        both = pd.DataFrame({"here": here, "base": base}).dropna().astype(bool)
        gained, lost = int((both.here & ~both.base).sum()), int((both.base & ~both.here).sum())
        rows[name] = {
            "changed": design.VARIANTS[name].changed,
            "diverged": (int(both.here.sum()), len(both)),
            "main": (int(both.base.sum()), len(both)),
            "gained": gained,
            "lost": lost,
            "p_diverged": paired_p(gained, lost),
            **judged.loc[name, ["outcome", "base", "changes"]],
        }
    return pd.DataFrame.from_dict(rows, orient="index")


def part_changes(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """`COLUMNS` of every claim in the main table, and in each layout and reading of the decay.

    `base` is the overall outcome, `base_share` the share in the other parts. A part changes a
    verdict only if the verdict depends on it: see `Verdict.depends_on`.
    """
    parts = [(one, "", WHOLE, "all", one.outcome) for one in verdicts]
    for one in verdicts:
        outcomes = {"layout": one.by_layout, "decay": one.by_decay}
        parts += [
            (one, field, row, value, outcomes[field][value])
            for row, (field, value) in ROWS.items()
            if value in outcomes[field]
        ]
    rows = []
    for one, field, variant, name, outcome in parts:
        (yes, of), (all_yes, all_of) = one.counts[name], one.counts["all"]
        rest = one.outcome, (all_yes - yes, all_of - of)
        row = _row(variant, one.claim, (outcome, (yes, of)), rest)
        row["changes"] = row["changes"] and one.depends_on(field)
        rows.append(row | ({"p": np.nan} if field == "layout" else {}))
    return pd.DataFrame(rows, columns=COLUMNS)


def _row(variant: str, claim: str, judged: Decision, base: Decision) -> dict[str, Any]:
    (outcome, (yes, of)), (other, (base_yes, base_of)) = judged, base
    answers = [[yes, of - yes], [base_yes, base_of - base_yes]]
    return {
        "variant": variant,
        "claim": claim,
        "outcome": outcome,
        "base": other,
        "changes": differ(outcome, other),
        "share": yes / of if of else np.nan,
        "base_share": base_yes / base_of if base_of else np.nan,
        "pairs": of,
        "p": float(stats.fisher_exact(answers).pvalue) if of and base_of else np.nan,
    }

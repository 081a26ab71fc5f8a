"""What the paper leaves open of the baseline DES, and whether claim C1 depends on it."""

import pandas as pd

from nmpcrl.claims.robustness import groups, variant_changes
from nmpcrl.claims.rule import Paths, arms
from nmpcrl.claims.thresholds import divergence
from nmpcrl.report.cited import Count
from nmpcrl.report.text import SURE, listed
from nmpcrl.study import design

CLAIM, LEARNER = "C1", "DES"
READINGS = tuple(name for name, one in design.VARIANTS.items() if one.departure == "I")


def baselines(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """Every reading of the baseline beside the main table's in the same cells, a row each.

    Args:
        runs: of `rows.table`, with a column `variant`.
        paths: as `judge` takes them.

    Returns:
        By variant, columns changed (in words), diverged (of the runs of DES that were made so) and
        main (of those of the main table), outcome and base (of C1 with each), changes and p, as
        `robustness.COLUMNS`; no row for what was not run.
    """
    made = [name for name in READINGS if name in set(runs.variant)]
    asked = runs[runs.variant.isin([design.MAIN_TABLE, *made])]
    found = variant_changes(asked, paths)
    rows = found[found.claim == CLAIM].set_index("variant")
    counts = {name: [_diverged(group) for group in groups(asked, name)] for name in made}
    return pd.DataFrame(
        {
            "changed": {name: design.VARIANTS[name].changed for name in made},
            "diverged": {name: both[0] for name, both in counts.items()},
            "main": {name: both[1] for name, both in counts.items()},
            **{name: rows[name].to_dict() for name in ("outcome", "base", "changes", "p")},
        }
    ).loc[made]


def _diverged(runs: pd.DataFrame) -> Count:
    (des,) = arms(runs, LEARNER)
    known = divergence(des).dropna()
    return Count(int(known.sum()), len(known))


def table(found: pd.DataFrame) -> str:
    """One row a reading, in Markdown."""
    lines = [
        "| DES read so | it diverged | as in the main table | C1 | p |",
        "|---|---|---|---|---|",
    ]
    for name, row in found.iterrows():
        cells = (f"`{name}`: {row.changed}", row.diverged, row.main, row.outcome, f"{row.p:.1g}")
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)


def conclusion(found: pd.DataFrame) -> str:
    """Whether C1 depends on how the baseline is read, in a sentence or two."""
    if found.empty:
        return "No other reading of the baseline was run."
    changed = found[found.changes.astype(bool)]
    by_chance = all(found.p >= SURE)
    if changed.empty:
        said = "C1 comes to the same with every reading of the baseline as in the main table."
    else:
        apart = [f"`{name}` ({row.outcome}, p = {row.p:.1g})" for name, row in changed.iterrows()]
        said = f"With {listed(apart)}, C1 comes to something else than in the main table."
    if by_chance:
        return f"{said} No reading changes how often DES diverges by more than chance explains."
    sure = [f"`{name}` (p = {row.p:.1g})" for name, row in found[found.p < SURE].iterrows()]
    return (
        f"{said} How often DES diverges changes by more than chance explains with {listed(sure)}."
    )

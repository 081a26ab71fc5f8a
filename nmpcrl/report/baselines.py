"""What the paper leaves open of the baseline DES, and whether claim C1 depends on it."""

import pandas as pd

from nmpcrl.analysis.statistics import paired_p
from nmpcrl.claims.robustness import groups, variant_changes
from nmpcrl.claims.rule import Paths, arms
from nmpcrl.claims.thresholds import divergence
from nmpcrl.report.cited import Count
from nmpcrl.report.prose import filled
from nmpcrl.report.text import listed, number
from nmpcrl.study import design

CLAIM, LEARNER = "C1", "DES"
READINGS = tuple(name for name, one in design.VARIANTS.items() if one.departure == "I")


def baselines(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """Every reading of the baseline beside the main table's in the same cells, a row each.

    Args:
        runs: of `rows.table`, with a column `variant`.
        paths: as `rule.Observations` takes them.

    Returns:
        By variant, columns changed (in words), diverged (of the runs of DES that were made so) and
        main (of those of the main table), gained and lost (pairs of which only one diverged) and
        p_diverged (of these, by `paired_p`), outcome and base (of C1 with each) and changes; no row
        for what was not run.
    """
    made = [name for name in READINGS if name in set(runs.variant)]
    asked = runs[runs.variant.isin([design.MAIN_TABLE, *made])]
    found = variant_changes(asked, paths)
    judged = found[found.claim == CLAIM].set_index("variant")
    rows = {}
    for name in made:
        here, base = (divergence(arms(group, LEARNER)[0]) for group in groups(asked, name))
        both = pd.DataFrame({"here": here, "base": base}).dropna().astype(bool)
        gained, lost = (both.here & ~both.base).sum(), (both.base & ~both.here).sum()
        rows[name] = {
            "changed": design.VARIANTS[name].changed,
            "diverged": Count(int(both.here.sum()), len(both)),
            "main": Count(int(both.base.sum()), len(both)),
            "gained": int(gained),
            "lost": int(lost),
            "p_diverged": paired_p(int(gained), int(lost)),
            **judged.loc[name, ["outcome", "base", "changes"]],
        }
    return pd.DataFrame.from_dict(rows, orient="index")


def table(found: pd.DataFrame) -> str:
    """One row a reading, in Markdown."""
    lines = [
        "| DES read so | it diverged | as in the main table | McNemar's p | C1 |",
        "|---|---|---|---|---|",
    ]
    for name, row in found.iterrows():
        p = f"{row.p_diverged:.1g}"
        cells = (f"`{name}`: {row.changed}", row.diverged, row.main, p, row.outcome)
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)


def conclusion(found: pd.DataFrame) -> str:
    """Whether DES diverges as often however it is read, and what C1 comes to, in Markdown."""
    if found.empty:
        return "No other reading of the baseline was run."
    least, changed = found.loc[found.p_diverged.idxmin()], found[found.changes.astype(bool)]
    return filled(
        """
        {count} readings were looked at. How often DES diverges changes most clearly with `{name}`:
        {diverged} runs diverged, against {main} of the main table in the same cells; {gained} pairs
        went one way and {lost} the other (McNemar's p = {p:.1g}; {corrected:.1g} when multiplied by
        the number of readings). The claim comes to another outcome with: {changed}.
        """,
        count=number(len(found)).capitalize(),
        name=str(least.name),
        diverged=str(least.diverged),
        main=str(least.main),
        gained=str(least.gained),
        lost=str(least.lost),
        p=least.p_diverged,
        corrected=min(1.0, len(found) * least.p_diverged),
        changed=listed(f"`{name}` ({row.outcome})" for name, row in changed.iterrows()),
    )

"""The drawn layouts as a page shows them: in short, claim by claim, the nearest to the paper."""

import re
from html import escape

import pandas as pd

from nmpcrl.claims.investigation import counted
from nmpcrl.claims.thresholds import BETTER, improves
from nmpcrl.report.cited import Count
from nmpcrl.report.prose import filled
from nmpcrl.report.tables import BADGES, html_table
from nmpcrl.report.text import listed
from nmpcrl.studies.difficulty import OPEN, PILOT
from nmpcrl.studies.population import CLAIMS, CLOSES_BEFORE, EXPECTED, PICTURE, Drawn, succeeds
from nmpcrl.studies.predictors import auc
from nmpcrl.study.design import LAYOUTS, MAIN_TABLE, VARIANTS
from nmpcrl.study.drawn import name_of
from nmpcrl.study.layouts import ARRIVED


def at_the_gap(found: Drawn) -> pd.DataFrame:
    """The end of each judged run of ES, and the first gap of its layout; no registered question.

    `closed` is known when training has ended: a split by it depends on the outcome.

    Returns:
        Columns improves (as `thresholds.improves`), away (from the target, at the end), closes
        (theta_c at which the gap does, `difficulty.OPEN` where there is none), gap (whether there
        is one) and closed (whether theta_c ended above the value at which it closes).
    """
    es = found.main[found.main.learner == "ES"].reset_index(drop=True)
    closes = found.layouts[PILOT][es.layout.map(name_of)].to_numpy()
    ends = {"improves": improves(es), "away": es.distance > ARRIVED, "closes": closes}
    gap = closes < OPEN
    return pd.DataFrame(ends | {"gap": gap, "closed": gap & (es.theta_8 > closes)})


def improve_by_gap(ends: pd.DataFrame) -> dict[str, tuple[int, int]]:
    """Runs of `at_the_gap` that improve, and all, where a gap ended open, and where closed."""
    ways = {"open": ends.gap & ~ends.closed, "closed": ends.closed}
    return {way: counted(ends.improves[there]) for way, there in ways.items()}


def in_short(found: Drawn) -> str:
    """Where ES fails in drawn layouts, by what is known before training, then by what is not."""
    es, ends = succeeds(found.main), at_the_gap(found)
    closes = found.layouts.loc[es.index, PILOT]
    early = closes < CLOSES_BEFORE
    fails = {
        name: Count(int((~es[some]).sum()), int(some.sum()))
        for name, some in {"fails_before": early, "fails_after": ~early}.items()
    }
    return filled(
        r"""
        **A run improves** if its policy ends, without noise, at a cost at least {better:.0%} below
        $\boldsymbol{\theta}_\text{init}$'s; a layout improves if more than half of its runs do. Of
        {layouts} drawn layouts ES improves {es}. Where it does not can be told in part before
        training: it does not improve {fails_before} layouts in which the first gap closes below
        $\theta_c = {before}$, and {fails_after} others (area under the ROC curve {auc:.2f}). Not
        asked beforehand, and known only after training: of the runs in layouts with a gap,
        {open} improve where it stayed open, and {closed} where $\theta_c$ passed the value that
        closes it. A robot that is stuck raises $\theta_c$, so this split is partly the outcome.
        """,
        origin="the published runs in drawn layouts",
        better=BETTER,
        layouts=str(len(es)),
        es=int(es.sum()),
        before=str(CLOSES_BEFORE),
        auc=float(auc(closes, es)),
        **fails,
        **{name: Count(*count) for name, count in improve_by_gap(ends).items()},
    )


def whole_or_nearest(tried: pd.DataFrame) -> str:
    """Where the paper's whole picture appears, or what comes nearest to it: a sentence in Markdown.

    Args:
        tried: of `population.Drawn.tried`.
    """
    appears = tried[tried.whole == len(PICTURE)]
    if len(appears):
        places = appears.groupby(["layout", "setting"], sort=False).decay.agg(list)
        cells = (_cell(layout, setting, found) for (layout, setting), found in places.items())
        return f"It appears in {listed(cells)}."
    one = tried.loc[0]
    shares = listed(f"{claim} {one[claim]:.0%}" for claim in PICTURE)
    nearest = _cell(one.layout, one.setting, [one.decay])
    return f"Nearest comes {nearest}, where yes are {shares}."


def _cell(layout: str, setting: str, decays: list[str]) -> str:
    centres = ", ".join(f"({at.replace(',', ', ')})" for at in layout.split())
    place = layout if layout in LAYOUTS else f"{name_of(layout)}, with obstacles at {centres},"
    changed = "" if setting == MAIN_TABLE else f" and {VARIANTS[setting].changed}"
    return f"layout {place} with the decay {listed(f'per {one}' for one in decays)}{changed}"


def label(claim: str) -> str:
    """A claim of `EXPECTED`, and in few words what it says."""
    short = CLAIMS[claim].short.replace("\n", " ")
    return claim if claim.endswith("improves") else f"{claim}: {short}"


def share_table(shares: pd.DataFrame) -> str:
    """One row a claim, in HTML.

    Args:
        shares: of `population.shares`.
    """
    header = ("Claim", "Holds in", "By the rule", "Expected")
    caption = "In how many of the drawn layouts each claim holds, with its interval of 95 %."
    return html_table(caption, header, (_cells(row) for _, row in shares.iterrows()), headed=True)


def _cells(row: pd.Series) -> tuple[str, ...]:
    expected = EXPECTED[row.claim]
    counted = f"{row.holding} of {row.layouts}<br>{row.share:.0%} [{row.low:.0%}, {row.high:.0%}]"
    if row.weaker != row.holding:
        counted += f"<br>weaker question: {row.weaker} of {row.layouts}"
    badge = f'<span class="{BADGES[row.outcome]}">{row.outcome}</span>'
    return (_claim(row.claim), counted, badge, f"{expected.low:.0%} to {expected.high:.0%}")


def _claim(name: str) -> str:
    """A claim's label as HTML, its formulas as those of a page, which are typeset there."""
    return re.sub(r"\$([^$]*)\$", r'<span class="math">\(\1\)</span>', escape(label(name)))

"""The drawn layouts as a page shows them: in short, claim by claim, the nearest to the paper."""

import re
from html import escape

import pandas as pd

from nmpcrl.claims.population import asked, at_the_gap, succeeds
from nmpcrl.claims.population_published import PopulationRuns
from nmpcrl.claims.population_questions import EXPECTED
from nmpcrl.claims.whole_picture import PICTURE
from nmpcrl.report.cited import Count
from nmpcrl.report.prose import filled
from nmpcrl.report.tables import BADGES, html_table
from nmpcrl.report.text import listed
from nmpcrl.study.design import LAYOUTS, MAIN_TABLE, VARIANTS
from nmpcrl.study.population_design import name_of


def in_short(found: PopulationRuns) -> str:
    """Whether A to F are exceptions, in two sentences of Markdown."""
    ends = at_the_gap(found.main, found.layouts)
    es = succeeds(found.main)
    counts = {
        name: Count(int(ends.improves[there].sum()), int(there.sum()))
        for name, there in {"open": ~ends.closed, "closed": ends.closed}.items()
    }
    return filled(
        r"""
        Of {layouts} drawn layouts ES improves {es}. Where $\theta_c$ stayed below the value that
        closes the first gap, {open} of its runs improved; where it passed it, {closed}.
        """,
        origin="the published runs in drawn layouts",
        layouts=str(len(es)),
        es=int(es.sum()),
        **counts,
    )


def whole_or_nearest(tried: pd.DataFrame) -> str:
    """Where the paper's whole picture appears, or what comes nearest to it: a sentence in Markdown.

    Args:
        tried: of `whole_picture.everywhere`, not empty.
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
    short = asked()[claim].short.replace("\n", " ")
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
    badge = f'<span class="{BADGES[row.outcome]}">{row.outcome}</span>'
    return (_claim(row.claim), counted, badge, f"{expected.low:.0%} to {expected.high:.0%}")


def _claim(name: str) -> str:
    """A claim's label as HTML, its formulas as those of a page, which are typeset there."""
    return re.sub(r"\$([^$]*)\$", r'<span class="math">\(\1\)</span>', escape(label(name)))

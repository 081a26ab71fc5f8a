"""What pages show of verdicts, assumptions and departures."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
from bs4 import BeautifulSoup

from nmpcrl.claims.verdict import (
    NOT,
    PARTLY,
    REPRODUCED,
    UNDECIDABLE,
    Verdict,
)
from nmpcrl.report import tables
from nmpcrl.report.text import departure_link


def verdict(outcome: str, **judged) -> Verdict:
    return Verdict("C1", "a < b & c.", outcome, "Elsewhere (departure G).", **judged)


def cells(table: str) -> list[list[str]]:
    """The words of a table, row by row, its header included."""
    rows = BeautifulSoup(re.sub("</?code>", "`", table), "html.parser").find_all("tr")
    return [[cell.get_text("|") for cell in row.find_all(["th", "td"])] for row in rows]


def test_a_verdict_shows_its_share_and_interval_where_it_has_one():
    shares = {"share": 0.75, "interval": (0.5, 0.875)}
    judged = cells(tables.verdict_table([verdict(PARTLY, **shares), verdict(NOT)], "All of it."))
    assert [row[1] for row in judged[1:]] == [f"{PARTLY}|75% [50%, 88%]", NOT]


def test_the_verdicts_of_other_runs_have_a_column_of_their_own():
    known, own = verdict(NOT), verdict(PARTLY, share=0.75, interval=(0.5, 0.875))
    header, row = cells(tables.verdict_table([known], "All of it.", [own]))
    assert header == ["The paper claims", "Published", "Runs of this page"]
    assert row[1:] == [NOT, f"{PARTLY}|75% [50%, 88%]"]


def test_a_timing_shows_each_ratio_with_its_interval_and_a_dash_for_no_number():
    numbers = dict.fromkeys(tables.TIMES, 1.2345) | {"ms_per_fit": np.nan}
    ratio = {"ratio": 0.6349, "ratio_low": 0.6251, "ratio_high": 0.641, "waited": 0.2}
    timings = pd.DataFrame([{"solver": "ipopt", "learner": "RDES", **numbers, **ratio}])
    shown = tables.timing_table(timings, "2 cores (Abacus 9)")
    assert "Times of a learning step on 2 cores (Abacus 9)." in shown
    assert '<th scope="row"' in shown  # stays in sight where the table scrolls
    header, row = cells(shown)
    assert dict(zip(header, row, strict=True)) == {
        "step of": "RDES with ipopt",
        **{words: f"{1.2345 * one:.3g}" for words, one in tables.TIMES.values()},
        "ms per fit": "–",
        "ratio": "0.63|[0.63, 0.64]",
    }


def test_a_claim_is_shown_in_each_layout_and_reading_in_colour_and_in_words():
    parts = {"by_layout": {"A": REPRODUCED, "B": NOT}, "by_decay": {"step": UNDECIDABLE}}
    table = tables.layout_table([verdict(PARTLY, **parts), verdict(NOT)], "All of it.")
    assert cells(table) == [
        ["Claim", "All", "A", "B", "per step"],
        ["C1", "partly", "yes", "no", "open"],  # and no row of what has no layouts
    ]
    for outcome in (PARTLY, *parts["by_layout"].values(), UNDECIDABLE):
        assert f'<span class="{tables.BADGES[outcome]}">{tables.WORDS[outcome]}</span>' in table
    assert '<th scope="row"' in table


def test_what_changes_a_verdict_is_named_by_departure_and_bold_where_it_is_sure():
    changed = pd.DataFrame(
        [("B", "layout E", "C1", 1e-9), ("B", "layout F", "C1", 0.5), ("", "N = 5", "C1", 0.01)],
        columns=["departure", "variant", "claim", "p"],
    )
    table = tables.dependence([verdict(PARTLY), replace(verdict(NOT), claim="C2")], changed)
    first, second = table.splitlines()[2:]
    by = f"{departure_link('B', 'B')}: **layout E** and layout F<br>no assumption of ours: N = 5"
    badge = '<span class="{}">{}</span>'
    assert first.endswith(f" | {badge.format(tables.BADGES[PARTLY], 'partly')} | {by} |")
    assert second.endswith(f" | {badge.format(tables.BADGES[NOT], 'no')} | nothing |")


def test_what_a_claim_says_cannot_break_the_page():
    assert "a &lt; b &amp; c." in tables.verdict_table([verdict(NOT)], "<caption>")
    assert "&lt;caption&gt;" in tables.verdict_table([], "<caption>")

"""What pages show of verdicts, assumptions and departures."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from bs4 import BeautifulSoup

from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import CLAIMS
from nmpcrl.claims.verdict import (
    NOT,
    PARTLY,
    REPRODUCED,
    UNDECIDABLE,
    Assumption,
    Verdict,
)
from nmpcrl.report import tables
from nmpcrl.report.text import departure_link
from nmpcrl.study.departures import DEPARTURES

OUTCOMES = (REPRODUCED, PARTLY, NOT, UNDECIDABLE)


def verdict(outcome: str, **judged) -> Verdict:
    return Verdict("C1", "a < b & c.", outcome, "Elsewhere (departure G).", **judged)


def cells(table: str) -> list[list[str]]:
    """The words of a table, row by row, its header included."""
    rows = BeautifulSoup(re.sub("</?code>", "`", table), "html.parser").find_all("tr")
    return [[cell.get_text("|") for cell in row.find_all(["th", "td"])] for row in rows]


@pytest.mark.parametrize("outcome", OUTCOMES)
def test_a_verdict_has_a_badge_of_its_own_and_says_it_in_words(outcome):
    table = tables.verdict_table([verdict(outcome)], "All of it.")
    assert f'<span class="{tables.BADGES[outcome]}">{outcome}</span>' in table
    assert len(set(tables.BADGES.values())) == len(tables.BADGES)


def test_a_guarantee_that_does_not_apply_has_not_the_badge_of_what_is_not_reproduced():
    words = CLAIMS["C8"].words[NOT]
    c8 = replace(verdict(NOT), claim="C8", said=words)
    badge = f'<span class="verdict-not-applicable">{words}</span>'
    assert badge in tables.verdict_table([c8], "All of it.")
    assert tables.BADGES[NOT] in tables.verdict_table([replace(c8, said="not confirmed")], "All.")


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


def test_a_claim_is_shown_with_all_that_was_fixed_beforehand():
    claims = [*CLAIMS.values(), *OWN_CLAIMS.values()]
    shown = cells(tables.claim_table(claims, "Fixed beforehand."))[1:]
    for claim, row in zip(claims, shown, strict=True):
        text = " ".join(row).lower()
        fixed = (claim.name, claim.statement, claim.question, claim.measured, claim.border)
        assert all(part.lower() in text for part in (*fixed, claim.test))


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


def test_a_layout_in_which_a_claim_was_not_asked_is_left_empty():
    first, second = (verdict(NOT, by_layout={name: NOT}) for name in "AB")
    table = cells(tables.layout_table([first, second], "All of it."))
    assert [row[2:] for row in table[1:]] == [["no", ""], ["", "no"]]


def test_what_changes_a_verdict_is_named_by_departure_and_bold_where_it_is_sure():
    changed = pd.DataFrame(
        [("B", "layout E", "C1", 1e-9), ("B", "layout F", "C1", 0.5), ("", "N = 5", "C1", 0.01)],
        columns=["departure", "variant", "claim", "p"],
    )
    table = tables.dependence([verdict(PARTLY), replace(verdict(NOT), claim="C2")], changed)
    first, second = table.splitlines()[2:]
    by = f"{departure_link('B', 'B')}: **layout E** and layout F<br>beside the departures: N = 5"
    badge = '<span class="{}">{}</span>'
    assert first.endswith(f" | {badge.format(tables.BADGES[PARTLY], 'partly')} | {by} |")
    assert second.endswith(f" | {badge.format(tables.BADGES[NOT], 'no')} | nothing |")


def test_what_a_claim_says_cannot_break_the_page():
    assert "a &lt; b &amp; c." in tables.verdict_table([verdict(NOT)], "<caption>")
    assert "&lt;caption&gt;" in tables.verdict_table([], "<caption>")


def test_an_assumption_says_in_words_whether_it_holds():
    table = tables.assumption_table(
        [Assumption("x", "y", holds=True), Assumption("x", "y", holds=False)], "Audit."
    )
    assert re.findall(r">(holds|does not hold)<", table) == ["holds", "does not hold"]


@pytest.mark.parametrize("letter", DEPARTURES)
def test_a_departure_shows_all_of_its_entry(letter):
    shown, entry = tables.departure(letter), DEPARTURES[letter]
    assert all(part in shown for part in (entry.gap, entry.reading, entry.why))
    assert ("To run another reading" in shown) == bool(entry.variant)


def test_a_variant_that_is_one_value_of_a_field_is_shown_as_it_is_set():
    shown = tables.departure("M")
    assert "Set `box = 'soft'` (here `'hard'`), as in `sweep(box='soft')`." in shown
    assert "as in `sweep(decay=...)`." in tables.departure("C")

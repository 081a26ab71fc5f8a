"""What a page says of remedies follows from the rows: order, evidence, price and words."""

from dataclasses import replace

import numpy as np
import pytest
from bs4 import BeautifulSoup

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.claims.population import Answer
from nmpcrl.claims.remedies import Advice, RemedyRow
from nmpcrl.claims.remedy_questions import (
    ADVICE,
    ADVISED,
    FIRST,
    LATER,
    NEVER,
    OPEN,
    REMEDY_QUESTIONS,
    SECOND,
)
from nmpcrl.claims.verdict import NOT, REPRODUCED
from nmpcrl.report import remedies
from nmpcrl.report.remedies import (
    COLOURS,
    advice_table,
    answer_items,
    in_short,
    part_table,
    rule,
)

SHORT, LONG = ADVISED


def row(entry, part=SHORT, gain=(0.8, 0.7, 0.9), name=None):
    return RemedyRow(
        part, entry, name or entry, Estimate(*gain), Estimate(0.9, 0.8, 0.95), 120, 2, 49, 0.54,
        disqualified=False,
    )  # fmt: skip


@pytest.fixture
def advised():
    """One entry a word; the third is not judged with 300 episodes, and the last mostly fails."""
    failed = (-np.inf, -np.inf, -0.2)
    return (
        Advice("CMA-ES", FIRST, {SHORT: row("CMA-ES", name="CMA-ES[spread=0.1]"),
                                 LONG: row("CMA-ES", LONG, (0.99, 0.98, 1.0))}, 3000),
        Advice("grid", SECOND, {SHORT: row("grid", gain=(0.7, 0.6, 0.8))}),
        Advice("control-RDES", LATER, {SHORT: row("control-RDES", gain=(0.4, 0.1, 0.5))}, 3000),
        Advice("ES", OPEN, {SHORT: row("ES", gain=(0.1, -0.1, 0.3))}, 3000),
        Advice("DPG", NEVER, {SHORT: row("DPG", gain=failed)}, 3000),
    )  # fmt: skip


def cells(table):
    rows = BeautifulSoup(table, "html.parser").find_all("tr")
    return [[cell.get_text("|") for cell in one.find_all(["th", "td"])] for one in rows]


def test_a_row_has_the_word_the_evidence_and_the_price(advised):
    head, first, second, *_ = cells(advice_table(advised, "All."))
    assert len(head) == len(first) == len(second)
    assert first[:2] == ["CMA-ES|spread=0.1", "first"]
    assert first[2] == "0.80 [0.70, 0.90]|90% of 120| layouts; 49 rollouts, 0.5 s"
    assert first[3].startswith("0.99 [0.98, 1.00]|")
    assert second[0] == "grid"
    assert second[3] == remedies.NOTHING


def test_rows_come_in_the_order_of_the_advice(advised):
    assert [one[1] for one in cells(advice_table(advised, "All."))[1:]] == [
        one.word for one in advised
    ]


def test_who_mostly_fails_is_infinitely_bad_and_not_nan(advised):
    said = cells(advice_table(advised, "All."))[-1][2]
    assert said.startswith("−∞ [−∞, ")
    assert "nan" not in said


def test_a_table_of_a_part_begins_with_the_greatest_lower_end_and_has_the_control():
    rows = [
        row("frozen", gain=(0.0, 0.0, 0.0)),
        row("ES", gain=(0.9, 0.1, 1.0)),
        row("SPSA", gain=(0.5, 0.4, 0.6)),
        row("Bayes", gain=(np.nan, np.nan, np.nan)),
        replace(row("DES"), disqualified=True),
    ]
    _, *found = cells(part_table(rows, "All."))
    assert [one[0] for one in found] == ["DES", "SPSA", "ES", "frozen", "Bayes"]
    assert found[0][1:3] == ["disqualified", "disqualified"]
    assert found[1][1:] == ["0.50 [0.40, 0.60]", "90% of 120", "49", "0.5 s"]


def test_every_word_has_a_colour_and_a_rule():
    assert {*COLOURS} == {*ADVICE}
    assert rule().count("\n") == len(ADVICE) - 1


def test_the_advice_in_short_names_first_second_and_never(advised):
    assert in_short(advised) == "Try `CMA-ES` first and `grid` second. Never try `DPG`."
    assert in_short(advised[2:4]) == "Nothing compared surely gains."


def test_an_answer_stands_beside_its_pilot():
    name = "faster auxiliary weights"
    numbers = {"difference": -0.1, "low": -0.2, "high": -0.05}
    said = answer_items(
        [Answer("guard", REPRODUCED, {"layouts": (14, 15)}), Answer(name, NOT, {}, numbers)]
    )
    first, second = said.splitlines()
    assert REMEDY_QUESTIONS["guard"].pilot in first
    assert "Confirmed: 14 of 15 layouts." in first
    assert "Contradicted: ; " not in second
    assert "the difference is −0.10 [−0.20, −0.05]" in second
    assert "The pilot" not in second


def test_an_expectation_says_whether_it_came_true():
    items = remedies.expectation_items({"DPG is never advised": True, "ES is first": False})
    assert items == (
        "- Expected: DPG is never advised. So it is.\n- Expected: ES is first. It is not so."
    )

"""What a page says of remedies follows from the rows: order, evidence, price and words."""

import numpy as np
import pandas as pd
import pytest
from bs4 import BeautifulSoup

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.claims.investigation import Answer
from nmpcrl.claims.verdict import NOT, REPRODUCED
from nmpcrl.report import remedies
from nmpcrl.report.remedies import (
    advice_table,
    answer_items,
)
from nmpcrl.studies.remedies import (
    ADVISED,
    FIRST,
    LATER,
    NEVER,
    OPEN,
    PARTS,
    REMEDIES,
    SECOND,
    RemedyRow,
)
from nmpcrl.studies.worlds import WORLDS

SHORT, LONG = ADVISED


def row(entry, word, part=SHORT, gain=(0.8, 0.7, 0.9), name=None, share=0.9):
    solved = Estimate(share, 0.8, 0.95)
    made = RemedyRow(part, entry, name or entry, Estimate(*gain), solved, 120, 2, 49, 0.54, False)
    return made._asdict() | {"word": word, "tuning": 3000}


@pytest.fixture
def advised():
    """One entry a word; the third is not judged with 300 episodes, and the last mostly fails."""
    return pd.DataFrame(
        [
            row("CMA-ES", FIRST, name="CMA-ES[spread=0.1]"),
            row("CMA-ES", FIRST, LONG, (0.99, 0.98, 1.0)),
            row("grid", SECOND, gain=(0.7, 0.6, 0.8)),
            row("control-RDES", LATER, gain=(0.4, 0.1, 0.5), share=1.0),
            row("ES", OPEN, gain=(0.1, -0.1, 0.3)),
            row("DPG", NEVER, gain=(-np.inf, -np.inf, -0.2)),
        ]
    )


def cells(table):
    rows = BeautifulSoup(table, "html.parser").find_all("tr")
    return [[cell.get_text("|") for cell in one.find_all(["th", "td"])] for one in rows]


def test_a_row_has_the_word_the_evidence_and_the_price_in_the_order_of_the_advice(advised):
    head, *found = cells(advice_table(advised, "All."))
    assert len(head) == len(found[0])
    assert [one[1].split("|")[0] for one in found] == [FIRST, SECOND, LATER, OPEN, NEVER]
    assert found[0][0] == "CMA-ES|spread=0.1"
    assert "a search of all nine numbers by CMA-ES" in found[0][1]
    assert found[0][2] == "0.80 [0.70, 0.90]|90% of 120| layouts; 49 rollouts, 0.5 s"
    assert found[0][3].startswith("0.99 [0.98, 1.00]|")
    assert found[1][3] == remedies.NOTHING
    assert found[-1][2].startswith("−∞ [−∞, …]|")


@pytest.fixture
def runs():
    """Of three entries in A to F: one fails in A, one solves all, one goes beyond its budget."""
    part = PARTS["named 50"]
    found = [
        {
            "part": "named 50", "entry": entry, "arm": entry, "place": layout, "k": k,
            "initial": 100.0, "best": 80.0, "cost": cost, "arrived": cost < 90, "episodes": 50,
            "over": entry == "DES", "seconds": 0.5,
        }
        for entry, cost in (("ES", 110.0), ("SPSA", 84.0), ("DES", 200.0))
        for layout in part.places
        for k in range(part.seeds)
    ]  # fmt: skip
    table = pd.DataFrame(found, columns=REMEDIES.table().columns)
    table.loc[(table.entry == "ES") & (table.place == "A") & (table.k == 0), "cost"] = np.inf
    return table


def test_a_table_of_a_part_has_each_layout_and_the_greatest_share_first(runs):
    table = remedies.named_table(runs, "named 50")
    head, *found = cells(table)
    assert head == ["Method", *"ABCDEF", "Solved", "CPU time"]
    assert found[0] == ["SPSA", *["0.80"] * 6, "6 of 6", "0.5 s"]
    assert found[1] == ["ES", "fails", *["−0.50"] * 5, "0 of 6", "0.5 s"]
    assert found[2][:2] == ["DES", "disqualified"]
    italic = {one.get_text() for one in BeautifulSoup(table, "html.parser").find_all("em")}
    assert italic == {"fails", "−0.50"}


def test_the_evidence_of_an_entry_is_that_with_the_smaller_budget(advised):
    found = remedies.evidence(advised, "CMA-ES")
    assert f"{found['gain'].value:.2f}" == "0.80 [0.70, 0.90]"
    assert found["solved"].value.value == pytest.approx(0.9)
    assert remedies.safest(advised) == ["control-RDES"]


GUARD = REMEDIES.asked["guard"]


@pytest.mark.parametrize(
    ("answer", "expected", "said"),
    [
        (Answer(REPRODUCED, {"layouts": (14, 15)}, question="guard"), False,
         f"- The pilot: “{GUARD.pilot}” **{GUARD.question}** Confirmed: 14 of 15 layouts"
         " [70%, 99%]."),
        (Answer(NOT, numbers={"difference": -0.1, "low": -0.2, "high": -0.05}, question="undo"),
         False, f"- **{REMEDIES.asked['undo'].question}** Contradicted: the difference is −0.10"
         " [−0.20, −0.05]."),
        (Answer(NOT, {"layouts": (0, 0)}, question="guard"), True,
         "** (guard) Contradicted: 0 of 0 layouts. Expected: confirmed."),
        (Answer(REPRODUCED, question="guard"), True, "** (guard) Confirmed."),
        (Answer(REPRODUCED, {"layouts": (9, 9)}, question="search and learning", numbers={
            "CMA-ES in A": 0.984, "CMA-ES in F": 0.38, "ES in A": -0.53, "ES in F": -np.inf}),
         False, "9 of 9 layouts [70%, 100%]; CMA-ES has 0.98 in A, 0.38 in F; ES has −0.53 in A,"
         " a failed solve in F."),
        (Answer(REPRODUCED, numbers={"correlation": 0.35, "low": 0.02, "high": 0.6},
                beside={"scenarios with any": (21, 40)}, question="crowding"), True,
         "Confirmed: the correlation is 0.35 [0.02, 0.60]; 21 of 40 scenarios with any."),
    ],
)  # fmt: skip
def test_an_answer_comes_with_its_pilot_its_evidence_and_another_expectation(
    answer, expected, said
):
    line = answer_items([answer], {**WORLDS.asked, **REMEDIES.asked}, expected=expected)
    assert line.endswith(said)

"""Claims, departures and lists as pages write them."""

import pandas as pd
import pytest

from nmpcrl.claims.robustness import COLUMNS
from nmpcrl.claims.verdict import (
    NOT,
    PARTLY,
    REPRODUCED,
    UNDECIDABLE,
    Verdict,
)
from nmpcrl.report import text
from nmpcrl.study.design import VARIANTS


def verdict(claim: str, outcome: str, layouts: str = "", decays: str = "") -> Verdict:
    """One whose outcomes in layouts A, B, ... and per step, per episode are letters: y, p, n, o."""
    read = {"y": REPRODUCED, "p": PARTLY, "n": NOT, "o": UNDECIDABLE}
    return Verdict(
        claim,
        "It is so.",
        outcome,
        "elsewhere",
        by_layout={name: read[letter] for name, letter in zip("ABCDEF", layouts, strict=False)},
        by_decay={
            name: read[letter] for name, letter in zip(("step", "episode"), decays, strict=False)
        },
    )


def table(*rows: tuple[str, str, bool]) -> pd.DataFrame:
    """What `variant_changes` returns, as far as it matters here."""
    frame = pd.DataFrame(rows, columns=["variant", "claim", "changes"])
    return frame.reindex(columns=list(COLUMNS))


@pytest.mark.parametrize(
    ("layouts", "decays", "disagreeing"),
    [
        ("yyyy", "yy", (False, False)),
        ("yyny", "yy", (True, False)),
        ("yypy", "yn", (True, True)),
        ("yyoy", "yo", (False, False)),  # what is not decided contradicts nothing
        ("oooo", "oo", (False, False)),
    ],
)
def test_layouts_and_readings_disagree_where_two_decided_verdicts_differ(
    layouts, decays, disagreeing
):
    judged = [verdict("C5", PARTLY, layouts, decays), verdict("C8", NOT)]
    depending = text.depends_on(judged, table())
    assert ("B" in depending, "C" in depending) == disagreeing


def test_a_departure_counts_every_variant_that_reads_it_otherwise():
    assert (VARIANTS["tanh"].departure, VARIANTS["four fits"].departure) == ("H", "H")
    assert VARIANTS["alpha x 3"].departure == ""
    judged = table(
        ("tanh", "C6", True),
        ("four fits", "C1", True),
        ("four fits", "C6", True),
        ("soft box", "C5", False),
        ("alpha x 3", "C9", True),  # the paper is clear about alpha
    )
    assert text.depends_on([verdict("C2", PARTLY, "yn", "yy")], judged) == {
        "B": ("C2",),
        "H": ("C1", "C6"),
    }

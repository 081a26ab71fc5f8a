"""The robustness analysis: a map of the verdicts."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.report.figures.sheet import in_words
from nmpcrl.report.figures.style import headed, marked, page, subplots
from nmpcrl.report.tables import WORDS

FILLS = {  # with the colour of the word; the darker, the more is left of the claim
    REPRODUCED: ("#1a6b3c", "white"),
    PARTLY: ("#e0b050", "black"),
    NOT: ("#f6d5d2", "black"),
    UNDECIDABLE: ("white", "0.45"),
}
SYMBOLS = {"c_epsilon": r"$c_\epsilon$", "alpha x": "α ×", "beta x": "β ×"}
SHORT = WORDS | {PARTLY: "part"}  # in a cell half an inch wide
LETTERS = -2.4  # where the letters of the departures stand, in widths of a cell
FOLD = 10  # characters of a line above a column
SMALL: dict[str, Any] = {"va": "center", "fontsize": "small"}


@page
def verdict_map(judged: pd.DataFrame, finding: str, mark: str) -> Figure:
    """What becomes of each claim in each row, framed where it is not what it is compared with.

    Args:
        judged: of `robustness_map`.
        finding: the title.
        mark: where the runs come from.
    """
    claims, rows = list(judged.claim.unique()), list(judged.variant.unique())
    letters = dict(zip(judged.variant, judged.departure, strict=True))
    height = dict(zip(rows, _heights([letters[row] for row in rows]), strict=True))
    last = max(height.values(), default=0.0)
    figure, axes = subplots(height=0.22 * last + 1.5)
    for cell in judged.to_dict("records"):
        _cell(axes, claims.index(cell["claim"]), height[cell["variant"]], cell)
    for row, y in height.items():
        axes.text(-0.1, y, named(row), ha="right", **SMALL)
        if height[row] == min(height[one] for one in rows if letters[one] == letters[row]):
            axes.text(LETTERS, y, letters[row], ha="left", **SMALL)
    axes.text(LETTERS, -0.8, "letter", ha="left", **(SMALL | {"va": "bottom"}))
    for i, claim in enumerate(claims):
        head = f"{claim}\n{_folded(BY_RUNS[claim].short, FOLD)}"
        axes.text(i + 0.5, -0.8, head, ha="center", **(SMALL | {"va": "bottom"}))
    axes.set(xlim=(LETTERS, max(1, len(claims))), ylim=(last + 0.7, -5.2))
    axes.set_axis_off()
    return marked(headed(figure, finding), mark)


def named(row: str) -> str:
    """The name of a row of the map, with symbols."""
    for word, symbol in SYMBOLS.items():
        row = row.replace(word, symbol)
    return row


def _heights(letters: list[str]) -> list[float]:
    """Where each row of the map lies, with some room between departures."""
    steps = [1.0 + 0.4 * (one != other) for one, other in pairwise(letters)]
    result: list[float] = np.cumsum([0.0, *steps]).tolist()
    return result


def _folded(text: str, most: int) -> str:
    """A text on lines of so many characters, if its words let it."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if len(in_words(longer)) <= most:
            lines[-1] = longer
        else:
            lines.append(word)
    return "\n".join(filter(None, lines))


def _cell(axes: Axes, column: int, y: float, cell: Mapping[str, Any]) -> None:
    """Colour, word and share of yes; framed, and with what it was before, if it changes."""
    fill, ink = FILLS[cell["outcome"]]
    place, size = (column + 0.03, y - 0.46), (0.94, 0.92)
    axes.add_patch(Rectangle(place, *size, facecolor=fill, edgecolor="0.5", linewidth=0.5))
    text = SHORT[cell["outcome"]]
    if cell["changes"]:
        text = f"{SHORT[cell['base']]}→{text}"
        axes.add_patch(Rectangle(place, *size, fill=False, edgecolor="black", linewidth=1.8))
    elif 0 < cell["share"] < 1:
        text += f" {cell['share']:.0%}"
    axes.text(column + 0.5, y, text, ha="center", va="center", color=ink, fontsize="small")

"""Figures of what verdicts depend on: the layouts, the thresholds, and a map of all variants."""

from collections.abc import Mapping
from itertools import pairwise
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from nmpcrl import Matrix
from nmpcrl.claims.by_runs import Values
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.rule import NEARLY_ALL, NEARLY_NONE
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE
from nmpcrl.control import Task
from nmpcrl.report.figures.axes import FEW, draw_task, maps, panels, plain
from nmpcrl.report.figures.style import (
    AT_ONE,
    LIMIT,
    TEAL,
    WINE,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.report.tables import WORDS
from nmpcrl.study import paper
from nmpcrl.study.layouts import gaps

OPEN, CLOSED = TEAL, WINE  # a gap
NARROW = 1.0  # a gap that is drawn leaves less than this [m]
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


@page
def layouts(rollouts: Mapping[str, Matrix]) -> Drawn:
    """The layouts, theta_init's first rollout in each, and the gaps that it goes through.

    Args:
        rollouts: states of the rollout without noise, shape (K + 1, n), by layout.
    """
    figure, by_name = maps(list(rollouts), 2.0, 0.4)
    margin, closing = paper.task().margin, 0
    for name, states in rollouts.items():
        axes, task = by_name[name], paper.task(name)
        widths = gaps(task, states[:, :2], margin)
        narrowest = min(widths.values(), default=np.inf)
        closing += narrowest <= 0
        draw_task(axes, task, labels=False)
        axes.plot(*states[:, :2].T, color="black", linewidth=1.1)
        for sides, width in widths.items():
            if width < NARROW:
                _gap(axes, task, sides, shut=width <= 0)
        kind = "closing" if narrowest <= 0 else "open"
        axes.set(title=f"{name}: {kind}, {narrowest:+.2f} m", ylim=(-3.0, 6.0))
    count = f"{closing} of {len(rollouts)} layouts"
    return titled(
        figure, rf"In {count}, a gap of the first rollout is closed at $\theta_c$ = {margin:g}"
    )


def _gap(axes: Axes, task: Task, sides: tuple[int, int], *, shut: bool) -> None:
    """The line between the two sides of a gap, numbered as `gaps` does."""
    centres = np.transpose(task.discs[:2])
    one, other = centres[sides[0]], centres[sides[0]].copy()
    if sides[1] >= 0:
        other = centres[sides[1]]
    else:  # a wall: left, bottom, right, top are -1 to -4
        axis = (-sides[1] - 1) % 2
        other[axis] = (task.lower if sides[1] >= -2 else task.upper)[axis]
    color, line = (CLOSED, (0, (1, 0.6))) if shut else (OPEN, "-")
    axes.plot(*np.transpose([one, other]), color=color, linestyle=line, linewidth=2.2)


@page
def borders(values: Mapping[str, Values], mark: str) -> Drawn:
    """What would become of each claim with other thresholds than its own.

    Args:
        values: of each claim's measure, over the main table.
        mark: where the runs come from.
    """
    figure, by_claim, grid = panels(list(values), 1.7, 0.6, sharey=True)
    for claim, measured in values.items():
        axes, asked = by_claim[claim], BY_RUNS[claim]
        first, last = asked.borders[[0, -1]]
        curve = asked.at_borders(measured, np.sort([*asked.borders, asked.threshold]))
        axes.plot(curve.border, curve.share, color="black")
        axes.fill_between(curve.border, curve.low, curve.high, color="0.85", linewidth=0)
        axes.axvline(asked.threshold, **LIMIT)
        for share in (NEARLY_NONE, NEARLY_ALL):
            axes.axhline(share, **AT_ONE)
        axes.set(xscale="log" if first > 0 else "linear", ylim=(-0.03, 1.03))
        if 0 < last < FEW * first:
            plain(axes.xaxis)
        axes.set_xlabel(asked.label, fontsize="small")
        low, high = same_verdict(curve, asked.threshold)
        axes.set_title(f"{claim}: same {low:.2g} to {high:.2g}", fontsize="small")
    for row in grid:
        row[0].set_ylabel("share of yes")
    stay = sum(BY_RUNS[claim].steady(measured) for claim, measured in values.items())
    finding = f"{stay} of {len(values)} verdicts stay with a border half as far, and twice as far"
    return titled(figure, finding, mark)


def same_verdict(curve: pd.DataFrame, border: float) -> tuple[float, float]:
    """Between which thresholds, around a claim's own, its verdict stays what it is.

    nan where nothing is known.

    Args:
        curve: of `RunClaim.at_borders`, in ascending order.
        border: one of them.
    """
    if curve.empty:
        return np.nan, np.nan
    own = int(np.argmin(np.abs(curve.border - border)))
    other = np.flatnonzero(curve.outcome != curve.outcome.iloc[own])
    first = max(other[other < own], default=-1) + 1
    last = min(other[other > own], default=len(curve)) - 1
    return float(curve.border.iloc[first]), float(curve.border.iloc[last])


@page
def verdict_map(judged: pd.DataFrame, finding: str, mark: str) -> Drawn:
    """What becomes of each claim in each row, framed where it is not what it is compared with.

    Args:
        judged: of `robustness_map`.
        finding: the title.
        mark: where the runs come from.
    """
    claims = {name: i for i, name in enumerate(judged.claim.unique())}
    letters = dict(zip(judged.variant, judged.departure, strict=True))
    steps = [1.0 + 0.4 * (one != other) for one, other in pairwise(letters.values())]
    height = dict(zip(letters, np.cumsum([0.0, *steps]), strict=True))
    last = max(height.values())
    figure, axes = subplots(height=0.22 * last + 1.5)
    for cell in judged.to_dict("records"):
        _cell(axes, claims[cell["claim"]], height[cell["variant"]], cell)
    look: dict[str, Any] = {"va": "center", "fontsize": "small"}
    for row, y in height.items():
        axes.text(-0.1, y, _with_symbols(row), ha="right", **look)
    for letter in dict.fromkeys(letters.values()):
        top = min(y for row, y in height.items() if letters[row] == letter)
        axes.text(LETTERS, top, letter, ha="left", **look)
    look["va"] = "bottom"
    axes.text(LETTERS, -0.8, "letter", ha="left", **look)
    for claim, i in claims.items():
        head = f"{claim}\n{fill(BY_RUNS[claim].short, FOLD, break_long_words=False)}"
        axes.text(i + 0.5, -0.8, head, ha="center", **look)
    axes.set(xlim=(LETTERS, len(claims)), ylim=(last + 0.7, -5.2))
    axes.set_axis_off()
    return titled(figure, finding, mark)


def _with_symbols(row: str) -> str:
    for word, symbol in SYMBOLS.items():
        row = row.replace(word, symbol)
    return row


def _cell(axes: Axes, column: int, y: float, cell: Mapping[str, Any]) -> None:
    """Colour, word and share of yes; framed, and with what it was before, if it changes."""
    fill_color, ink = FILLS[cell["outcome"]]
    place, size = (column + 0.03, y - 0.46), (0.94, 0.92)
    axes.add_patch(Rectangle(place, *size, facecolor=fill_color, edgecolor="0.5", linewidth=0.5))
    text = SHORT[cell["outcome"]]
    if cell["changes"]:
        text = f"{SHORT[cell['base']]}→{text}"
        axes.add_patch(Rectangle(place, *size, fill=False, edgecolor="black", linewidth=1.8))
    elif 0 < cell["share"] < 1:
        text += f" {cell['share']:.0%}"
    axes.text(column + 0.5, y, text, ha="center", va="center", color=ink, fontsize="small")

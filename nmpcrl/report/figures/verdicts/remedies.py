"""The share of the possible gain that each remedy has, with intervals, in the order of advice."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.analysis.suite import Judgement
from nmpcrl.report.figures.style import (
    AT_ONE,
    INK,
    LIMIT,
    LOOKS,
    TEAL,
    WINE,
    Look,
    headed,
    page,
    subplots,
)
from nmpcrl.studies.remedies import ADVISED, FIRST, NEVER, PARTS, SECOND

COLOURS = {FIRST: TEAL, SECOND: TEAL, NEVER: WINE}  # others are in ink
MARKS = {FIRST: "D", SECOND: "D", NEVER: "X"}  # others are round
ABOVE: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": "small"}
LINES = (  # of entries that are no learner of the study
    Look(TEAL, "-", "D"), Look("#B37A00", (0, (6, 2)), "s"), Look("#332288", "-.", "^"),
    Look(INK, ":", "v"), Look("#8C5A2B", "--", "P"),
)  # fmt: skip
DEAREST = 1.1  # cost in parts of the start's that is drawn; what is dearer stands at the edge
LEAST, MOST = -1.0, 1.15  # shares that are drawn; what is lower ends in an arrow


@page
def gains(advised: pd.DataFrame) -> Figure:
    """One row an entry, one panel a budget: the interquartile mean over layouts, with its interval.

    Args:
        advised: of `remedies.advice`, the first on top.
    """
    words = dict(zip(advised.entry, advised.word, strict=True))
    high = 0.2 * len(words) + 0.8
    options: dict[str, Any] = {"sharex": True, "sharey": "row", "squeeze": False}
    tall = len(ADVISED) * (high + 0.3) + 0.6
    figure, panels = subplots(1, len(ADVISED), high, tall=tall, **options)
    for axes, part in zip(panels.flat, ADVISED, strict=True):
        _panel(axes, words, advised[advised.part == part])
        axes.set_title(f"{PARTS[part].episodes} episodes", fontsize="medium", fontweight="normal")
    return headed(figure, _finding(words))


@page
def by_budget(budgets: Sequence[int], returned: Mapping[str, Sequence[Judgement]]) -> Figure:
    """One line an entry: the cost of what it returns, in parts of theta_init's, over the budget.

    Args:
        budgets: in episodes.
        returned: by the name of the entry, one for each budget.
    """
    figure, axes = subplots()
    axes.axhline(1, **LIMIT)
    looks = cycle(LINES)
    for name, each in returned.items():
        look = LOOKS.get(name) or next(looks)
        costs = np.array([one.cost / one.initial for one in each])
        drawn = np.minimum(costs, DEAREST)
        axes.plot(budgets, drawn, label=name, marker=look.marker, markersize=4, **look.line)
        away = np.flatnonzero([not one.arrived for one in each])
        axes.plot(np.array(budgets)[away], drawn[away], "x", color=WINE, markersize=9, zorder=3)
        for budget, cost in zip(budgets, costs, strict=True):
            if cost > DEAREST:
                axes.annotate(f"{cost:.0%}", (budget, DEAREST), (0, 6), **ABOVE)
    ylabel = r"cost over that of $\theta_\mathrm{init}$"
    axes.set(xlabel="episodes spent", ylabel=ylabel, xscale="log")
    axes.set_xticks(budgets, [f"{one}" for one in budgets])
    axes.minorticks_off()
    axes.yaxis.set_major_formatter(PercentFormatter(1, 0))
    axes.legend(fontsize="small")
    return headed(figure, _cheapest(budgets, returned))


def _cheapest(budgets: Sequence[int], returned: Mapping[str, Sequence[Judgement]]) -> str:
    """Who costs least with the whole budget, in a title."""
    last = {name: each[-1] for name, each in returned.items()}
    best = min(last, key=lambda name: last[name].cost)
    share = last[best].cost / last[best].initial
    return f"With {budgets[-1]} episodes {best} costs least: {share:.0%} of the start's cost"


def _panel(axes: Axes, words: Mapping[str, str], rows: pd.DataFrame) -> None:
    axes.axvline(0, **LIMIT)
    axes.axvline(1, **AT_ONE)
    for entry, word, share in zip(rows.entry, rows.word, rows.gain, strict=True):
        _mark(axes, [*words].index(entry), word, share)
    names = [f"{entry}: {word}" for entry, word in words.items()]
    axes.set_yticks(range(len(words)), names, fontsize="small")
    axes.set(xlim=(LEAST, MOST), ylim=(len(words) - 0.4, -0.6))
    axes.set(xlabel="share of the possible gain [-]")


def _mark(axes: Axes, y: int, word: str, share: Estimate) -> None:
    """A mark with its interval; an arrow where it lies beyond the panel."""
    colour = COLOURS.get(word, INK)
    low, high = np.clip([share.low, share.high], LEAST, MOST)
    axes.plot([low, high], [y, y], color=colour, linewidth=1.6)
    if share.value < LEAST:
        axes.plot(LEAST, y, marker="<", color=colour, markersize=6, clip_on=False)
    else:
        axes.plot(share.value, y, marker=MARKS.get(word, "o"), color=colour, markersize=5)


def _finding(words: Mapping[str, str]) -> str:
    """What to try first, second and never, in a title."""
    by = {word: [entry for entry, one in words.items() if one == word] for word in MARKS}
    said = [f"{word} {', '.join(entries)}" for word, entries in by.items() if entries]
    text = "; ".join(said) or "nothing surely gains"
    return f"What to try: {text}"

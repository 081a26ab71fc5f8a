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
from nmpcrl.report.figures.axes import below
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
from nmpcrl.studies.remedies import ADVISED, PARTS

ABOVE: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": "small"}
LINES = (  # of entries that are no learner of the study
    Look(TEAL, "-", "D"), Look("#B37A00", (0, (6, 2)), "s"), Look("#332288", "-.", "^"),
    Look(INK, ":", "v"), Look("#8C5A2B", "--", "P"),
)  # fmt: skip
DEAREST = 1.1  # cost in parts of the start's that is drawn; what is dearer stands at the edge
LEAST, MOST = -1.0, 1.15  # shares that are drawn; what is lower ends in an arrow


@page
def gains(advised: pd.DataFrame, finding: str) -> Figure:
    """One row an entry, one mark a budget: the interquartile mean over layouts, with its interval.

    Args:
        advised: of `remedies.advice`, the first on top.
        finding: the title.
    """
    words = dict(zip(advised.entry, advised.word, strict=True))
    figure, axes = subplots(height=0.24 * len(words) + 1.1)
    axes.axvline(0, **LIMIT)
    axes.axvline(1, **AT_ONE)
    for part, shift, face in zip(ADVISED, (-0.18, 0.18), (INK, "white"), strict=True):
        of_part = advised[advised.part == part]
        for entry, share in zip(of_part.entry, of_part.gain, strict=True):
            _mark(axes, [*words].index(entry) + shift, share, face)
        axes.plot([], [], "o", color=INK, mfc=face, label=f"{PARTS[part].episodes} episodes")
    names = [f"{entry}: {word}" for entry, word in words.items()]
    axes.set_yticks(range(len(words)), names, fontsize="small")
    axes.set(xlim=(LEAST, MOST), ylim=(len(words) - 0.4, -0.6))
    axes.set(xlabel="share of the possible gain")
    below(figure, axes.get_legend_handles_labels()[0])
    return headed(figure, finding)


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


def _mark(axes: Axes, y: float, share: Estimate, face: str) -> None:
    """A mark with its interval; an arrow where it lies beyond the axes."""
    low, high = np.clip([share.low, share.high], LEAST, MOST)
    axes.plot([low, high], [y, y], color=INK, linewidth=1.2)
    at, marker = (LEAST, "<") if share.value < LEAST else (share.value, "o")
    axes.plot(at, y, marker, color=INK, markerfacecolor=face, markersize=5, clip_on=False)

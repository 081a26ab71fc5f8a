"""Learners side by side: one number of every run, layout by layout."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from nmpcrl.analysis.statistics import interquartile_mean
from nmpcrl.report.figures.style import LIMIT, LOOKS, headed, marked, page, subplots

TALL = 2.3  # inches of a row of panels on a narrow sheet


@page
def by_layout(
    runs: pd.DataFrame,
    values: pd.Series,
    learners: Sequence[str],
    *,
    label: str,
    finding: str,
    mark: str,
    seen: tuple[float, float],
) -> Figure:
    """A share of every run, layout by layout and learner by learner, with interquartile means.

    Args:
        runs: of `rows.table`.
        values: one a run; infinite ones, and what is not `seen`, are drawn at the edge.
        learners: in the order in which they are drawn.
        label: what the share is of.
        finding: the title.
        mark: where the runs come from.
        seen: the lowest and the highest that is drawn.
    """
    layouts = list(runs.layout.unique())
    options: dict[str, Any] = {
        "sharey": True,
        "squeeze": False,
        "across": 3,
        "tall": TALL * -(-len(layouts) // 3) + 0.9,
    }
    figure, grid = subplots(1, len(layouts), 3.3, **options)
    for axes, layout in zip(grid[0], layouts, strict=True):
        for x, learner in enumerate(learners):
            here = (runs.layout == layout) & (runs.learner == learner) & values.notna()
            _strip(axes, x, learner, runs[here], values[here].clip(*seen))
        axes.axhline(0, **LIMIT)
        axes.set_title(layout, fontsize="medium")
        axes.set_xticks(range(len(learners)), learners, rotation=90, fontsize="small")
        axes.set_xlim(-0.6, len(learners) - 0.4)
    grid[0, 0].set(ylabel=label, ylim=(seen[0], seen[1]))
    grid[0, 0].yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    return marked(headed(figure, finding), mark)


def _strip(axes: Axes, x: int, learner: str, runs: pd.DataFrame, values: pd.Series) -> None:
    """The runs of a learner, hollow if noise decays per episode; their middle, its interval."""
    look = LOOKS[learner]
    for decay, shift in (("step", -0.16), ("episode", 0.16)):
        some = values[runs.decay == decay]
        face = look.color if decay == "step" else "none"
        place = x + shift + np.linspace(-0.1, 0.1, len(some))
        style: dict[str, Any] = {"color": look.color, "markerfacecolor": face, "markersize": 3.5}
        axes.plot(place, some, look.marker, linestyle="", **style)
    if len(values):
        middle = interquartile_mean(values.to_numpy(), list(runs.layout))
        axes.plot([x - 0.35, x + 0.35], [middle.value] * 2, color="black", linewidth=1.6)
        axes.plot([x, x], [middle.low, middle.high], color="black", linewidth=1.0)

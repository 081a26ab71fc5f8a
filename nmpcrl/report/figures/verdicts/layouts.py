"""Figures of the layouts, and where the borders of the claims lie.

The map of the verdicts is in `figures.robustness`.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nmpcrl import Matrix
from nmpcrl.claims.by_runs import Values
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.rule import NEARLY_ALL, NEARLY_NONE
from nmpcrl.control import Task
from nmpcrl.report.figures.axes import draw_task, map_grid, plain
from nmpcrl.report.figures.style import (
    AT_ONE,
    LIMIT,
    SUBTITLE,
    TEAL,
    WINE,
    headed,
    marked,
    page,
)
from nmpcrl.study import paper
from nmpcrl.study.layouts import gaps

OPEN, CLOSED = TEAL, WINE  # a gap
NARROW = 1.0  # a gap that is drawn leaves less than this [m]
FEW = 100  # high over low of borders for which powers of ten are too few


@page
def layouts(rollouts: Mapping[str, Matrix]) -> Figure:
    """The layouts, theta_init's first rollout in each, and the gaps that it goes through.

    Args:
        rollouts: states of the rollout without noise, shape (K + 1, n), by layout.
    """
    figure, maps, grid = map_grid(list(rollouts), 2.0, 0.4)
    margin, closing = paper.task().margin, 0
    for name, states in rollouts.items():
        axes, task = maps[name], paper.task(name)
        widths = gaps(task, states[:, :2], margin)
        narrowest = min(widths.values(), default=np.inf)
        closing += narrowest <= 0
        draw_task(axes, task, labels=False)
        axes.plot(*states[:, :2].T, color="black", linewidth=1.1)
        for sides, width in widths.items():
            if width < NARROW:
                _gap(axes, task, sides, shut=width <= 0)
        kind = "closing" if narrowest <= 0 else "open"
        axes.set_title(f"{name}: {kind}, {narrowest:+.2f} m", **SUBTITLE)
    grid[0, 0].set_ylim(-3.0, 6.0)
    figure.supxlabel("x [m]", fontsize="medium")
    figure.supylabel("y [m]", fontsize="medium")
    count = f"{closing} of {len(rollouts)} layouts"
    finding = rf"In {count}, a gap of the first rollout is closed at $\theta_c$ = {margin:g}"
    return headed(figure, finding)


@page
def borders(values: Mapping[str, Values], mark: str) -> Figure:
    """What would become of each claim at other borders than its own.

    Args:
        values: of each claim's measure, over the main table.
        mark: where the runs come from.
    """
    figure, panels, grid = map_grid(list(values), 1.7, 0.6, sharex=False)
    for claim, measured in values.items():
        axes = panels[claim]
        asked = BY_RUNS[claim]
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
        kept = f"same {low:.2g} to {high:.2g}" if len(curve) else "not decidable"
        axes.set_title(f"{claim}: {kept}", **(SUBTITLE | {"fontsize": "small"}))
    for row in grid:
        row[0].set_ylabel("share of yes")
    stay = sum(BY_RUNS[claim].steady(measured) for claim, measured in values.items())
    finding = f"{stay} of {len(values)} verdicts stay with a border half as far, and twice as far"
    return marked(headed(figure, finding), mark)


def same_verdict(curve: pd.DataFrame, border: float) -> tuple[float, float]:
    """Between which borders, around a claim's own, its verdict stays what it is.

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

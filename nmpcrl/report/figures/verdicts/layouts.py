"""Figures of the layouts, theta_c among them, and where the borders of the claims lie.

The map of the verdicts is in `figures.robustness`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims.by_runs import Values
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.rule import NEARLY_ALL, NEARLY_NONE
from nmpcrl.control import Task
from nmpcrl.report.figures.axes import below, draw_task, map_grid, over_episodes, plain
from nmpcrl.report.figures.style import (
    AT_ONE,
    LIMIT,
    LOOKS,
    SUBTITLE,
    TEAL,
    WINE,
    headed,
    marked,
    page,
    subplots,
)
from nmpcrl.study import paper
from nmpcrl.study.layouts import gaps

OPEN, CLOSED = TEAL, WINE  # a gap
LEARNING = ("ES", "RDES", "GES", "TDC")  # whose theta_c is drawn; that of DES may go anywhere
NEAR = 0.05  # of theta_c from d_o
NARROW = 1.0  # a gap that is drawn leaves less than this [m]
SEEN = (-0.1, 0.6)  # of theta_c; what goes beyond ends at the edge
FEW = 100  # high over low of borders for which powers of ten are too few
DASHED = LIMIT | {"linestyle": (0, (7, 3))}  # told from dotted lines without colour


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
def theta_c(found: Evidence) -> Figure:
    """theta_c over training, a column a layout and a row a reading of the decay."""
    names, decays = (found.summaries.values_of(field) for field in ("layout", "decay"))
    options: dict[str, Any] = {"sharex": True, "sharey": True, "squeeze": False, "across": 3}
    figure, grid = subplots(len(decays), len(names), 1.9 * len(decays) + 0.9, **options)
    margin = paper.task().margin
    ends: list[float] = []
    for row, decay in zip(grid, decays, strict=True):
        for axes, name in zip(row, names, strict=True):
            runs = found.summaries.select(layout=name, decay=decay)
            ends += _ways_of_theta_c(axes, runs)
            axes.axhline(margin, **DASHED)
            for run in list(runs.select(learner="frozen").values())[:1]:
                shut = closes_at(paper.task(name), run.states[:, :2])
                axes.axhline(shut, color=CLOSED, linewidth=0.9, linestyle=":")
        row[0].set(ylabel=rf"$\theta_c$, per {decay}", ylim=SEEN)
    for axes, name in zip(grid[0], names, strict=True):
        axes.set_title(name, fontsize="medium")
    for axes in grid[-1]:
        over_episodes(axes)
    handles = [Line2D([], [], label=name, **LOOKS[name].line) for name in LEARNING]
    handles.append(Line2D([], [], label="$d_o$", **DASHED))
    handles.append(Line2D([], [], label="a gap closes", color=CLOSED, linestyle=":"))
    below(figure, handles)
    beyond = np.array(ends) - margin
    near, past = int((np.abs(beyond) <= NEAR).sum()), int((beyond > NEAR).sum())
    finding = (
        rf"Of {len(ends)} runs, {near} end with $\theta_c$ within {NEAR:g} of $d_o$ = {margin:g},"
        f" and {past} far above it"
    )
    return marked(headed(figure, finding), found.mark)


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


def _ways_of_theta_c(axes: Axes, runs: Mapping[Any, RunSummary]) -> list[float]:
    """Draw theta_c of every run that is shown; return where each ends."""
    ends = []
    for run in runs.values():
        if run.name.learner in LEARNING:
            values: Vector = run.evaluations["theta"][:, -1]
            line = LOOKS[run.name.learner].line
            axes.plot(run.evaluations["episode"], values, **line, linewidth=0.7)
            ends.append(float(values[-1]))
    return ends


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

"""The trap in one run, and where the cliff stands that theta_c falls over."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from nmpcrl import Vector
from nmpcrl.analysis.trap import Stand, stretch
from nmpcrl.control import Task
from nmpcrl.report.figures.axes import MAPS, draw_task, over_episodes
from nmpcrl.report.figures.style import (
    BAND,
    INK,
    LIMIT,
    SUBTITLE,
    TEAL,
    WINE,
    headed,
    mosaic,
    page,
    subplots,
)
from nmpcrl.studies.population import STANDING

PANELS = (("map", "map"), ("value", "delta"), ("theta_c", "cost"))
ROWS, HEIGHT = (2.2, 1, 1), 6.2
MOMENTS = (("#0072B2", "-"), ("#B37A00", "--"), (WINE, "-."))  # of a trajectory and its clearances
BEST: dict[str, Any] = {"color": TEAL, "linestyle": "-"}
FIRST: dict[str, Any] = {"color": WINE, "linestyle": "--"}

LINES: dict[str, dict[str, Any]] = {
    "value": {
        "forever": FIRST | {"label": r"$\ell / (1 - \gamma)$"},
        "value": BEST | {"label": "V"},
    },
    "delta": {"delta": {"color": INK}},
    "theta_c": {"theta_c": {"color": INK}},
    "cost": {"cost": {"color": INK}},
}
LABELS = {
    "value": "where it ends",
    "delta": "|δ|",
    "theta_c": r"$\theta_c$",
    "cost": "cost without noise",
}


@page
def trap(task: Task, stands: Sequence[Stand], moments: Sequence[int], finding: str) -> Figure:
    """One run: where the robot goes at three moments, and what value, TD error and cost do.

    Args:
        task: what the robot moves in.
        stands: of `analysis.trap.stands`.
        moments: which three of them the map shows, the last two of a robot that stands.
        finding: the title.
    """
    figure, panels = mosaic(PANELS, ROWS, HEIGHT)
    _map(panels["map"], task, [stands[k] for k in moments])
    there = stretch(stands, STANDING)
    along = [one.episode for one in stands]
    away = np.array([not one.arrived for one in stands])
    for name, fields in LINES.items():
        axes = panels[name]
        if there:
            axes.axvspan(there[0].episode, there[-1].episode, **BAND)
        for field, look in fields.items():
            values = np.array([getattr(one, field) for one in stands])
            axes.plot(along, np.where(away | (name != "value"), values, np.nan), **look)
        axes.set(xlim=(0, along[-1]), ylabel=LABELS[name])
        axes.set_ylim(bottom=0)
        over_episodes(axes, "episode" if name in PANELS[-1] else "")
    panels["value"].set_ylim(top=1.5 * panels["value"].get_ylim()[1])
    panels["value"].legend(ncols=2, fontsize="small", loc="upper right")
    panels["value"].set_title("grey: the robot is stuck", **SUBTITLE)
    return headed(figure, finding)


@page
def cliffs(
    grid: Vector,
    costs: Mapping[str, tuple[Vector, Vector]],
    best: Mapping[str, float],
    finding: str,
) -> Figure:
    """Cost over theta_c with all else best, and with all else as it was, a panel a layout.

    Args:
        grid: of theta_c.
        costs: on the grid, by layout: with the best theta, and with theta_init.
        best: theta_c of the best theta, by layout.
        finding: the title.
    """
    columns = min(MAPS, len(costs))
    rows = -(-len(costs) // columns)
    options: dict[str, Any] = {"sharex": True, "squeeze": False}
    figure, axes = subplots(rows, columns, 1.9 * rows + 0.6, **options)
    for panel, (layout, (along_best, along_init)) in zip(axes.flat, costs.items(), strict=False):
        panel.plot(grid, along_init / 1000, label=r"all else as $\theta_\mathrm{init}$", **FIRST)
        panel.plot(grid, along_best / 1000, label="all else best", **BEST)
        panel.axvline(best[layout], **LIMIT)
        panel.set_title(f"layout {layout}", **SUBTITLE)
        panel.set_xlabel(r"$\theta_c$ [-]")
        panel.set_ylim(bottom=0)
    for panel in axes[:, 0]:
        panel.set_ylabel("cost [thousands]")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return headed(figure, finding)


def _map(axes: Axes, task: Task, shown: Sequence[Stand]) -> None:
    """The way of the robot at each moment, and what plans keep away from."""
    draw_task(axes, task)
    for one, (color, style) in zip(shown, MOMENTS, strict=True):
        for x, y, clearance in np.transpose(task.discs):
            radius = clearance / 2 * np.sqrt(1 + one.theta_c)
            axes.add_patch(Circle((x, y), radius, fill=False, ec=color, ls=style, lw=0.9))
        label = rf"episode {one.episode}, $\theta_c$ = {one.theta_c:.2f}"
        axes.plot(*one.states[:, :2].T, color=color, linestyle=style, linewidth=2, label=label)
        if not one.arrived:
            axes.plot(*one.states[-1, :2], "X", color=color, markersize=8, mec="white")
    axes.legend(loc="lower left", fontsize="small")
    axes.set(xlabel="x [m]", ylabel="y [m]")

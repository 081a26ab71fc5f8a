"""The trap in one run, and where the cliff stands that theta_c falls over."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from nmpcrl import Vector
from nmpcrl.analysis.trap import Stand, stretch
from nmpcrl.control import Task
from nmpcrl.report.figures.axes import below, draw_task, over_episodes, panels
from nmpcrl.report.figures.style import BAND, INK, LIMIT, OCHRE, TEAL, WINE, Drawn, page, titled
from nmpcrl.studies.population import STANDING

MOMENTS = (("#0072B2", "-"), (OCHRE, "--"), (WINE, "-."))  # of a trajectory and its clearances
BEST: dict[str, Any] = {"color": TEAL, "linestyle": "-"}
FIRST: dict[str, Any] = {"color": WINE, "linestyle": "--"}
LINES: dict[str, tuple[str, dict[str, dict[str, Any]]]] = {  # label, and fields of a `Stand`
    "value": ("where it ends", {
        "forever": FIRST | {"label": r"$\ell / (1 - \gamma)$"}, "value": BEST | {"label": "V"},
    }),
    "delta": ("|δ|", {"delta": {"color": INK}}),
    "theta_c": (r"$\theta_c$", {"theta_c": {"color": INK}}),
    "cost": ("cost without noise", {"cost": {"color": INK}}),
}  # fmt: skip


@page
def trap(task: Task, stands: Sequence[Stand], moments: Sequence[int], finding: str) -> Drawn:
    """One run: where the robot goes at three moments, and what value, TD error and cost do.

    Args:
        task: what the robot moves in.
        stands: of `analysis.trap.stands`.
        moments: which three of them the map shows, the last two of a robot that stands.
        finding: the title.
    """
    figure = Drawn(6.2)
    by_name = figure.subplot_mosaic(
        [["map", "map"], ["value", "delta"], ["theta_c", "cost"]], height_ratios=(2.2, 1, 1)
    )
    _map(by_name["map"], task, [stands[k] for k in moments])
    there = stretch(stands, STANDING)
    along = [one.episode for one in stands]
    away = np.array([not one.arrived for one in stands])
    for name, (label, fields) in LINES.items():
        axes = by_name[name]
        if there:
            axes.axvspan(there[0].episode, there[-1].episode, **BAND)
        for field, look in fields.items():
            values = np.array([getattr(one, field) for one in stands])
            axes.plot(along, np.where(away | (name != "value"), values, np.nan), **look)
        over_episodes(axes)
        axes.set(xlim=(0, along[-1]), ylabel=label)
        axes.set_ylim(bottom=0)
    by_name["value"].set_ylim(top=1.5 * by_name["value"].get_ylim()[1])
    by_name["value"].legend(ncols=2, fontsize="small", loc="upper right")
    by_name["value"].set_title("grey: the robot is stuck")
    return titled(figure, finding)


@page
def cliffs(
    grid: Vector,
    costs: Mapping[str, tuple[Vector, Vector]],
    best: Mapping[str, float],
    finding: str,
) -> Drawn:
    """Cost over theta_c with all else best, and with all else as it was, a panel a layout.

    Args:
        grid: of theta_c.
        costs: on the grid, by layout: with the best theta, and with theta_init.
        best: theta_c of the best theta, by layout.
        finding: the title.
    """
    figure, by_layout, rows = panels(list(costs), 1.9, 0.6, sharex=True)
    for layout, panel in by_layout.items():
        along_best, along_init = costs[layout]
        panel.plot(grid, along_init / 1000, label=r"all else as $\theta_\mathrm{init}$", **FIRST)
        panel.plot(grid, along_best / 1000, label="all else best", **BEST)
        panel.axvline(best[layout], **LIMIT)
        panel.set_title(f"layout {layout}")
        panel.set_ylim(bottom=0)
    for panel in rows[-1]:
        panel.set_xlabel(r"$\theta_c$ (no unit)")
    for panel in rows[:, 0]:
        panel.set_ylabel("cost [thousands]")
    below(figure, *rows[0, 0].get_legend_handles_labels())
    return titled(figure, finding)


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

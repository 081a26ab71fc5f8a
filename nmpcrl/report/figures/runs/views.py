"""Robots among obstacles that move, as each of three NMPCs sees them."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.encounters import Encounters
from nmpcrl.report.figures.axes import below
from nmpcrl.report.figures.style import (
    BAND,
    INK,
    QUIET,
    SUBTITLE,
    VIEW_LINES,
    VIEW_TITLES,
    headed,
    mosaic,
    page,
)
from nmpcrl.report.worlds import nearest
from nmpcrl.studies.worlds import VIEWS
from nmpcrl.study import paper
from nmpcrl.study.moving import CLEARANCE, PERIOD, TASK, Motion, centres

MAPS = ("extrapolated", "frozen")
PANELS = (MAPS, ("near",) * 2)
AROUND = 0.6  # of the map, beyond start and target [m]
ROOM = 2.0  # of the map, above and below every way [m]


@page
def views(motions: Sequence[Motion], seen: Mapping[str, Encounters]) -> Figure:
    """Maps of two views, and how near the robot comes to an obstacle with all three.

    The maps show the moment at which a robot is deepest in an obstacle, or nearest to one.

    Args:
        motions: of the obstacles.
        seen: by view, the episode in which the obstacles were seen so.
    """
    figure, panels = mosaic(PANELS, (1.6, 1), 4.6)
    at = centres(motions, np.arange(paper.STEPS))
    near = {view: nearest(one, motions) for view, one in seen.items()}
    moment = int(np.argmin(near[min(near, key=lambda view: near[view].min())]))
    ways = {view: one.states[: paper.STEPS, :2] for view, one in seen.items()}
    every = np.vstack([*ways.values()])
    low, high = every.min(axis=0) - [AROUND, ROOM], every.max(axis=0) + [AROUND, ROOM]
    for view in MAPS:
        panels[view].set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        _map(panels[view], at, ways[view], moment, view)
    _curves(figure, panels["near"], near, moment)
    counts = {view: seen[view].contacts.inside for view in VIEWS}
    known, extrapolated, frozen = counts.values()
    return headed(
        figure,
        f"States inside an obstacle: {known} if the motion is known, {extrapolated} if it is"
        f" extrapolated, {frozen} if obstacles are taken as standing",
    )


def _map(axes: Axes, at: Matrix, way: Matrix, moment: int, view: str) -> None:
    """Where everything is at one moment, and its way."""
    radius, moment = TASK.robot_diameter / 2, min(moment, len(way) - 1)
    for j in range(at.shape[1]):
        axes.plot(*at[:, j].T, color=QUIET, linewidth=0.8, zorder=1)
        disc = Circle(at[moment, j], CLEARANCE / 2 - radius, fc="#CFCFCF", ec="#8A8A8A", zorder=2)
        axes.add_patch(disc)
    axes.plot(*way.T, **VIEW_LINES[view], linewidth=1.8, zorder=3)
    robot = Circle(way[moment], radius, fc=VIEW_LINES[view]["color"], ec="white", lw=0.8, zorder=4)
    axes.add_patch(robot)
    axes.plot(*TASK.target[:2], "*", color=INK, ms=9, zorder=3)
    first = view == MAPS[0]
    axes.set(xlabel="x [m]", ylabel="y [m]" if first else "")
    axes.tick_params(labelleft=first)
    axes.set_title(VIEW_TITLES[view], **SUBTITLE)


def _curves(figure: Figure, axes: Axes, near: Mapping[str, Vector], moment: int) -> None:
    """The distance to the nearest obstacle over time."""
    seconds = PERIOD * np.arange(paper.STEPS)
    axes.axhspan(min(one.min() for one in near.values()) - 0.1, 0, **BAND)
    for view, distances in near.items():
        points, now = np.c_[seconds[: len(distances)], distances], min(moment, len(distances) - 1)
        axes.plot(*points.T, label=VIEW_TITLES[view], **VIEW_LINES[view])
        axes.plot(*points[now], "o", color=VIEW_LINES[view]["color"], ms=5, clip_on=False)
    axes.set(xlabel="time [s]", ylabel="to the nearest\nobstacle [m]", xlim=(0, seconds[-1]))
    axes.set_title("grey: inside an obstacle", **SUBTITLE)
    axes.margins(y=0)
    below(figure, axes.get_lines()[::2])

"""Worlds that move, change, or are not the model: what a view, a policy and learning are worth."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.ticker import PercentFormatter

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.encounters import Encounters
from nmpcrl.analysis.statistics import interquartile_mean
from nmpcrl.report.figures.axes import below, interval, over_episodes
from nmpcrl.report.figures.style import (
    BAND,
    INK,
    LIMIT,
    OCHRE,
    QUIET,
    TEAL,
    WINE,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.report.worlds import nearest, signed
from nmpcrl.studies.shifts import EVERY
from nmpcrl.studies.worlds import VIEWS
from nmpcrl.study import paper
from nmpcrl.study.moving import CLEARANCE, PERIOD, TASK, Motion, centres

OWN: Mapping[str, dict[str, Any]] = {  # policies of a wrong model
    "oracle": {"label": "true model", "color": INK, "marker": "s"},
    "ES": {"label": "ES", "color": "#0072B2", "marker": "o"},
    "ES+model": {"label": "ES, model learned, too", "color": OCHRE, "marker": "^"},
    "grid": {"label": r"grid over $\theta_c$", "color": TEAL, "marker": "D"},
}
FAULTS = {  # as a figure names them
    "speed": "speed lost", "turn": "turns too much", "drift": "drift", "slip": "wheels slip",
    "lag": "lag", "noise": "measurement noise",
}  # fmt: skip
ARMS: Mapping[str, dict[str, Any]] = {
    "ES told plain": {"label": "ES, knows of it", "color": "#0072B2", "linestyle": "-"},
    "ES told reset": {"label": "ES, begun anew", "color": TEAL, "linestyle": (0, (5, 1))},
    "ES never plain": {"label": "ES, never knows", "color": WINE, "linestyle": "-."},
    "frozen never plain": {
        "label": r"$\theta_\mathrm{init}$, never knows", "color": INK, "linestyle": ":"
    },
}  # fmt: skip
SEEN: Mapping[str, dict[str, Any]] = {  # views of obstacles that move
    "known": {"label": "knows the motion", "color": TEAL, "linestyle": "-"},
    "extrapolated": {"label": "extrapolates", "color": OCHRE, "linestyle": (0, (5, 1))},
    "frozen": {"label": "as if they stood", "color": WINE, "linestyle": "-."},
}
DEAREST = 1.3  # in parts of theta_init's cost, that is drawn
ROW = 0.55  # height of a fault [inches]
AROUND = np.array([0.6, 2.0])  # of the map, beyond every way [m]


@page
def models(saved: pd.DataFrame) -> Drawn:
    """Which share of theta_init's cost is saved where the model is wrong.

    Args:
        saved: by policy of `OWN`, a row a fault and layout.
    """
    faults = [*saved.index.unique(0)]
    figure, axes = subplots(height=ROW * len(faults) + 1.5)
    for k, (how, look) in enumerate(OWN.items()):
        for fault, each in saved[how].dropna().groupby(level=0, sort=False):
            mean = interquartile_mean(each.to_numpy(), ["all"] * len(each))
            row = faults.index(fault) + 0.18 * (k - 1.5)
            interval(axes, row, mean, **(look | {"label": None}))
        axes.plot([], [], linestyle="", **look)
    axes.axvline(0, **LIMIT)
    axes.set_yticks(range(len(faults)), [FAULTS[fault] for fault in faults])
    axes.set(xlabel=r"saved of the cost of $\theta_\mathrm{init}$", ylim=(len(faults) - 0.5, -0.5))
    axes.xaxis.set_major_formatter(PercentFormatter(1, 0))
    below(figure, axes.get_legend_handles_labels()[0])
    perfect, by_grid = (signed(-one) for one in saved[["oracle", "grid"]].median())
    changed = rf"The true model changes the cost by {perfect}, a grid over $\theta_c$ by {by_grid}"
    return titled(figure, changed)


@page
def shifts(shares: Mapping[str, Sequence[Sequence[float]]], change: int) -> Drawn:
    """What each arm costs before and after the one change, beside replanning with theta_init.

    Args:
        shares: by arm of `ARMS`, the cost over that of theta_init in the same layout every `EVERY`
            episodes; a sequence a run.
        change: the episode that brings it.
    """
    figure, axes = subplots(height=3.3)
    axes.axhline(1, **LIMIT)
    axes.axvline(change, **LIMIT)
    runs = {arm: np.array([*shares[arm]], float) for arm in ARMS}
    for arm, look in ARMS.items():
        episodes = EVERY * np.arange(1, runs[arm].shape[1] + 1)
        quartiles = np.quantile(runs[arm], (0.25, 0.75), axis=0, method="inverted_cdf")
        axes.fill_between(episodes, *quartiles, color=look["color"], alpha=0.15, linewidth=0)
        axes.plot(episodes, np.median(runs[arm], axis=0), **look)
    axes.yaxis.set_major_formatter(PercentFormatter(1, 0))
    ylabel = r"cost over that of $\theta_\mathrm{init}$"
    axes.set(ylabel=ylabel, xlim=(0, episodes[-1]), ylim=(None, DEAREST))
    over_episodes(axes)
    below(figure, axes.get_legend_handles_labels()[0])
    told, never = (np.median(runs[arm][:, -1]) for arm in ("ES told plain", "ES never plain"))
    return titled(
        figure,
        f"At the end ES costs {told:.0%} of replanning without learning if it knows of the"
        f" change, and {never:.0%} if it does not",
    )


@page
def views(motions: Sequence[Motion], seen: Mapping[str, Encounters]) -> Drawn:
    """Maps of two views, and how near the robot comes to an obstacle with all three.

    The maps show the moment at which a robot is deepest in an obstacle, or nearest to one.

    Args:
        motions: of the obstacles.
        seen: by view, the episode in which the obstacles were seen so.
    """
    figure = Drawn(4.6)
    panels = figure.subplot_mosaic(
        [["extrapolated", "frozen"], ["near", "near"]], height_ratios=(1.6, 1)
    )
    at = centres(motions, np.arange(paper.STEPS))
    near = {view: nearest(one, motions) for view, one in seen.items()}
    moment = int(np.argmin(near[min(near, key=lambda view: near[view].min())]))
    ways = {view: one.states[: paper.STEPS, :2] for view, one in seen.items()}
    every = np.vstack([*ways.values()])
    low, high = every.min(axis=0) - AROUND, every.max(axis=0) + AROUND
    for view in ("extrapolated", "frozen"):
        panels[view].set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        panels[view].set(title=SEEN[view]["label"], xlabel="x [m]")
        _map(panels[view], at, ways[view], min(moment, len(ways[view]) - 1), SEEN[view])
    panels["extrapolated"].set_ylabel("y [m]")
    panels["frozen"].tick_params(labelleft=False)
    _distances(panels["near"], near, moment)
    below(figure, panels["near"].get_legend_handles_labels()[0])
    known, extrapolated, frozen = (seen[view].contacts.inside for view in VIEWS)
    return titled(
        figure,
        f"States inside an obstacle: {known} if the motion is known, {extrapolated} if it is"
        f" extrapolated, {frozen} if obstacles are taken as standing",
    )


def _map(axes: Axes, at: Matrix, way: Matrix, moment: int, look: Mapping[str, Any]) -> None:
    """Where everything is at one moment, and its way."""
    radius = TASK.robot_diameter / 2
    for j in range(at.shape[1]):
        axes.plot(*at[:, j].T, color=QUIET, linewidth=0.8, zorder=1)
        disc = Circle(at[moment, j], CLEARANCE / 2 - radius, fc="#CFCFCF", ec="#8A8A8A", zorder=2)
        axes.add_patch(disc)
    axes.plot(*way.T, linewidth=1.8, zorder=3, **look)
    axes.add_patch(Circle(way[moment], radius, fc=look["color"], ec="white", lw=0.8, zorder=4))
    axes.plot(*TASK.target[:2], "*", color=INK, ms=9, zorder=3)


def _distances(axes: Axes, near: Mapping[str, Vector], moment: int) -> None:
    """The distance to the nearest obstacle over time."""
    seconds = PERIOD * np.arange(paper.STEPS)
    axes.axhspan(min(one.min() for one in near.values()) - 0.1, 0, **BAND)
    for view, distances in near.items():
        points, now = np.c_[seconds[: len(distances)], distances], min(moment, len(distances) - 1)
        axes.plot(*points.T, **SEEN[view])
        axes.plot(*points[now], "o", color=SEEN[view]["color"], ms=5, clip_on=False)
    axes.set(xlabel="time [s]", ylabel="to the nearest\nobstacle [m]", xlim=(0, seconds[-1]))
    axes.set_title("grey: inside an obstacle")
    axes.margins(y=0)

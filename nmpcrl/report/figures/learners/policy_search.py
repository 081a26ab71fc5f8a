"""Figures of the search for the best theta: what it saves, and where the robot then goes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nmpcrl import Matrix
from nmpcrl.analysis.search import SearchResult
from nmpcrl.analysis.trajectory import describe
from nmpcrl.report.figures.axes import below, draw_task, map_grid
from nmpcrl.report.figures.style import LOOKS, TEAL, WINE, headed, page, subplots
from nmpcrl.study import paper

WAYS: dict[str, dict[str, Any]] = {
    "init": {"color": "0.45", "linestyle": ":"},
    "learned": LOOKS["GES"].line,
    "by hand": {"color": TEAL, "linestyle": (0, (3, 1, 1, 1))},
    "best": {"color": WINE, "linestyle": "-"},
}
NAMES = {
    "init": r"$\theta_\mathrm{init}$",
    "learned": "learned",
    "by hand": r"only $\theta_c = d_o$",
    "best": "best found",
}


@page
def searches(found: Mapping[str, SearchResult]) -> Figure:
    """The lowest noise-free cost so far over the rollouts of each search, by layout."""
    figure, axes = subplots(height=3.0)
    greys = np.linspace(0.0, 0.55, len(found))
    ends = {layout: one.cost / one.initial for layout, one in found.items()}
    for one, shade in zip(found.values(), greys, strict=True):
        share = np.array([*one.best, one.cost]) / one.initial
        axes.step([*one.rollouts, one.made], share, where="post", color=str(shade), linewidth=1.2)
    for layout, y in _spaced(ends, 0.06 * (1 - min(ends.values()))).items():
        axes.annotate(f"  {layout}", (max(one.made for one in found.values()), y), va="center")
    axes.set(xlabel="rollouts without noise", ylabel="lowest cost / first", xscale="log")
    gains = [one.gain for one in found.values()]
    return headed(figure, f"The search reduces the cost by {min(gains):.0%} to {max(gains):.0%}")


@page
def trajectories(rollouts: Mapping[str, Mapping[str, Matrix]]) -> Figure:
    """Rollouts without noise in each layout; a cross where one ends that does not arrive.

    Args:
        rollouts: states, shape (K + 1, n), by layout and by what is in `WAYS`.
    """
    figure, maps, grid = map_grid(list(rollouts), 2.0, 0.6)
    for name, ways in rollouts.items():
        axes = maps[name]
        draw_task(axes, paper.task(name), labels=False)
        for way, states in ways.items():
            axes.plot(*states[:, :2].T, linewidth=1.4, **WAYS[way])
            if not _arrives(states, name):
                place = states[np.isfinite(states).all(axis=1)][-1, :2]
                axes.plot(*place, "X", color=WAYS[way]["color"], markersize=6)
        axes.set_title(name, fontsize="medium")
    grid[0, 0].set_ylim(-3.0, 6.0)
    figure.supylabel("y [m]", fontsize="medium")
    for axes in grid[-1]:
        axes.set_xlabel("x [m]")
    handles = [Line2D([], [], label=NAMES[way], **look) for way, look in WAYS.items()]
    below(figure, handles)
    arrived = {
        way: sum(_arrives(ways[way], name) for name, ways in rollouts.items()) for way in WAYS
    }
    return headed(
        figure,
        f"Arrived, of {len(rollouts)} layouts: {arrived['learned']} after learning,"
        rf" {arrived['by hand']} with $\theta_c = d_o$ alone, {arrived['best']} at best",
    )


def _arrives(states: Matrix, layout: str) -> bool:
    """Whether a rollout in a layout ends at the target."""
    return bool(np.isfinite(describe(states, paper.task(layout), 1.0).arrival))


def _spaced(ends: Mapping[str, float], least: float) -> dict[str, float]:
    """Where labels go, from the lowest up: at their ends, but `least` above the one below."""
    heights, floor = {}, -np.inf
    for name, end in sorted(ends.items(), key=lambda pair: pair[1]):
        heights[name] = floor = max(end, floor + least)
    return heights

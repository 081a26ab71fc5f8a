"""Where the robot goes with the best theta that was found, beside others."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nmpcrl import Matrix
from nmpcrl.analysis.trajectory import describe
from nmpcrl.report.figures.axes import below, draw_task, map_grid
from nmpcrl.report.figures.style import LOOKS, TEAL, WINE, headed, page
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
        f"The robot arrives in {arrived['learned']} of {len(rollouts)} layouts after learning, in"
        rf" {arrived['by hand']} with $\theta_c = d_o$ alone, in {arrived['best']} at best",
    )


def _arrives(states: Matrix, layout: str) -> bool:
    """Whether a rollout in a layout ends at the target."""
    return bool(np.isfinite(describe(states, paper.task(layout), 1.0).arrival))

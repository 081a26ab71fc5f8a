"""What to try first: the share of the possible gain of each method, and its paths."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.lines import Line2D

from nmpcrl import Matrix
from nmpcrl.analysis.statistics import Estimate
from nmpcrl.analysis.trajectory import describe
from nmpcrl.report.figures.axes import draw_task, interval, panels, rows
from nmpcrl.report.figures.style import (
    AT_ONE,
    INK,
    LIMIT,
    LOOKS,
    TEAL,
    WINE,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.studies.remedies import ADVISED, PARTS
from nmpcrl.study import paper

LEAST, MOST = -1.0, 1.15  # shares that are drawn; what is lower ends in an arrow
WAYS: dict[str, dict[str, Any]] = {  # of a robot
    "init": {"color": "0.45", "linestyle": ":", "label": r"$\theta_\mathrm{init}$"},
    "learned": LOOKS["GES"].line | {"label": "learned"},
    "by hand": {"color": TEAL, "linestyle": (0, (3, 1, 1, 1)), "label": r"only $\theta_c = d_o$"},
    "best": {"color": WINE, "linestyle": "-", "label": "best found"},
}


@page
def gains(advised: pd.DataFrame, finding: str) -> Drawn:
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
            mark = "<" if share.value < LEAST else "o"
            shown = Estimate(*np.clip([share.value, share.low, share.high], LEAST, MOST))
            look = {"color": INK, "mfc": face, "marker": mark, "clip_on": False}
            interval(axes, [*words].index(entry) + shift, shown, **look)
        label = f"{PARTS[part].episodes} episodes"
        axes.plot([], [], "o", color=INK, mfc=face, label=label)
    rows(axes, [f"{entry}: {word}" for entry, word in words.items()])
    axes.set(xlim=(LEAST, MOST), xlabel="share of the possible gain")
    return titled(figure, finding, legend=axes)


@page
def trajectories(rollouts: Mapping[str, Mapping[str, Matrix]]) -> Drawn:
    """Rollouts without noise in each layout; a cross where one ends that does not arrive.

    Args:
        rollouts: states, shape (K + 1, n), by layout and by what is in `WAYS`.
    """
    figure, by_layout = panels(list(rollouts), 2.0, 0.6)
    arrived = dict.fromkeys(WAYS, 0)
    for name, ways in rollouts.items():
        axes, task = by_layout[name], paper.task(name)
        draw_task(axes, task, labels=False)
        for way, states in ways.items():
            axes.plot(*states[:, :2].T, linewidth=1.4, **WAYS[way])
            if np.isfinite(describe(states, task, 1.0).arrival):
                arrived[way] += 1
            else:
                place = states[np.isfinite(states).all(axis=1)][-1, :2]
                axes.plot(*place, "X", color=WAYS[way]["color"], markersize=6)
        axes.set_ylim(-3.0, 6.0)
    title = (
        f"The robot arrives in {arrived['learned']} of {len(rollouts)} layouts after learning, in"
        rf" {arrived['by hand']} with $\theta_c = d_o$ alone, in {arrived['best']} at best"
    )
    return titled(figure, title, legend=[Line2D([], [], **look) for look in WAYS.values()])

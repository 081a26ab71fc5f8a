"""What to try first: the share of the possible gain of each method, its price, and its paths."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter

from nmpcrl import Matrix
from nmpcrl.analysis.statistics import Estimate
from nmpcrl.analysis.suite import Judgement
from nmpcrl.analysis.trajectory import describe
from nmpcrl.report.figures.axes import below, draw_task, interval, maps
from nmpcrl.report.figures.style import (
    AT_ONE,
    INK,
    LIMIT,
    LOOKS,
    OCHRE,
    TEAL,
    WINE,
    Drawn,
    Look,
    page,
    subplots,
    titled,
)
from nmpcrl.studies.remedies import ADVISED, PARTS
from nmpcrl.study import paper

LINES = (  # of entries that are no learner of the study
    Look(TEAL, "-", "D"), Look(OCHRE, (0, (6, 2)), "s"), Look("#332288", "-.", "^"),
    Look(INK, ":", "v"), Look("#8C5A2B", "--", "P"),
)  # fmt: skip
DEAREST = 1.1  # cost in parts of the start's that is drawn; what is dearer stands at the edge
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
    names = [f"{entry}: {word}" for entry, word in words.items()]
    axes.set_yticks(range(len(words)), names, fontsize="small")
    axes.set(xlim=(LEAST, MOST), ylim=(len(words) - 0.4, -0.6))
    axes.set(xlabel="share of the possible gain")
    below(figure, axes.get_legend_handles_labels()[0])
    return titled(figure, finding)


@page
def by_budget(budgets: Sequence[int], returned: Mapping[str, Sequence[Judgement]]) -> Drawn:
    """One line an entry: the cost of what it returns, in parts of theta_init's, over the budget.

    Args:
        budgets: in episodes.
        returned: by the name of the entry, one for each budget.
    """
    figure, axes = subplots()
    axes.axhline(1, **LIMIT)
    looks, last = cycle(LINES), {}
    above: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "fontsize": "small"}
    for name, each in returned.items():
        look = LOOKS.get(name) or next(looks)
        costs = np.array([one.cost / one.initial for one in each])
        drawn, last[name] = np.minimum(costs, DEAREST), costs[-1]
        axes.plot(budgets, drawn, label=name, marker=look.marker, markersize=4, **look.line)
        away = np.flatnonzero([not one.arrived for one in each])
        axes.plot(np.array(budgets)[away], drawn[away], "x", color=WINE, markersize=9, zorder=3)
        for budget, cost in zip(budgets, costs, strict=True):
            if cost > DEAREST:
                axes.annotate(f"{cost:.0%}", (budget, DEAREST), (0, 6), **above)
    ylabel = r"cost over that of $\theta_\mathrm{init}$"
    axes.set(xlabel="episodes spent", ylabel=ylabel, xscale="log")
    axes.set_xticks(budgets, [f"{one}" for one in budgets])
    axes.minorticks_off()
    axes.yaxis.set_major_formatter(PercentFormatter(1, 0))
    axes.legend(fontsize="small")
    best = min(last, key=lambda name: last[name])
    title = f"With {budgets[-1]} episodes {best} costs least: {last[best]:.0%} of the start's cost"
    return titled(figure, title)


@page
def trajectories(rollouts: Mapping[str, Mapping[str, Matrix]]) -> Drawn:
    """Rollouts without noise in each layout; a cross where one ends that does not arrive.

    Args:
        rollouts: states, shape (K + 1, n), by layout and by what is in `WAYS`.
    """
    figure, by_layout = maps(list(rollouts), 2.0, 0.6)
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
    below(figure, [Line2D([], [], **look) for look in WAYS.values()])
    return titled(
        figure,
        f"The robot arrives in {arrived['learned']} of {len(rollouts)} layouts after learning, in"
        rf" {arrived['by hand']} with $\theta_c = d_o$ alone, in {arrived['best']} at best",
    )

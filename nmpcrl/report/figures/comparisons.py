"""Methods beside each other: what to try first, and what helps where the world is another."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.lines import Line2D

from nmpcrl import Matrix
from nmpcrl.analysis.encounters import Encounters
from nmpcrl.analysis.statistics import Estimate, interquartile_mean
from nmpcrl.analysis.trajectory import describe
from nmpcrl.report.figures.axes import draw_task, interval, over_episodes, panels, rows
from nmpcrl.report.figures.style import (
    AT_ONE,
    BAND,
    INK,
    LIMIT,
    LOOKS,
    OCHRE,
    TEAL,
    WINE,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.report.worlds import nearest, signed
from nmpcrl.studies.remedies import ADVISED, PARTS
from nmpcrl.studies.shifts import EVERY
from nmpcrl.studies.worlds import VIEWS
from nmpcrl.study import paper
from nmpcrl.study.moving import PERIOD, Motion

LEAST, MOST = -1.0, 1.15  # shares that are drawn; what is lower ends in an arrow
WAYS: dict[str, dict[str, Any]] = {  # of a robot
    "init": {"color": "0.45", "linestyle": ":", "label": r"$\theta_\mathrm{init}$"},
    "learned": LOOKS["GES"].line | {"label": "learned"},
    "by hand": {"color": TEAL, "linestyle": (0, (3, 1, 1, 1)), "label": r"only $\theta_c = d_o$"},
    "best": {"color": WINE, "linestyle": "-", "label": "best found"},
}
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
    rows(axes, [FAULTS[fault] for fault in faults])
    axes.set_xlabel(r"saved of the cost of $\theta_\mathrm{init}$")
    axes.xaxis.set_major_formatter("{x:.0%}")
    perfect, by_grid = (signed(-one) for one in saved[["oracle", "grid"]].median())
    changed = rf"The true model changes the cost by {perfect}, a grid over $\theta_c$ by {by_grid}"
    return titled(figure, changed, legend=axes)


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
    axes.yaxis.set_major_formatter("{x:.0%}")
    ylabel = r"cost over that of $\theta_\mathrm{init}$"
    axes.set(ylabel=ylabel, xlim=(0, episodes[-1]), ylim=(None, DEAREST))
    over_episodes(axes)
    told, never = (np.median(runs[arm][:, -1]) for arm in ("ES told plain", "ES never plain"))
    title = (
        f"At the end ES costs {told:.0%} of replanning without learning if it knows of the"
        f" change, and {never:.0%} if it does not"
    )
    return titled(figure, title, legend=axes)


@page
def views(motions: Sequence[Motion], seen: Mapping[str, Encounters]) -> Drawn:
    """How near the robot comes to an obstacle in one scenario, with each view.

    Args:
        motions: of the obstacles.
        seen: by view, the episode in which the obstacles were seen so.
    """
    figure, axes = subplots(height=2.8)
    for view, one in seen.items():
        distances = nearest(one, motions)
        axes.plot(PERIOD * np.arange(len(distances)), distances, **SEEN[view])
    axes.margins(y=0.04)
    axes.axhspan(min(0, axes.get_ylim()[0]), 0, **BAND)
    axes.set(xlabel="time [s]", ylabel="to the nearest\nobstacle [m]")
    axes.set(xlim=(0, PERIOD * (paper.STEPS - 1)), title="grey: inside an obstacle")
    known, extrapolated, frozen = (seen[view].contacts.inside for view in VIEWS)
    title = (
        f"States inside an obstacle: {known} if the motion is known, {extrapolated} if it is"
        f" extrapolated, {frozen} if obstacles are taken as standing"
    )
    return titled(figure, title, legend=axes)

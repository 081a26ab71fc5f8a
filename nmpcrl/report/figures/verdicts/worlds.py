"""Worlds that move, change, or are not the model: what a view, a policy and learning are worth."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from nmpcrl import Matrix
from nmpcrl.analysis.statistics import Estimate, interquartile_mean
from nmpcrl.report.figures.axes import below, over_episodes
from nmpcrl.report.figures.style import (
    INK,
    LIMIT,
    TEAL,
    WINE,
    headed,
    page,
    subplots,
)
from nmpcrl.report.worlds import signed
from nmpcrl.studies.shifts import EVERY

OWN: Mapping[str, tuple[str, str, str]] = {  # of a wrong model: label, colour, mark
    "oracle": ("true model", INK, "s"),
    "ES": ("ES", "#0072B2", "o"),
    "ES+model": ("ES, model learned, too", "#B37A00", "^"),
    "grid": (r"grid over $\theta_c$", TEAL, "D"),
}
FAULTS = {  # as a figure names them
    "speed": "speed lost", "turn": "turns too much", "drift": "drift", "slip": "wheels slip",
    "lag": "lag", "noise": "measurement noise",
}  # fmt: skip
ARMS: Mapping[str, tuple[str, dict[str, Any]]] = {  # label and look
    "ES told plain": ("ES, knows of it", {"color": "#0072B2", "linestyle": "-"}),
    "ES told reset": ("ES, begun anew", {"color": TEAL, "linestyle": (0, (5, 1))}),
    "ES never plain": ("ES, never knows", {"color": WINE, "linestyle": "-."}),
    "frozen never plain": (
        r"$\theta_\mathrm{init}$, never knows", {"color": INK, "linestyle": ":"}
    ),
}  # fmt: skip
DEAREST = 1.3  # in parts of theta_init's cost, that is drawn
SIZE, ROW = 5.0, 0.55  # of a mark [points], and of a row [inches]


@page
def models(saved: pd.DataFrame) -> Figure:
    """Which share of theta_init's cost is saved where the model is wrong.

    Args:
        saved: by policy of `OWN`, a row a fault and layout.
    """
    faults = [*saved.index.unique(0)]
    figure, axes = subplots(height=ROW * len(faults) + 1.5)
    for k, (how, (label, colour, mark)) in enumerate(OWN.items()):
        known = saved[how].dropna().groupby(level=0, sort=False)
        rows = np.array([faults.index(fault) for fault, _ in known])
        look = {"color": colour, "marker": mark, "label": label}
        _marks(axes, rows + 0.18 * (k - 1.5), [_middle(each) for _, each in known], look)
    axes.axvline(0, **LIMIT)
    axes.set_yticks(range(len(faults)), [FAULTS[fault] for fault in faults])
    axes.set(xlabel=r"saved of the cost of $\theta_\mathrm{init}$", ylim=(len(faults) - 0.5, -0.5))
    axes.xaxis.set_major_formatter(PercentFormatter(1, 0))
    below(figure, axes.get_legend_handles_labels()[0])
    perfect, by_grid = saved[["oracle", "grid"]].median()
    changed = rf"The true model changes the cost by {signed(-perfect)}, a grid over $\theta_c$ by"
    return headed(figure, f"{changed} {signed(-by_grid)}")


@page
def shifts(shares: Mapping[str, Sequence[Sequence[float]]], change: int) -> Figure:
    """What each arm costs before and after the one change, beside replanning with theta_init.

    Args:
        shares: by arm of `ARMS`, the cost over that of theta_init in the same layout every `EVERY`
            episodes; a sequence a run.
        change: the episode that brings it.
    """
    figure, axes = subplots(height=3.3)
    axes.axhline(1, **LIMIT)
    axes.axvline(change, **LIMIT)
    for arm, (label, look) in ARMS.items():
        _course(axes, np.array([*shares[arm]], float), label, look)
    axes.yaxis.set_major_formatter(PercentFormatter(1, 0))
    axes.set(ylabel=r"cost over that of $\theta_\mathrm{init}$", ylim=(None, DEAREST))
    over_episodes(axes)
    below(figure, axes.get_legend_handles_labels()[0])
    told, never = (float(np.median([run[-1] for run in shares[arm]]))
                   for arm in ("ES told plain", "ES never plain"))  # fmt: skip
    return headed(
        figure,
        f"At the end ES costs {told:.0%} of replanning without learning if it knows of the"
        f" change, and {never:.0%} if it does not",
    )


def _course(axes: Axes, runs: Matrix, label: str, look: dict[str, Any]) -> None:
    """The median of some runs over the episodes, and a band from quartile to quartile."""
    low, high = np.quantile(runs, (0.25, 0.75), axis=0, method="inverted_cdf")
    values = np.median(runs, axis=0)
    episodes = EVERY * np.arange(1, len(values) + 1)
    axes.fill_between(episodes, low, high, color=look["color"], alpha=0.15, linewidth=0)
    axes.plot(episodes, values, label=label, **look)
    axes.set_xlim(0, episodes[-1])


def _marks(axes: Axes, rows: Any, estimates: Sequence[Estimate], look: dict[str, Any]) -> None:
    values, low, high = np.array([(one.value, one.low, one.high) for one in estimates]).T
    axes.hlines(rows, low, high, color=look["color"], linewidth=1.6)
    axes.plot(values, rows, linestyle="", markersize=SIZE, **look)


def _middle(scores: pd.Series) -> Estimate:
    """The interquartile mean over places."""
    known = scores.dropna()
    return interquartile_mean(known.to_numpy(), ["all"] * len(known))

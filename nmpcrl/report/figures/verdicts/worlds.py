"""Worlds that move, change, or are not the model: what a view, a policy and learning are worth."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator, PercentFormatter

from nmpcrl import Matrix
from nmpcrl.analysis.statistics import Estimate, interquartile_mean, rate
from nmpcrl.report.figures.axes import below, over_episodes
from nmpcrl.report.figures.style import (
    INK,
    LIMIT,
    SUBTITLE,
    TEAL,
    VIEW_LINES,
    VIEW_TITLES,
    WINE,
    headed,
    page,
    subplots,
)
from nmpcrl.report.worlds import signed
from nmpcrl.studies.shifts import EVERY
from nmpcrl.studies.worlds import VIEWS

POLICIES = {  # by arm
    "init": r"$\theta_\mathrm{init}$", "ES": "ES", "grid": r"grid over $\theta_c$",
    "CMA-ES": "CMA-ES",
}  # fmt: skip
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
ARMS: Mapping[str, Mapping[str, tuple[str, dict[str, Any]]]] = {  # by panel: label and look
    "told of the change": {
        "ES told plain": ("ES", {"color": "#0072B2", "linestyle": "-"}),
        "ES told reset": (r"ES, $\theta$ reset", {"color": TEAL, "linestyle": (0, (5, 1))}),
        "RDES told plain": ("RDES", {"color": "#B37A00", "linestyle": (0, (2, 1))}),
    },
    "never told": {
        "ES never plain": ("ES, never told", {"color": WINE, "linestyle": "-."}),
        "frozen never plain": (
            r"$\theta_\mathrm{init}$, never told", {"color": INK, "linestyle": ":"},
        ),
    },
}  # fmt: skip
SIZE, ROW = 5.0, 0.55  # of a mark [points], and of a row [inches]


@page
def policies(costs: pd.DataFrame, met: pd.DataFrame) -> Figure:
    """What each policy costs under each view, and in how many scenarios the robot gets inside.

    Args:
        costs: of `worlds.means`, a row a scenario and a column an arm.
        met: the share of the seeds in which the robot gets into an obstacle, in the same form.
    """
    figure, (left, right) = subplots(
        1, 2, across=1, sharey=True, tall=2 * ROW * len(POLICIES) + 2.2
    )
    ratios = costs.div(costs["known init"], axis=0)
    for k, view in enumerate(VIEWS):
        place = np.arange(len(POLICIES)) + 0.22 * (k - 1)
        arms = [f"{view} {how}" for how in POLICIES]
        look = {"color": VIEW_LINES[view]["color"], "marker": "osD"[k], "label": VIEW_TITLES[view]}
        _marks(left, place, [_middle(ratios[arm]) for arm in arms], look)
        _marks(right, place, [rate(_inside(met[arm]), len(met)) for arm in arms], look)
    left.axvline(1, **LIMIT)
    left.set_yticks(range(len(POLICIES)), [*POLICIES.values()])
    left.set(xlabel="cost", ylim=(len(POLICIES) - 0.5, -0.5))
    left.set_title(r"over $\theta_\mathrm{init}$ that knows the motion", **SUBTITLE)
    right.set_title("scenarios with the robot inside an obstacle", **SUBTITLE)
    for axes in (left, right):
        axes.xaxis.set_major_formatter(PercentFormatter(1, 0))
    left.xaxis.set_major_locator(MultipleLocator(0.05))
    right.set(xlim=(-0.03, 1.03), xlabel=f"of {len(met)} scenarios")
    below(figure, left.get_legend_handles_labels()[0])
    grid, es = (
        1 - (costs[f"extrapolated {how}"] / costs["extrapolated init"]).median()
        for how in ("grid", "ES")
    )
    ends = {how: _inside(met[f"extrapolated {how}"]) for how in ("grid", "ES", "init")}
    return headed(
        figure,
        rf"With extrapolation, a grid over $\theta_c$ saves {grid:.0%} and ES {es:.0%}; the robot"
        f" is inside in {ends['grid']} and {ends['ES']} scenarios instead of {ends['init']}",
    )


@page
def survival(crowding: pd.Series, met: pd.DataFrame, correlation: float) -> Figure:
    """In which share of the scenarios the robot stays out of obstacles, by how crowded they are.

    Args:
        crowding: of `encounters.crowding`, by scenario.
        met: as `policies` has it.
        correlation: of the ranks of crowding and of states inside, with extrapolation.
    """
    figure, panels = subplots(1, 2, across=1, sharey=True, tall=4.8)
    thirds = pd.qcut(crowding.rank(method="first"), 3, labels=False)
    middles = crowding.groupby(thirds).median()
    for axes, how in zip(panels, ("init", "ES"), strict=True):
        for k, view in enumerate(VIEWS):
            out = met[f"{view} {how}"].loc[crowding.index] <= 0.5
            shares = [rate(int(one.sum()), len(one)) for _, one in out.groupby(thirds)]
            values, low, high = np.array([(one.value, one.low, one.high) for one in shares]).T
            x = middles + 0.004 * (k - 1)
            axes.vlines(x, low, high, color=VIEW_LINES[view]["color"], linewidth=1.4)
            axes.plot(x, values, marker="osD"[k], markersize=SIZE, label=VIEW_TITLES[view],
                      **VIEW_LINES[view])  # fmt: skip
        axes.set(xlabel="space and time that obstacles take", ylim=(-0.03, 1.03))
        axes.set_title(POLICIES[how], **SUBTITLE)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(PercentFormatter(1, 0))
    panels[0].set_ylabel("scenarios without\nan encounter")
    below(figure, panels[0].get_legend_handles_labels()[0])
    return headed(
        figure,
        "More crowded scenarios have more states inside an obstacle: rank correlation"
        f" {correlation:.2f}, with extrapolation",
    )


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
        shares: by arm of `ARMS`, the cost over that of theta_init, told, in the same layout, every
            `EVERY` episodes; a sequence a run.
        change: the episode that brings it.
    """
    figure, panels = subplots(1, len(ARMS), 3.3)
    for axes, (title, arms) in zip(panels, ARMS.items(), strict=True):
        axes.axhline(1, **LIMIT)
        axes.axvline(change, **LIMIT)
        for arm, (label, look) in arms.items():
            _course(axes, np.array([*shares[arm]], float), label, look)
        axes.yaxis.set_major_formatter(PercentFormatter(1, 0))
        axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        axes.set_title(title, **SUBTITLE)
        over_episodes(axes)
    panels[0].set_ylabel(r"cost over $\theta_\mathrm{init}$, told")
    below(figure, [line for axes in panels for line in axes.get_legend_handles_labels()[0]])
    told, never = (float(np.median([run[-1] for run in shares[arm]]))
                   for arm in ("ES told plain", "ES never plain"))  # fmt: skip
    return headed(
        figure,
        f"At the end ES costs {told:.0%} of replanning without learning if it is told of the"
        f" change, and {never:.0%} if it never is",
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


def _inside(met: pd.Series) -> int:
    """In how many scenarios the robot gets inside with more than half of the seeds."""
    return int((met > 0.5).sum())

"""Worlds that move, change, or are not the model: what a view, a policy and learning are worth."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator, PercentFormatter

from nmpcrl.analysis.statistics import Estimate, interquartile_mean, rate
from nmpcrl.analysis.worlds import EVERY
from nmpcrl.claims.world_questions import VIEWS
from nmpcrl.report.figures.axes import below, over_episodes
from nmpcrl.report.figures.runs.moving import LINES, TITLES
from nmpcrl.report.figures.style import INK, LIMIT, SUBTITLE, TEAL, WINE, headed, page, subplots

POLICIES = {  # by arm
    "init": r"$\theta_\mathrm{init}$", "ES": "ES", "grid": r"$\theta_c$ by hand",
    "CMA-ES": "CMA-ES",
}  # fmt: skip
OWN: Mapping[str, tuple[str, str, str]] = {  # of a wrong model: label, colour, mark
    "oracle": ("true model", INK, "s"),
    "ES": ("ES", "#0072B2", "o"),
    "ES+model": ("ES, model learned, too", "#B37A00", "^"),
    "grid": (r"$\theta_c$ by hand", TEAL, "D"),
}
FAULTS = {  # as a figure names them
    "speed": "speed lost", "turn": "turns too much", "drift": "drift", "slip": "wheels slip",
    "lag": "lag", "noise": "measurement noise",
}  # fmt: skip
ARMS: Mapping[str, tuple[str, dict[str, Any]]] = {  # that are shown after a change
    "ES told plain": ("ES, told", {"color": "#0072B2", "linestyle": "-"}),
    "ES told reset": (r"ES, told, $\theta$ reset", {"color": TEAL, "linestyle": (0, (5, 1))}),
    "ES never plain": ("ES, never told", {"color": WINE, "linestyle": "-."}),
    "frozen never plain": (r"$\theta_\mathrm{init}$, never told", {"color": INK, "linestyle": ":"}),
}
SIZE, ROW = 5.0, 0.55  # of a mark [points], and of a row [inches]


@page
def policies(costs: pd.DataFrame, met: pd.DataFrame) -> Figure:
    """What each policy costs under each view, and in how many scenarios the robot gets inside.

    Args:
        costs: of `claims.world.means`, a row a scenario and a column an arm.
        met: the share of the seeds in which the robot gets into an obstacle, in the same form.
    """
    figure, (left, right) = subplots(1, 2, ROW * len(POLICIES) + 1.5, sharey=True, tall=5.0)
    ratios = costs.div(costs["known init"], axis=0)
    for k, view in enumerate(VIEWS):
        place = np.arange(len(POLICIES)) + 0.22 * (k - 1)
        arms = [f"{view} {how}" for how in POLICIES]
        look = {"color": LINES[view]["color"], "marker": "osD"[k], "label": TITLES[view]}
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
        rf"With extrapolation, $\theta_c$ by hand saves {grid:.0%} and ES {es:.0%}; the robot gets"
        f" inside in {ends['grid']} and {ends['ES']} scenarios instead of {ends['init']}",
    )


@page
def models(saved: Mapping[str, Mapping[str, pd.Series]]) -> Figure:
    """Which share of theta_init's cost is saved where the model is wrong.

    Args:
        saved: by fault and by policy of `OWN`, the share in each layout.
    """
    figure, axes = subplots(height=ROW * len(saved) + 1.5)
    for k, (how, (label, colour, mark)) in enumerate(OWN.items()):
        rows = [y for y, fault in enumerate(saved) if how in saved[fault]]
        estimates = [_middle(by[how]) for by in saved.values() if how in by]
        look = {"color": colour, "marker": mark, "label": label}
        _marks(axes, np.array(rows) + 0.18 * (k - 1.5), estimates, look)
    axes.axvline(0, **LIMIT)
    axes.set_yticks(range(len(saved)), [FAULTS[fault] for fault in saved])
    axes.set(xlabel=r"saved of the cost of $\theta_\mathrm{init}$", ylim=(len(saved) - 0.5, -0.5))
    axes.xaxis.set_major_formatter(PercentFormatter(1, 0))
    below(figure, axes.get_legend_handles_labels()[0])
    perfect, by_hand = (
        pd.concat([by[how] for by in saved.values() if how in by]).median()
        for how in ("oracle", "grid")
    )
    finding = (
        rf"The true model changes the cost by {-perfect:+.1%}, $\theta_c$ by hand by"
        f" {-by_hand:+.1%}"
    )
    return headed(figure, finding.replace("-", "−"))


@page
def shifts(shares: Mapping[str, Iterable[Sequence[float]]], change: int) -> Figure:
    """What each arm costs before and after the one change, beside replanning with theta_init.

    Args:
        shares: by arm of `ARMS`, the cost over that of theta_init, told, in the same layout, every
            `EVERY` episodes; a sequence a run.
        change: the episode that brings it.
    """
    figure, axes = subplots(height=3.4)
    axes.axhline(1, **LIMIT)
    axes.axvline(change, **LIMIT)
    for arm, runs in shares.items():
        label, look = ARMS[arm]
        each = np.array([*runs], float)
        estimates = [_middle(pd.Series(column)) for column in each.T]
        episodes = EVERY * np.arange(1, len(estimates) + 1)
        axes.plot(episodes, [one.value for one in estimates], label=label, **look)
        low, high = ([getattr(one, end) for one in estimates] for end in ("low", "high"))
        axes.fill_between(episodes, low, high, color=look["color"], alpha=0.15, linewidth=0)
    over_episodes(axes)
    axes.set(ylabel=r"cost over $\theta_\mathrm{init}$, told", xlim=(0, episodes[-1]))
    axes.yaxis.set_major_formatter(PercentFormatter(1, 0))
    below(figure, axes.get_legend_handles_labels()[0])
    ends = {
        arm: _middle(pd.Series([run[-1] for run in runs])).value for arm, runs in shares.items()
    }
    told, never = ends["ES told plain"], ends["ES never plain"]
    return headed(
        figure,
        f"At the end ES costs {told:.0%} of replanning without learning if it is told of the"
        f" change, and {never:.0%} if it never is",
    )


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

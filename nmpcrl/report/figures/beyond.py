"""Figures of chapter 7: exact TDC, learners to hold the paper's against, and the best theta."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter

from nmpcrl import Matrix
from nmpcrl.analysis.metrics import LAST
from nmpcrl.analysis.policy_search import Found
from nmpcrl.analysis.statistics import interquartile_mean
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.analysis.trajectory import described
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.controller import draw_task
from nmpcrl.report.figures.rdes import headed
from nmpcrl.report.figures.style import LOOKS, marked, page, subplots
from nmpcrl.study import paper

LIMIT: dict[str, Any] = {"color": "0.35", "linewidth": 0.9, "linestyle": (0, (2, 2))}
PARTS: dict[
    str, dict[str, Any]
] = {  # of TDC, each left out in turn; all in its colour but for the printed one
    "TDC": {"linestyle": "-", "linewidth": 2.2},
    "without h": {"linestyle": "--"},
    "not projected": {"linestyle": ":"},
    "slow w": {"linestyle": "-."},
    "GES": LOOKS["GES"].line,
}
WITHOUT = {
    "without h": "Without h",
    "not projected": "Without projection",
    "slow w": "With a slow w",
}
ROADS: dict[str, dict[str, Any]] = {
    "init": {"color": "0.45", "linestyle": ":"},
    "learned": LOOKS["GES"].line,
    "by hand": {"color": "#1B7F79", "linestyle": (0, (3, 1, 1, 1))},
    "best": {"color": "#882255", "linestyle": "-"},
}
NAMES = {
    "init": r"$\theta_\mathrm{init}$",
    "learned": "learned",
    "by hand": r"only $\theta_c = d_o$",
    "best": "best found",
}


@page
def step_of_w(runs: Mapping[float, RunSummary]) -> Figure:
    """beta ||phi||^2 in each episode of TDC, for some beta: what is left of an error of w.

    Args:
        runs: by beta.
    """
    figure, axes = subplots(height=2.9)
    first, lost = "", ""
    for (beta, run), line in zip(runs.items(), ("--", "-", ":"), strict=False):
        size = run.episodes["alpha_phi2"] * beta / run.name.alpha
        episode = np.arange(1, len(size) + 1)
        label = rf"$\beta$ = {_scientific(beta)}"
        axes.plot(episode, size, color=LOOKS["TDC"].color, linestyle=line, label=label)
        over = np.flatnonzero(size > OVERSHOOT)
        if over.size and not first:
            first = f"With {label}, it passes {OVERSHOOT:g} in episode {over[0] + 1}"
            lost = " and w is lost" if run.facts["stopped"] != "finished" else ""
    axes.axhline(OVERSHOOT, **LIMIT)
    axes.set(xlabel="episode", ylabel=r"largest $\beta\,\|\phi\|^2$", ylim=(0, 1.5 * OVERSHOOT))
    axes.legend(loc="lower right")
    return headed(figure, f"{first}{lost}" if first else f"It stays below {OVERSHOOT:g}")


@page
def parts_of_tdc(runs: Mapping[str, RunSummary]) -> Figure:
    """TDC with each of its parts left out: the noise-free cost, and the size of w.

    Args:
        runs: by what is in `PARTS`.
    """
    figure, (left, right) = subplots(1, 2, 3.3)
    for name, run in runs.items():
        look = {"color": LOOKS["TDC"].color} | PARTS[name]
        judged, size = run.evaluations, np.linalg.norm(run.episodes["w"], axis=1)
        left.plot(judged["episode"], judged["cost"] / judged["cost"][0], label=name, **look)
        right.plot(np.arange(1, len(size) + 1), size, **look)
    left.set(xlabel="episode", ylabel="noise-free cost / first")
    right.set(xlabel="episode", ylabel="size of w", yscale="log")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=len(runs))
    moved = {name: _end(runs[name]) - _end(runs["TDC"]) for name in WITHOUT}
    most = max(moved, key=lambda name: abs(moved[name]))
    side = "lower" if moved[most] < 0 else "higher"
    end = f"TDC ends {abs(moved[most]):.1%} of the first cost {side}"
    return headed(figure, f"{WITHOUT[most]}, {end}; no other part does more")


@page
def strips(
    runs: pd.DataFrame,
    values: pd.Series,
    learners: Sequence[str],
    *,
    label: str,
    finding: str,
    mark: str,
    seen: tuple[float, float],
) -> Figure:
    """A share of every run, layout by layout and learner by learner, with interquartile means.

    Args:
        runs: of `summary.table`.
        values: one a run; infinite ones, and what is not `seen`, are drawn at the edge.
        learners: in the order in which they are drawn.
        label: what the share is of.
        finding: the title.
        mark: where the runs come from.
        seen: the lowest and the highest that is drawn.
    """
    layouts = list(runs.layout.unique())
    options = {"sharey": True, "squeeze": False}
    figure, grid = subplots(1, len(layouts), 3.3, **options)
    for axes, layout in zip(grid[0], layouts, strict=True):
        for x, learner in enumerate(learners):
            here = (runs.layout == layout) & (runs.learner == learner) & values.notna()
            _strip(axes, x, learner, runs[here], values[here].clip(*seen))
        axes.axhline(0, **LIMIT)
        axes.set_title(layout, fontsize=9.5)
        axes.set_xticks(range(len(learners)), learners, rotation=90, fontsize=8)
        axes.set_xlim(-0.6, len(learners) - 0.4)
    grid[0, 0].set(ylabel=label, ylim=(seen[0], seen[1]))
    grid[0, 0].yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    return marked(headed(figure, finding), mark)


@page
def searches(found: Mapping[str, Found]) -> Figure:
    """The lowest noise-free cost so far over the drives of each search, by layout."""
    figure, axes = subplots(height=3.0)
    shades = np.linspace(0.0, 0.7, len(found))
    ends = {layout: one.cost / one.initial for layout, one in found.items()}
    for one, shade in zip(found.values(), shades, strict=True):
        share = np.array([*one.best, one.cost]) / one.initial
        axes.step([*one.drives, one.made], share, where="post", color=str(shade), linewidth=1.2)
    for layout, y in _spaced(ends, 0.06 * (1 - min(ends.values()))).items():
        axes.annotate(f"  {layout}", (max(one.made for one in found.values()), y), va="center")
    axes.set(xlabel="drives without noise", ylabel="lowest cost / first", xscale="log")
    gains = [one.gain for one in found.values()]
    return headed(figure, f"The search takes {min(gains):.0%} to {max(gains):.0%} off the cost")


@page
def roads(drives: Mapping[str, Mapping[str, Matrix]]) -> Figure:
    """Drives without noise in each layout; a cross where one ends that does not arrive.

    Args:
        drives: states, shape (K + 1, n), by layout and by what is in `ROADS`.
    """
    rows = -(-len(drives) // 3)
    figure, grid = subplots(rows, 3, 2.0 * rows + 0.6, squeeze=False, sharex=True, sharey=True)
    for axes, (name, ways) in zip(grid.flat, drives.items(), strict=False):
        draw_task(axes, paper.task(name), labels=False)
        for way, states in ways.items():
            axes.plot(*states[:, :2].T, linewidth=1.4, **ROADS[way])
            if not _arrives(states, name):
                place = states[np.isfinite(states).all(axis=1)][-1, :2]
                axes.plot(*place, "X", color=ROADS[way]["color"], markersize=6)
        axes.set_title(name, fontsize=9.5)
    grid[0, 0].set_ylim(-3.0, 6.0)
    for axes in grid.flat[len(drives) :]:
        axes.set_visible(False)
    figure.supylabel("y [m]", fontsize=9)
    for axes in grid[-1]:
        axes.set_xlabel("x [m]")
    handles = [Line2D([], [], label=NAMES[way], **look) for way, look in ROADS.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    arrived = {
        way: sum(_arrives(ways[way], name) for name, ways in drives.items()) for way in ROADS
    }
    return headed(
        figure,
        f"Arrived, of {len(drives)} layouts: {arrived['learned']} after learning,"
        rf" {arrived['by hand']} with $\theta_c = d_o$ alone, {arrived['best']} at best",
    )


def _arrives(states: Matrix, layout: str) -> bool:
    """Whether a drive in a layout ends at the target."""
    return bool(np.isfinite(described(states, paper.task(layout), 1.0).arrival))


def _scientific(value: float) -> str:
    """ "2.5 x 10^-7", as mathematics."""
    mantissa, exponent = f"{value:.1e}".split("e")
    return rf"${mantissa} \cdot 10^{{{int(exponent)}}}$"


def _spaced(ends: Mapping[str, float], least: float) -> dict[str, float]:
    """Where labels go, from the lowest up: at their ends, but `least` above the one below."""
    heights, floor = {}, -np.inf
    for name, end in sorted(ends.items(), key=lambda pair: pair[1]):
        heights[name] = floor = max(end, floor + least)
    return heights


def _strip(axes: Axes, x: int, learner: str, runs: pd.DataFrame, values: pd.Series) -> None:
    """The runs of a learner, hollow if noise decays per episode; their middle, its interval."""
    look = LOOKS[learner]
    for decay, shift in (("step", -0.16), ("episode", 0.16)):
        some = values[runs.decay == decay]
        face = look.color if decay == "step" else "none"
        place = x + shift + np.linspace(-0.1, 0.1, len(some))
        style: dict[str, Any] = {"color": look.color, "markerfacecolor": face, "markersize": 3.5}
        axes.plot(place, some, look.marker, linestyle="", alpha=0.8, **style)
    if len(values):
        middle = interquartile_mean(values.to_numpy(), list(runs.layout))
        axes.plot([x - 0.35, x + 0.35], [middle.value] * 2, color="black", linewidth=1.6)
        axes.plot([x, x], [middle.low, middle.high], color="black", linewidth=1.0)


def _end(run: RunSummary) -> float:
    """Final noise-free cost in shares of the first; infinite if a drive failed."""
    cost = run.evaluations["cost"]
    return float(cost[-LAST:].mean() / cost[0])

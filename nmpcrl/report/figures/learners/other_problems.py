"""Figures of other people's problems: learners and what was possible, solvers, and known truths."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nmpcrl import Vector
from nmpcrl.analysis.statistics import interquartile_mean
from nmpcrl.report.figures.axes import below, jitter
from nmpcrl.report.figures.style import INK, LIMIT, LOOKS, TEAL, WINE, Look, headed, page, subplots
from nmpcrl.studies.other_problems import ARMS, PEERS, WINDOW, Runs

OWN = {
    "LSTD-Q, every step": Look(WINE, (0, (3, 1, 1, 1)), "p"),
    "LSTD-Q, batches of 20": Look(TEAL, (0, (6, 2)), "h"),
    "DPG": Look("#5B5EA6", (0, (1, 1)), "*"),
}
ARM_LOOKS = {arm: OWN.get(arm) or LOOKS[arm] for arm in ARMS}
MOST = 3.0  # largest cost that is drawn
NAMES = {  # of what the learners are compared with, and how far above its line it stands
    "informed": ("knows A, B and the mean of e", 2),
    "best_theta": ("best theta found", 2),
    "best_policy": ("best policy", -10),
}


@page
def courses(found: Runs) -> Figure:
    """Cost of a training step, by arm: interquartile mean of the seeds, with its interval."""
    figure, axes = subplots(height=3.4)
    for arm, look in ARM_LOOKS.items():
        runs = np.array([*found.courses.costs[found.courses.arm == arm]])
        steps = WINDOW * (np.arange(runs.shape[1]) + 0.5)
        estimates = [interquartile_mean(window, ["all"] * len(window)) for window in runs.T]
        value, low, high = (
            np.clip([getattr(one, part) for one in estimates], 0, 10 * MOST)
            for part in ("value", "low", "high")
        )
        axes.fill_between(steps, low, high, color=look.color, alpha=0.15, linewidth=0)
        axes.plot(steps, value, label=arm, **look.line)
    _lines(axes, found.references)
    axes.set(yscale="log", ylim=(0.7 * found.references["best_policy"], MOST))
    axes.set(xlabel="learning step", ylabel="cost of a step [-]")
    below(figure, axes.get_legend_handles_labels()[0])
    return headed(figure, _first(found))


@page
def ends(found: Runs) -> Figure:
    """Cost without noise on the action of each seed's last theta, beside what is possible."""
    figure, axes = subplots(height=3.4)
    for place, (arm, costs) in enumerate(found.tests.items()):
        look, shown = ARM_LOOKS[str(arm)], np.minimum(np.sort(costs.to_numpy()), MOST)
        where = place + jitter(len(costs), 0.3)
        axes.plot(shown, where, look.marker, color=look.color, markersize=3)
        axes.plot(np.median(shown), place, "|", color="black", markersize=20)
    for (name, (label, _)), dashes in zip(NAMES.items(), ("--", "-.", ":"), strict=True):
        value = found.references[name]
        axes.axvline(value, label=label, color="0.35", linewidth=0.9, linestyle=dashes)
    axes.set_yticks(range(len(ARMS)), list(ARMS), fontsize="small")
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="cost of a step [-]")
    axes.set_xlim(0.8 * found.references["best_policy"], 1.3 * MOST)
    below(figure, axes.get_legend_handles_labels()[0])
    lost = int((found.tests >= MOST).sum(axis=None))
    return headed(figure, f"{lost} of {len(found.courses)} runs end at {MOST:g} or more")


def _lines(axes: Axes, references: "pd.Series[float]") -> None:
    """What the learners are compared with."""
    for name, (label, above) in NAMES.items():
        value = references[name]
        axes.axhline(value, **LIMIT)
        axes.annotate(
            label, (0.99, value), (0, above), xycoords=("axes fraction", "data"),
            textcoords="offset points", ha="right", fontsize="small", color="0.35",
        )  # fmt: skip


def _first(found: Runs) -> str:
    """The title: which arm ends lowest, and at how much of what was possible."""
    least = found.medians.idxmin()
    times = found.medians[least] / found.references["best_policy"]
    return f"{least} ends lowest, at {times:.1f} times the cost of the best policy"


@page
def spreads(found: Runs) -> Figure:
    """J of each seed by solver and order, and how a difference in theta grows."""
    figure, (left, right) = subplots(1, 2, across=1, tall=5.2)
    table = found.spreads
    columns = {
        "mpcrl,\nIpopt": table[PEERS[0]],
        "mpcrl,\nIpopt 1e-10": table[PEERS[1]],
        "ours,\nits order": table.before,
        "ours,\nnewest theta": table.after,
    }
    for seed in zip(*columns.values(), strict=True):
        left.plot(range(len(columns)), seed, color="0.55", linewidth=0.6)
    for place, costs in enumerate(columns.values()):
        left.plot(place, np.mean(costs), "_", color=WINE, markersize=24, markeredgewidth=2.5)
    left.set_xticks(range(len(columns)), list(columns), fontsize="small")
    left.set(ylabel="J of 100 steps", title="each seed, and the mean")
    gaps = np.array([*table.gap])
    steps = np.arange(1, gaps.shape[1] + 1)
    low, middle, high = np.quantile(gaps, (0.1, 0.5, 0.9), axis=0)
    right.fill_between(steps, low, high, color=TEAL, alpha=0.2, linewidth=0)
    right.semilogy(steps, middle, color=TEAL)
    right.set(xlabel="learning step", ylabel="difference of theta", title="from 1e-10 on")
    apart = np.abs(np.divide(columns["mpcrl,\nIpopt"], columns["mpcrl,\nIpopt 1e-10"]) - 1)
    order = table.after.mean() / table.before.mean() - 1
    return headed(
        figure,
        f"A tolerance moves J of one seed by up to {apart.max():.0%}, and the order of update and"
        f" action the mean by {order:.0%}",
    )


@page
def gains(paths: Mapping[str, Vector], truth: Vector) -> Figure:
    """The two entries of K that theta plans with, after each episode, and the best K.

    Args:
        paths: by learner, shape (episodes + 1, 2).
        truth: the best K, shape (2,).
    """
    figure, axes = subplots(height=3.1)
    for name, path in paths.items():
        look = ARM_LOOKS.get(name, OWN["LSTD-Q, batches of 20"])
        axes.plot(*path.T, color=look.color, linestyle=look.linestyle, linewidth=1.2)
        axes.plot(*path[-1], look.marker, color=look.color, markersize=7)
    axes.plot(*truth, "+", color=INK, markersize=16, markeredgewidth=1.6)
    axes.set(xlabel="$K_1$", ylabel="$K_2$")
    handles = [
        Line2D([], [], label=name, **ARM_LOOKS.get(name, OWN["LSTD-Q, batches of 20"]).line)
        for name in paths
    ]
    below(figure, [*handles, Line2D([], [], color=INK, marker="+", linestyle="", label="best K")])
    near = min(paths, key=lambda name: float(np.abs(paths[name][-1] - truth).max()))
    return headed(figure, f"{near} ends nearest to the best K")

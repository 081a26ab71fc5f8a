"""Figures of chapter 5 on why runs went wrong: how many for which reason, and one run of each."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims.evidence import Evidence
from nmpcrl.claims.failure_modes import (
    ENDINGS,
    MECHANISMS,
    OVER_PREDICTED,
    WELL,
    Failure,
    rise,
)
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import FEW, over_episodes, plain, stacked
from nmpcrl.report.figures.sheet import sheet
from nmpcrl.report.figures.style import (
    BAND,
    LIMIT,
    LOOKS,
    SUBTITLE,
    TEAL,
    WINE,
    hatched,
    headed,
    marked,
    page,
    subplots,
)
from nmpcrl.study import paper
from nmpcrl.study.records import Column

GOOD = "0.92"  # the grey of what went well
PATTERNS = (  # colour and hatching of what did not: of mechanisms, and of endings
    (("#5C0F3A", ""), (WINE, "//"), ("#A0487A", "--"), ("#BC6F9A", "\\\\"), (WINE, "xx")),
    (("#0B4744", ""), (TEAL, "||"), ("#3D8F8A", "++"), ("#0B4744", "x"), (TEAL, "-")),
)
BELOW: dict[str, Any] = {"bbox_to_anchor": (0.5, 0), "borderaxespad": 3.2, "ncols": 2}
STOPPED = "stopped in training"
SEEN = (-1.0, 3.0)  # of theta_c
AROUND = 60  # episodes shown before and after the rise


@page
def reasons(found: Evidence) -> Figure:
    """How many runs of each learner met which mechanism, and how their last rollouts ended."""
    moved = found.runs[found.runs.learner != "frozen"]
    figure, axes = subplots(1, 2, 1.5 + 0.32 * moved.learner.nunique(), sharey=True)
    ends = moved.ending.mask(moved.wrong == Failure.STOPPED, STOPPED)
    kinds = (moved.mechanism, (*MECHANISMS, WELL)), (ends, (STOPPED, *ENDINGS[1:], ENDINGS[0]))
    for axis, (kind, names), patterns in zip(axes, kinds, PATTERNS, strict=True):
        counts = pd.crosstab(moved.learner, kind)
        counts = counts.reindex(moved.learner.unique(), columns=list(names), fill_value=0)
        looks = dict(zip(names, (*patterns[: len(names) - 1], (GOOD, "")), strict=True))
        _numbered(axis, counts, looks)
        handles = [Rectangle((0, 0), 1, 1, **hatched(*look)) for look in looks.values()]
        axis.legend(handles, names, loc="upper center", **BELOW)
        axis.set_xlabel("runs")
    axes[0].set_title("mechanism when the cost rose", **SUBTITLE)
    axes[1].set_title("how the last rollout ended", **SUBTITLE)
    axes[0].invert_yaxis()
    wrong = moved.mechanism[moved.mechanism != WELL].value_counts()
    listed = ", ".join(f"{count} {name}" for name, count in wrong.items())
    title = f"{wrong.sum()} of {len(moved)} runs went wrong{': ' if listed else ''}{listed}"
    return marked(headed(figure, title), found.mark)


@page
def traced(examples: Mapping[str, RunSummary], first_rollouts: Mapping[str, Column]) -> Figure:
    """One run of each mechanism, a column each: what its summary says around the rise of the cost.

    Args:
        examples: a run by mechanism.
        first_rollouts: by mechanism, the states of theta_init's rollout in the same layout.
    """
    if not examples:
        figure, axis = subplots(height=0.6)
        axis.set_axis_off()
        return headed(figure, "No run went wrong")
    side = min(2, len(examples)) if sheet().narrow else len(examples)
    options: dict[str, Any] = {"sharex": "col", "squeeze": False, "across": side}
    figure, axes = subplots(4, len(examples), 6.2, **options)
    for column, (name, run) in zip(axes.T, examples.items(), strict=True):
        _trace(column, run, first_rollouts[name])
        e = run.name
        column[0].set_title(f"{name}\n{e.learner}, {e.layout}, per {e.decay}", **SUBTITLE)
        over_episodes(column[-1])
    labels = (
        "cost, noise-free\n/ at the start",
        r"largest $\alpha\,\Vert\phi\Vert^2$",
        "share of the\nnetwork in δ",
        r"$\theta_c$",
    )
    for row, label in zip(axes[:, ::side], labels, strict=True):
        for axis in row:
            axis.set_ylabel(label)
    figure.align_ylabels(axes[:, ::side].ravel())
    names = ", ".join(examples)
    mark = f"{len(examples)} runs trained here; grey: the episodes in which the cost rose"
    return marked(headed(figure, f"One run of each kind: {names}"), mark)


def _trace(column: Column, run: RunSummary, first_rollout: Column) -> None:
    """The four panels of one run."""
    task = run.name.task
    window, color = rise(run), LOOKS[run.name.learner].color
    shown = slice(max(0, window.start - AROUND), window.stop + AROUND)
    episodes = np.arange(1, run.experiment["episodes"] + 1)[shown]
    cost = run.evaluations["cost"] / run.evaluations["cost"][0]
    near = (run.evaluations["episode"] >= shown.start) & (run.evaluations["episode"] <= shown.stop)
    column[0].plot(run.evaluations["episode"][near], cost[near], "o-", color=color, markersize=3)
    with np.errstate(invalid="ignore"):
        share = paper.GAMMA * run.episodes["bias"] / run.episodes["delta"]
    curves = (run.episodes["alpha_phi2"], share, run.episodes["theta"][:, -1])
    for axis, curve in zip(column[1:], curves, strict=True):
        axis.plot(episodes, curve[shown], color=color)
    column[1].set_yscale("log")
    low, high = column[1].get_ylim()
    if high / low < FEW:
        plain(column[1].yaxis)
    low, high = column[3].get_ylim()
    column[3].set_ylim(max(low, SEEN[0]), min(high, SEEN[1]))
    limits = (1.0, OVERSHOOT, OVER_PREDICTED, closes_at(task, first_rollout[:, :2]))
    for axis, limit in zip(column, limits, strict=True):
        axis.axvspan(window.start, window.stop, **BAND)
        axis.axhline(limit, **LIMIT)
        axis.xaxis.set_major_locator(MaxNLocator(3, integer=True))


def _numbered(axis: Axes, counts: pd.DataFrame, looks: Mapping[str, tuple[str, str]]) -> None:
    """A bar a learner, with the number in each part that has room for it."""
    enough = 0.06 * counts.sum(axis=1).max()
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
    for name, bars in stacked(axis, counts, looks, 0.7).items():
        labels = [str(n) if n > enough else "" for n in counts[name]]
        axis.bar_label(bars, labels, label_type="center", fontsize="small", bbox=box)

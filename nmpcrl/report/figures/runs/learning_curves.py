"""Figs. 1 and 2 of the paper, over seeds and layouts.

Costs are drawn in units of theta_init's cost without noise, so that layouts compare. What was cut
short, or never reached because the run was stopped, cost infinitely much: it counts in median and
quartiles, and is drawn with all that is above `CEILING` in a strip at the upper end.
"""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator, StrMethodFormatter

from nmpcrl import Vector
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.thresholds import divergence, instability
from nmpcrl.report.figures.axes import label_panel, legend
from nmpcrl.report.figures.panels import part, ranges, sourced
from nmpcrl.report.figures.style import BAND, page, subplots
from nmpcrl.study.store import Runs

CEILING = 4.0  # times theta_init's cost without noise, where the scale ends
STRIP = CEILING * np.array([1.06, 1.18, 1.3])  # of what costs more: its ends and its middle
Curve = Callable[[RunSummary], tuple[Vector, Vector]]  # episodes and costs


def figure_1(found: Evidence, layout: str) -> Figure:
    """Fig. 1 of the paper: DES against RDES."""
    drawn = part(found, ("DES", "RDES", "frozen"), layout)
    counts = _counted(drawn, divergence, ("DES", "RDES"))
    result: Figure = _learning_curves(drawn, f"Divergence in layout {layout}: {counts} runs")
    return result


def figure_2(found: Evidence, layout: str) -> Figure:
    """Fig. 2 of the paper: ES against GES."""
    drawn = part(found, ("ES", "GES", "frozen"), layout)
    counts = _counted(drawn, instability, ("ES", "GES"))
    result: Figure = _learning_curves(drawn, f"Instability in layout {layout}: {counts} runs")
    return result


def trained(summary: RunSummary) -> tuple[Vector, Vector]:
    """Cost of each episode of training, noise included, in units of the start's without noise."""
    cost = np.nan_to_num(summary.episodes["cost"], nan=np.inf)
    return np.arange(1.0, cost.size + 1), cost / summary.evaluations["cost"][0]


def judged(summary: RunSummary) -> tuple[Vector, Vector]:
    """Cost of each rollout without noise, in units of the first; infinite where training ended."""
    episodes, every = summary.experiment["episodes"], summary.experiment["evaluate_every"]
    due = np.unique([*range(0, episodes + 1, every), episodes]).astype(float)
    known = dict(zip(summary.evaluations["episode"], summary.evaluations["cost"], strict=True))
    return due, np.array([known.get(k, np.inf) for k in due]) / known[0]


@page
def _learning_curves(drawn: Evidence, title: str) -> Figure:
    """Cost of each training episode above, without noise below; a column a reading."""
    learners, decays = drawn.summaries.values_of("learner"), drawn.summaries.values_of("decay")
    rows = {"cost of a training episode\n/ at the start, without noise": trained}
    rows["cost without noise\n/ at the start"] = judged
    options: dict[str, Any] = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = subplots(len(rows), len(decays), 5.4, **options)
    for k, (label, curve) in enumerate(rows.items(), 1):
        for axis, decay in zip(axes[k - 1], decays, strict=True):
            _costs(axis, drawn.summaries.select(decay=decay), learners, curve)
            label_panel(axis, decay if k == 1 else "", "episode" if k == len(rows) else "")
            axis.xaxis.set_major_locator(MaxNLocator(3, integer=True))
        axes[k - 1, 0].set_ylabel(label)
    legend(figure, learners)
    return sourced(figure, title, drawn)


def _costs(axis: Axes, runs: Runs[RunSummary], learners: Iterable[str], curve: Curve) -> None:
    """Every learner's runs on a logarithmic axis of cost, what is beyond `CEILING` in its strip."""
    for learner in learners:
        curves = [curve(summary) for summary in runs.select(learner=learner).values()]
        if curves:
            costs = np.array([cost for _, cost in curves])
            beyond = costs > CEILING
            if beyond.any():
                axis.axhspan(STRIP[0], STRIP[2], **BAND)
            ranges(axis, curves[0][0], np.where(beyond, STRIP[1], costs), learner)
    axis.set_yscale("log")
    axis.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axis.yaxis.set_minor_locator(NullLocator())
    if axis.patches:
        axis.set_ylim(None, STRIP[2])
        axis.yaxis.set_major_locator(FixedLocator([*range(1, int(CEILING) + 1)]))
        above: dict[str, Any] = {
            "transform": axis.get_yaxis_transform(),
            "va": "center",
            "fontsize": "small",
        }
        axis.text(0.01, STRIP[1], f"> {CEILING:g}", **above)
    axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))


def _counted(
    drawn: Evidence, measure: Callable[[pd.DataFrame], pd.Series], learners: tuple[str, ...]
) -> str:
    """In how many of each learner's runs a measure of `claims` holds."""
    judged_runs = {name: measure(drawn.runs[drawn.runs.learner == name]) for name in learners}
    return ", ".join(
        f"{name} in {holds.sum()} of {len(holds)}" for name, holds in judged_runs.items()
    )

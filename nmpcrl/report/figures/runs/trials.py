"""Figures of runs outside the study: another robot, another learner, another claim."""

from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nmpcrl.analysis.trials import final_costs
from nmpcrl.claims.rule import MAJORITY
from nmpcrl.claims.verdict import REPRODUCED, Verdict
from nmpcrl.control import Task
from nmpcrl.learning import Rollout
from nmpcrl.report.figures.axes import below, draw_task, over_episodes
from nmpcrl.report.figures.style import INK, LIMIT, LOOKS, TEAL, WINE, Look, page, subplots
from nmpcrl.report.tables import WORDS

OWN = (Look(WINE, (0, (3, 1, 1, 1)), "p"), Look(TEAL, (0, (6, 2)), "h"))  # of learners without one


@page
def trajectories(task: Task, rollouts: Mapping[str, Rollout]) -> Figure:
    """Closed loops without noise among the obstacles, each named with its cost."""
    figure, axes = subplots(height=3.7, tall=3.2)
    draw_task(axes, task)
    for (name, rollout), style, color in zip(
        rollouts.items(), cycle(("-", "--", "-.", ":")), cycle((INK, WINE, TEAL)), strict=False
    ):
        label = f"{name}: {_brief(rollout.cost)}"
        axes.plot(*rollout.states[:, :2].T, color=color, linestyle=style, lw=1.6, label=label)
    least = min(rollouts, key=lambda name: rollouts[name].cost)
    axes.set_title(f"Lowest cost: {least}, {_brief(rollouts[least].cost)}")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.margins(0.04)
    below(figure, axes.get_legend_handles_labels()[0])
    return figure


@page
def costs(rows: pd.DataFrame) -> Figure:
    """Cost without noise over training, one line a run; `rows` are those of `analysis.trials`."""
    figure, axes = subplots(height=3.3, tall=3.0)
    looks = _looks(rows.learner.unique())
    for name, look in looks.items():
        for i, (_, run) in enumerate(rows[rows.learner == name].groupby("seed")):
            label = name if i == 0 else None
            axes.plot(run.episode, _known(run.cost), label=label, lw=1.1, **look.line)
    medians = final_costs(rows).median()
    least = str(medians.idxmin())
    axes.set_title(f"{least} ends lowest: {_brief(medians[least])} (median)")
    axes.set_ylabel("cost without noise [-]")
    over_episodes(axes)
    below(figure, axes.get_legend_handles_labels()[0])
    return figure


@page
def shares(verdicts: Mapping[Any, Verdict], xlabel: str) -> Figure:
    """Share of yes with its interval for each value of what a claim may depend on."""
    figure, axes = subplots(height=3.0, tall=2.8)
    known = {name: v for name, v in verdicts.items() if v.share is not None}
    for i, verdict in enumerate(known.values()):
        axes.vlines(i, *(verdict.interval or (np.nan, np.nan)), color=INK, lw=1.4)
        axes.plot(i, verdict.share, "o", color=WINE, ms=5)
        axes.annotate(WORDS[verdict.outcome], (i, verdict.share), (7, 0), **BESIDE)
    axes.axhline(MAJORITY, **LIMIT)
    axes.set_xticks(range(len(known)), [f"{name:g}" for name in known])
    axes.set(xlabel=xlabel, ylabel="share of yes", ylim=(-0.04, 1.04))
    axes.set_xlim(-0.5, len(known) - 0.3)
    yes = sum(v.outcome == REPRODUCED for v in known.values())
    axes.set_title(f"Taken by themselves, {yes} of {len(known)} are a yes")
    return figure


BESIDE: dict[str, Any] = {"textcoords": "offset points", "va": "center"}


def _brief(cost: float) -> str:
    """A cost without decimals that say nothing, and with those of a small one."""
    return f"{cost:.0f}" if abs(cost) >= 100 or not np.isfinite(cost) else f"{cost:.3g}"


def _looks(names: Any) -> dict[str, Look]:
    """The look of each learner in the book, and of others the next that is free."""
    free = iter(OWN * len(names))
    return {name: LOOKS[name] if name in LOOKS else next(free) for name in names}


def _known(values: pd.Series) -> pd.Series:
    """A run that diverged ends where it was last judged."""
    return values.where(np.isfinite(values))

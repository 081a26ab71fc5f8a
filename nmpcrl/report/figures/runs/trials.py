"""Figures of runs outside the study: another problem, another learner, another claim."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nmpcrl import Vector
from nmpcrl.analysis.trials import final_costs
from nmpcrl.claims.rule import MAJORITY
from nmpcrl.claims.verdict import REPRODUCED, Verdict
from nmpcrl.report.figures.axes import below, over_episodes
from nmpcrl.report.figures.style import INK, LIMIT, LOOKS, TEAL, WINE, Look, headed, page, subplots
from nmpcrl.report.tables import WORDS

OWN = (Look(WINE, (0, (3, 1, 1, 1)), "p"), Look(TEAL, (0, (6, 2)), "h"))  # of learners without one


@page
def costs(rows: pd.DataFrame) -> Figure:
    """Cost without noise over training, one line a run; `rows` are those of `analysis.trials`."""
    figure, axes = subplots(height=3.1)
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
def learned(
    values: Vector, truth: float, courses: Mapping[str, Vector], names: tuple[str, str]
) -> Figure:
    """A parameter of the model as it is learned, and what a state does with it.

    Args:
        values: the parameter at the start and after each learning step.
        truth: the plant's.
        courses: the state over steps without noise, by what to call it.
        names: of the parameter and the state, with units.
    """
    figure, (left, right) = subplots(1, 2, across=1, tall=4.8)
    left.axhline(truth, **LIMIT)
    left.plot(values, color=TEAL)
    left.set(xlabel="learning step", ylabel=names[0], title="Parameter (dashed: the plant's)")
    right.axhline(0, **LIMIT)
    for (name, course), color, dashes in zip(
        courses.items(), (WINE, TEAL), ("--", "-"), strict=True
    ):
        right.plot(course, color=color, linestyle=dashes, label=name)
    right.set(xlabel="step", ylabel=names[1], title="State (dashed: the target)")
    below(figure, right.get_legend_handles_labels()[0])
    share = 1 - abs(values[-1] - truth) / abs(values[0] - truth)
    plain = names[0].partition(" [")[0]
    return headed(figure, f"Learning closes {share:.0%} of the gap to the plant's {plain}")


@page
def shares(verdicts: Mapping[Any, Verdict], xlabel: str) -> Figure:
    """Share of yes with its interval for each value of what a claim may depend on."""
    figure, axes = subplots(height=2.9)
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
    free, known = iter(OWN * len(names)), LOOKS | {"no learning": LOOKS["frozen"]}
    return {name: known[name] if name in known else next(free) for name in names}


def _known(values: pd.Series) -> pd.Series:
    """A run that diverged ends where it was last judged."""
    return values.where(np.isfinite(values))

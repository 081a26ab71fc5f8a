"""Figures of runs outside the study: another problem, another learner, a known answer."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.trials import final_costs
from nmpcrl.report.figures.axes import over_episodes
from nmpcrl.report.figures.style import (
    INK,
    LIMIT,
    LOOKS,
    TEAL,
    WINE,
    Drawn,
    Look,
    page,
    subplots,
    titled,
)

OWN = (Look(WINE, (0, (3, 1, 1, 1)), "p"), Look(TEAL, (0, (6, 2)), "h"))  # of learners without one
KNOWN = LOOKS | {"no learning": LOOKS["frozen"], "LSTD-Q": OWN[1]}


@page
def costs(rows: pd.DataFrame) -> Drawn:
    """Cost without noise over training, one line a run; `rows` are those of `analysis.trials`.

    A run that diverged ends where it was last judged.
    """
    figure, axes = subplots(height=3.1)
    free = iter(OWN * rows.learner.nunique())
    for name, mine in rows.groupby("learner", sort=False):
        look = KNOWN.get(str(name)) or next(free)
        for _, run in mine.groupby("seed"):
            known = run.cost.where(np.isfinite(run.cost))
            (line,) = axes.plot(run.episode, known, lw=1.1, **look.line)
        line.set_label(name)
    axes.set_ylabel("cost without noise [-]")
    over_episodes(axes)
    medians = final_costs(rows).median()
    title = f"{medians.idxmin()} ends lowest: {medians.min():.4g} (median)"
    return titled(figure, title, legend=axes)


@page
def learned(
    values: Vector, truth: float, courses: Mapping[str, Vector], names: tuple[str, str]
) -> Drawn:
    """A parameter of the model as it is learned, and what a state does with it.

    Args:
        values: the parameter at the start and after each learning step.
        truth: the plant's.
        courses: the state over steps without noise, by what to call it.
        names: of the parameter and the state, with units.
    """
    figure, (above, state) = subplots(2, 1, 4.8)
    above.axhline(truth, **LIMIT)
    above.plot(values, color=TEAL)
    above.set(xlabel="learning step", ylabel=names[0], title="Parameter (dashed: the plant's)")
    state.axhline(0, **LIMIT)
    for (name, course), line in zip(courses.items(), ("--", "-"), strict=True):
        state.plot(course, color=WINE if line == "--" else TEAL, linestyle=line, label=name)
    state.set(xlabel="step", ylabel=names[1], title="State (dashed: the target)")
    share = 1 - abs(values[-1] - truth) / abs(values[0] - truth)
    title = f"Learning closes {share:.0%} of the gap to the plant's {names[0].partition(' [')[0]}"
    return titled(figure, title, legend=state)


@page
def known(paths: Mapping[str, Vector], truth: Vector) -> Drawn:
    """The gains that theta plans with beside the best one, on a linear plant.

    Args:
        paths: by learner, the two entries of K after each episode, shape (episodes + 1, 2).
        truth: the best K, shape (2,).
    """
    figure, axes = subplots(height=2.9)
    for name, path in paths.items():
        look = KNOWN[name]
        axes.plot(*path.T, linewidth=1.2, label=name, **look.line)
        axes.plot(*path[-1], look.marker, color=look.color, markersize=7)
    axes.plot(*truth, "+", color=INK, markersize=16, markeredgewidth=1.6, label="best K")
    axes.set(xlabel="$K_1$", ylabel="$K_2$")
    return titled(figure, "LSTD-Q finds the best gain of a linear plant", legend=axes)

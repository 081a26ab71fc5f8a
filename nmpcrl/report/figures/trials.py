"""Figures of runs outside the study: another problem, another learner, a known answer."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from nmpcrl import Vector
from nmpcrl.analysis.trials import final_costs
from nmpcrl.report.figures.axes import below, jitter, over_episodes
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
from nmpcrl.studies.other_problems import Runs

OWN = (Look(WINE, (0, (3, 1, 1, 1)), "p"), Look(TEAL, (0, (6, 2)), "h"))  # of learners without one
KNOWN = LOOKS | {
    "no learning": LOOKS["frozen"],
    "LSTD-Q": OWN[1],
    "LSTD-Q, batches of 20": OWN[1],
    "LSTD-Q, every step": OWN[0],
    "DPG": Look("#5B5EA6", (0, (1, 1)), "*"),
}
MOST = 3.0  # largest cost of a step that is drawn
REFERENCES = {  # what the learners are compared with: name, and line
    "best_policy": ("best policy", ":"), "best_theta": ("best θ", "-."),
    "informed": ("knows the plant", "--"),
}  # fmt: skip


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
    below(figure, axes.get_legend_handles_labels()[0])
    medians = final_costs(rows).median()
    return titled(figure, f"{medians.idxmin()} ends lowest: {medians.min():.4g} (median)")


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
    below(figure, state.get_legend_handles_labels()[0])
    share = 1 - abs(values[-1] - truth) / abs(values[0] - truth)
    plain = names[0].partition(" [")[0]
    return titled(figure, f"Learning closes {share:.0%} of the gap to the plant's {plain}")


@page
def known(paths: Mapping[str, Vector], truth: Vector, found: Runs) -> Drawn:
    """The gains that theta plans with beside the best one; what each seed ends with.

    Args:
        paths: by learner, the two entries of K after each episode, shape (episodes + 1, 2).
        truth: the best K, shape (2,).
        found: the published runs on the example of Gros and Zanon.
    """
    figure, (gains, ends) = subplots(2, 1, 5.6)
    for name, path in paths.items():
        look = KNOWN[name]
        gains.plot(*path.T, linewidth=1.2, label=name, **look.line)
        gains.plot(*path[-1], look.marker, color=look.color, markersize=7)
    gains.plot(*truth, "+", color=INK, markersize=16, markeredgewidth=1.6, label="best K")
    gains.set(xlabel="$K_1$", ylabel="$K_2$", title="Linear plant")
    gains.legend(fontsize="small")
    _ends(ends, found)
    first = found.medians.idxmin()
    times = found.medians[first] / found.references["best_policy"]
    return titled(
        figure,
        "LSTD-Q finds the best gain of a linear plant; with a wrong model,"
        f" {first} comes to {times:.1f} times the best cost",
    )


def _ends(axes: Axes, found: Runs) -> None:
    """Cost without noise of each seed's last theta, and lines for what is possible."""
    for place, (arm, each) in enumerate(found.tests.items()):
        shown = np.minimum(np.sort(each.to_numpy()), MOST)
        axes.plot(shown, place + jitter(len(shown), 0.3), **KNOWN[str(arm)].dots(markersize=3))
        axes.plot(np.median(shown), place, "|", color=INK, markersize=16)
    for name, (label, line) in REFERENCES.items():
        axes.axvline(found.references[name], label=label, **(LIMIT | {"linestyle": line}))
    names = [str(arm).replace("frozen", "no learning") for arm in found.tests]
    axes.set_yticks(range(len(names)), names, fontsize="small")
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="cost of a step [-]", title="Gros and Zanon")
    axes.set_xlim(0.8 * found.references["best_policy"], 1.3 * MOST)
    axes.legend(fontsize="small", loc="center right", bbox_to_anchor=(1.0, 0.37))

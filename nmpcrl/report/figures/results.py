"""Figures of the study: Figs. 1 to 4 of the paper over seeds and layouts, and how runs fail."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from nmpcrl import Vector
from nmpcrl.analysis import metrics
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims.failure_modes import WELL, Ending, Failure, Mechanism
from nmpcrl.claims.published import Evidence
from nmpcrl.report.figures.axes import (
    by_decay,
    draw_task,
    each_episode,
    entries,
    middle_half,
    over_episodes,
    panels,
    stacked,
    strips,
)
from nmpcrl.report.figures.style import (
    BAND,
    LIMIT,
    LOOKS,
    TEAL,
    WINE,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.study import Runs, paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Stopped

CEILING = 4.0  # times theta_init's cost without noise, where the scale of a cost ends
STRIP = CEILING * np.array([1.06, 1.18, 1.3])  # of what costs more: its ends and its middle
SHOWN = ("frozen", "RDES", "GES")  # the paper's two methods, whose policies its Figs. 3 and 4 show
BARS = (  # colour and hatching of what failed: of mechanisms, and of endings
    (("#5C0F3A", ""), (WINE, "//"), ("#A0487A", "--"), ("#BC6F9A", "\\\\"), (WINE, "xx")),
    (("#0B4744", ""), (TEAL, "||"), ("#3D8F8A", "++"), ("#0B4744", "x"), (TEAL, "-")),
)
GOOD = ("0.92", "")  # what went well


def part(found: Evidence, learners: tuple[str, ...], layout: str | None = None) -> Evidence:
    """The runs of some learners, in one layout or in all."""
    kept = found.runs.learner.isin(learners)
    return found.where(kept & (found.runs.layout == layout) if layout else kept)


def trained(summary: RunSummary) -> tuple[Vector, Vector]:
    """Cost of each episode of training, noise included, in units of the start's without noise.

    What was cut short costs infinitely much, here and in `judged`.
    """
    cost = np.nan_to_num(summary.episodes["cost"], nan=np.inf)
    return np.arange(1.0, cost.size + 1), cost / summary.evaluations["cost"][0]


def judged(summary: RunSummary) -> tuple[Vector, Vector]:
    """Cost of each rollout without noise, in units of the first; infinite where training ended."""
    episodes, every = summary.experiment["episodes"], summary.experiment["evaluate_every"]
    due = np.unique([*range(0, episodes + 1, every), episodes]).astype(float)
    known = dict(zip(summary.evaluations["episode"], summary.evaluations["cost"], strict=True))
    return due, np.array([known.get(k, np.inf) for k in due]) / known[0]


CURVES: Mapping[str, Callable[[RunSummary], tuple[Vector, Vector]]] = {  # a row of panels each
    "cost of a training episode\n/ at the start, without noise": trained,
    "cost without noise\n/ at the start": judged,
}


@page
def learning_curves(
    found: Evidence,
    pair: tuple[str, str],
    layout: str,
    measure: Callable[[pd.DataFrame], pd.Series],
    word: str,
) -> Drawn:
    """Figs. 1 and 2 of the paper, over seeds: costs in units of theta_init's without noise.

    Medians, quartiles and ranges, a column a decay of the noise. What costs more than `CEILING`,
    was cut short or was not reached is drawn in a strip at the upper end.

    Args:
        found: the runs.
        pair: two learners, drawn beside the baseline.
        layout: of the obstacles.
        measure: of `claims.thresholds`, which is counted in the title.
        word: which ends the title, "diverged".
    """
    learners = (*pair, "frozen")
    drawn = part(found, learners, layout)
    decays = drawn.summaries.values_of("decay")
    options: dict[str, Any] = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, grid = subplots(len(CURVES), len(decays), 5.4, **options)
    for row, (label, curve) in zip(grid, CURVES.items(), strict=True):
        most = 0.0
        for axes, decay in zip(row, decays, strict=True):
            for learner in learners:
                runs = drawn.summaries.select(learner=learner, decay=decay).values()
                along, costs = map(np.array, zip(*map(curve, runs), strict=True))
                _costs(axes, along[0], costs, learner)
                most = max(most, costs.max())
            over_episodes(axes, decay if row is grid[0] else "", "")
        row[0].set_yscale("log")
        row[0].yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        row[0].yaxis.set_minor_locator(NullLocator())
        row[0].yaxis.set_major_formatter("{x:g}")
        if most > CEILING:
            for axes in row:
                axes.axhspan(STRIP[0], STRIP[2], **BAND)
                where: dict[str, Any] = {"transform": axes.get_yaxis_transform(), "va": "center"}
                axes.text(0.01, STRIP[1], f"> {CEILING:g}", fontsize="small", **where)
            row[0].set_ylim(None, STRIP[2])
            row[0].yaxis.set_major_locator(FixedLocator([*range(1, int(CEILING) + 1)]))
        row[0].set_ylabel(label)
    for axes in grid[-1]:
        axes.set_xlabel("episode")
    held = {name: measure(drawn.runs[drawn.runs.learner == name]) for name in pair}
    counts = [f"{one.sum()} of {len(one)} runs of {name}" for name, one in held.items()]
    title = f"In layout {layout}, {' and '.join(counts)} {word}"
    return titled(figure, title, drawn.mark, entries(learners))


def _costs(axes: Axes, along: Vector, costs: Any, learner: str) -> None:
    """Runs of a learner: their range a pale band, the middle half another, the median a line."""
    seen, look = np.where(costs > CEILING, STRIP[1], costs), LOOKS[learner]
    ends = seen.min(axis=0), seen.max(axis=0)
    axes.fill_between(along, *ends, color=look.color, alpha=0.12, lw=0)
    # between a run that is off the scale and one that is not there is nothing
    middle_half(axes, along, seen, look.color, "higher", linestyle=look.linestyle)


@page
def controls(found: Evidence, layout: str) -> Drawn:
    """Fig. 3 of the paper, over seeds: the inputs under the learned policies, without noise.

    Args:
        found: runs whose inputs are known, as by `published.with_inputs`.
        layout: of the obstacles.
    """
    drawn = _finished(part(found, SHOWN, layout))
    plant = paper.nmpc(layout).plant
    figure, axes = subplots(plant.m, 1, 3.6, sharex=True)
    for learner in SHOWN:
        runs = drawn.summaries.select(learner=learner).values()
        inputs, look = np.array([one.actions for one in runs]), LOOKS[learner]
        along = plant.period * np.arange(inputs.shape[1])
        for i, axis in enumerate(axes):
            axis.plot(along, inputs[:, :, i].T, color=look.color, linewidth=0.5, alpha=0.35)
            middle_half(axis, along, inputs[:, :, i], look.color, linestyle=look.linestyle)
    for i, axis in enumerate(axes):
        axis.axhline(plant.lower[i], **LIMIT)
        axis.axhline(plant.upper[i], **LIMIT)
        axis.set_ylabel(plant.action_names[i])
    axes[-1].set_xlabel("time [s]")
    learned = [one.actions for e, one in drawn.summaries.items() if e.learner != "frozen"]
    outside = sum(metrics.out_of_bounds(one, plant.lower, plant.upper).sum() for one in learned)
    used = np.median([np.nanmax(np.abs(one) / plant.upper, axis=0) for one in learned], axis=0)
    title = (
        f"RDES and GES use up to {used[0]:.0%} of the speed and {used[1]:.0%} of the turn rate"
        f" allowed; {outside} inputs leave their bounds"
    )
    return titled(figure, title, drawn.mark, entries(SHOWN))


@page
def trajectories(found: Evidence) -> Drawn:
    """Fig. 4 of the paper: where the learned policies lead in every layout, with both decays.

    A run that had to be stopped left no policy: it is counted, and not drawn.
    """
    drawn = part(found, SHOWN)
    figure, by_layout = panels(drawn.summaries.values_of("layout"), 1.95, 1.4)
    for layout, axes in by_layout.items():
        draw_task(axes, paper.task(layout), labels=False)
        runs = _finished(drawn).summaries.select(layout=layout)
        for experiment, summary in runs.items():
            known = summary.states[np.isfinite(summary.states).all(axis=1)]
            look = LOOKS[experiment.learner]
            axes.plot(*known[:, :2].T, **look.line, linewidth=0.8)
            axes.plot(*known[-1, :2], **look.dots(markersize=3.5))
        axes.set_ylim(-3, 6)
    learned = drawn.runs[drawn.runs.learner != "frozen"]
    arrived = (learned.ending == Ending.ARRIVED) & (learned.stopped == Stopped.FINISHED)
    of = f"{arrived.sum()} of {len(learned)} runs of RDES and GES"
    title = f"After {of} the robot reaches the target"
    return titled(figure, title, drawn.mark, entries(SHOWN))


def _finished(found: Evidence) -> Evidence:
    """Without the runs that had to be stopped, which left no policy."""
    return found.where(found.runs.stopped == Stopped.FINISHED)


@page
def reasons(found: Evidence) -> Drawn:
    """How many runs of each learner met which mechanism, and how their last rollouts ended."""
    moved = found.runs[found.runs.learner != "frozen"]
    figure, axes = subplots(2, 1, 3.2 + 0.6 * moved.learner.nunique(), sharey=True)
    stopped = "stopped in training"
    ends = moved.ending.mask(moved.wrong == Failure.STOPPED, stopped)
    arrived, *worse = Ending
    kinds = (moved.mechanism, (*Mechanism, WELL)), (ends, (stopped, *worse, arrived))
    for axis, (kind, names), bars in zip(axes, kinds, BARS, strict=True):
        counts = pd.crosstab(moved.learner, kind)
        counts = counts.reindex(moved.learner.unique(), columns=list(names), fill_value=0)
        looks = dict(zip(names, (*bars[: len(names) - 1], GOOD), strict=True))
        _numbered(axis, counts, looks)
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=3.2, ncols=3)
        axis.set_xlabel("runs")
    axes[0].set_title("mechanism when the cost rose")
    axes[1].set_title("how the last rollout ended")
    axes[0].invert_yaxis()
    wrong = (moved.mechanism != WELL).sum()
    return titled(figure, f"{wrong} of {len(moved)} runs failed", found.mark)


def _numbered(axis: Axes, counts: pd.DataFrame, looks: Mapping[str, tuple[str, str]]) -> None:
    """A bar a learner, with the number in each part that has room for it."""
    enough = 0.06 * counts.sum(axis=1).max()
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
    for name, bars in stacked(axis, counts, looks, 0.7).items():
        labels = [str(n) if n > enough else "" for n in counts[name]]
        axis.bar_label(bars, labels, label_type="center", fontsize="small", bbox=box)


@page
def by_layout(
    found: Evidence,
    values: pd.Series,
    learners: Sequence[str],
    *,
    label: str,
    title: str,
    seen: tuple[float, float],
) -> Drawn:
    """A share of every run, layout by layout and learner by learner.

    Args:
        found: the runs.
        values: one a run; infinite ones, and what is not `seen`, are drawn at the edge.
        learners: in the order in which they are drawn.
        label: what the share is of.
        title: the finding.
        seen: the lowest and the highest that is drawn.
    """
    figure, axes = subplots(height=3.9)
    cells = [found.runs[name] for name in ("layout", "decay", "seed", "learner")]
    each = pd.Series(values.to_numpy(), pd.MultiIndex.from_arrays(cells)).unstack(sort=False)
    kinds = strips(axes, each[[*learners]], lambda drawn: drawn.clip(*seen))
    axes.axhline(0, **LIMIT)
    axes.set(ylabel=label, ylim=seen)
    axes.yaxis.set_major_formatter("{x:.0%}")
    return titled(figure, title, found.mark, kinds)


@page
def replicas(perturbed: Mapping[Experiment, Vector], solvers: Vector, start: float) -> Drawn:
    """How far perturbed replicas are apart against episodes.

    Args:
        perturbed: by run, the largest difference of theta in each episode.
        solvers: the same of riccati and Ipopt.
        start: how far apart the perturbed begin.
    """
    runs = Runs({**perturbed})
    learners = runs.values_of("learner")
    figure, panels = by_decay(runs, learners, np.asarray, "largest difference in θ")
    for axes in panels:
        axes.axhline(start, **LIMIT)
        axes.xaxis.set_major_locator(MaxNLocator(3, integer=True))
    other: dict[str, Any] = {"color": "0.45", "linewidth": 2.4}
    each_episode(panels[0], solvers, **other)
    panels[0].set_yscale("log")
    by_solver = Line2D([], [], label="ES, riccati and Ipopt", **other)
    grown = sum(apart[-1] > start for apart in perturbed.values())
    title = f"A difference of {start:.0e} grows in {grown} of {len(perturbed)} runs"
    return titled(figure, title, legend=[*entries(learners), by_solver])

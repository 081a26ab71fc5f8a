"""Rollouts of the learned policies without noise: Figs. 3 and 4 of the paper, over seeds.

A run that had to be stopped left no policy: it is counted, and not drawn.
"""

from collections import Counter
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nmpcrl.analysis import metrics
from nmpcrl.analysis.summary import Outline
from nmpcrl.claims.evidence import Evidence
from nmpcrl.claims.failure_modes import ending
from nmpcrl.control import Task
from nmpcrl.report.figures.axes import draw_task, legend, map_grid
from nmpcrl.report.figures.panels import bundle, part, sourced
from nmpcrl.report.figures.style import DECAY_TITLES, LIMIT, LOOKS, SUBTITLE, page, subplots
from nmpcrl.study import paper
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.records import Column, Stopped
from nmpcrl.study.store import Runs

LEARNED = ("RDES", "GES")  # the paper's two methods, whose policies its Figs. 3 and 4 show
SHOWN = ("frozen", *LEARNED)


@page
def controls(found: Evidence, layout: str) -> Figure:
    """Fig. 3 of the paper: the inputs under the learned policies, without noise.

    Rollouts whose inputs are not kept, as those of published runs, are left out.
    """
    drawn = _finished(part(found, SHOWN, layout))
    drawn = drawn.where([summary.actions is not None for summary in drawn.summaries.values()])
    plant = paper.nmpc(layout).plant
    figure, axes = _against_time(drawn, "actions", plant.action_names, 4.2)
    for i, row in enumerate(axes):
        for axis in row:
            axis.axhline(plant.lower[i], **LIMIT)
            axis.axhline(plant.upper[i], **LIMIT)
    learned = [one.actions for one in _learned(drawn) if one.actions is not None]
    outside = sum(metrics.input_violations(one, plant.lower, plant.upper) for one in learned)
    verb = f"{outside} inputs leave" if outside else "all inputs keep within"
    title = f"In {len(learned)} rollouts of RDES and GES, {verb} their bounds"
    return sourced(figure, title if learned else "The inputs of no rollout are kept", drawn)


@page
def states(found: Evidence, layout: str) -> Figure:
    """Fig. 4 of the paper against time: the states under the learned policies."""
    drawn = _finished(part(found, SHOWN, layout))
    task, plant = paper.task(layout), paper.nmpc(layout).plant
    figure, axes = _against_time(drawn, "states", plant.state_names, 5.4)
    for i, row in enumerate(axes):
        for axis in row:
            axis.axhline(task.target[i], **LIMIT)
    ends = np.array([task.distance(summary.states[-1]) for summary in _learned(drawn)])
    arrived = int((ends <= ARRIVED).sum())
    title = f"{arrived} of {ends.size} rollouts of RDES and GES end at the target"
    return sourced(figure, f"In layout {layout}, {title}", drawn)


@page
def paths(found: Evidence, layout: str) -> Figure:
    """Fig. 4 of the paper in the plane: where the learned policies lead the robot, without noise.

    One line a run and none for the median, for a median of places is no place that a robot was.
    """
    drawn = part(found, SHOWN, layout)
    finished, decays = _finished(drawn), drawn.summaries.values_of("decay")
    figure, axes = subplots(1, len(decays), 3.8, sharey=True, squeeze=False)
    for axis, decay in zip(axes[0], decays, strict=True):
        _map(axis, paper.task(layout), finished.summaries.select(decay=decay))
        axis.set_title(DECAY_TITLES[decay], **SUBTITLE)
        axis.set_xlabel("x [m]")
    axes[0, 0].set_ylabel("y [m]")
    legend(figure, SHOWN)
    return sourced(figure, f"In layout {layout}: {_endings(_learned(drawn))}", drawn)


@page
def maps(found: Evidence) -> Figure:
    """Where the learned policies lead the robot in every layout, both readings of the decay."""
    drawn = part(found, SHOWN)
    layouts = drawn.summaries.values_of("layout")
    figure, by_layout, grid = map_grid(layouts, 1.95, 0.8)
    for layout, axis in by_layout.items():
        runs = _finished(drawn).summaries.select(layout=layout)
        _map(axis, paper.task(layout), runs, names=False)
        axis.set_title(layout, **SUBTITLE)
    for axis in grid[-1]:
        axis.set_xlabel("x [m]")
    for axis in grid[:, 0]:
        axis.set_ylabel("y [m]")
    legend(figure, SHOWN)
    return sourced(figure, f"In all layouts: {_endings(_learned(drawn))}", drawn)


def _against_time(
    drawn: Evidence, name: str, components: tuple[str, ...], height: float
) -> tuple[Figure, Column]:
    """`states` or `actions` of the last rollouts: a row a component, a column a reading."""
    decays, period = drawn.summaries.values_of("decay"), paper.nmpc().plant.period
    options: dict[str, Any] = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = subplots(len(components), max(1, len(decays)), height, **options)
    for column, decay in zip(axes.T, decays, strict=False):
        for learner in SHOWN:
            runs = drawn.summaries.select(learner=learner, decay=decay).values()
            values = np.array([getattr(summary, name) for summary in runs])
            for i, axis in enumerate(column if values.size else ()):
                bundle(axis, period * np.arange(values.shape[1]), values[:, :, i], learner)
        column[0].set_title(DECAY_TITLES[decay], **SUBTITLE)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    for axis, component in zip(axes[:, 0], components, strict=True):
        axis.set_ylabel(component)
    legend(figure, SHOWN)
    return figure, axes


def _map(axis: Axes, task: Task, runs: Runs[Outline], *, names: bool = True) -> None:
    """Obstacles, start, target and trajectories; a mark where each ended."""
    draw_task(axis, task, labels=names)
    for learner in SHOWN:
        look = LOOKS[learner]
        for summary in runs.select(learner=learner).values():
            known = summary.states[np.isfinite(summary.states).all(axis=1)]
            axis.plot(known[:, 0], known[:, 1], **look.line, linewidth=0.8)
            axis.plot(*known[-1, :2], look.marker, color=look.color, markersize=3.5)
    axis.set(xlim=(task.lower[0], task.upper[0]), ylim=(-3, 6))


def _learned(drawn: Evidence) -> list[Outline]:
    """Every run of the paper's two methods."""
    return [summary for e, summary in drawn.summaries.items() if e.learner in LEARNED]


def _finished(found: Evidence) -> Evidence:
    """Without the runs that had to be stopped, which left no policy."""
    return found.where(found.runs.stopped == Stopped.FINISHED)


def _endings(summaries: list[Outline]) -> str:
    """How many rollouts end in which way, the most common first."""
    ends = Counter(
        ending(one.states, one.name.task)
        if one.facts["stopped"] == Stopped.FINISHED
        else "stopped in training"
        for one in summaries
    )
    return ", ".join(f"{count} {name}" for name, count in ends.most_common())

"""Rollouts of the learned policies without noise: Figs. 3 and 4 of the paper, over seeds.

A run that had to be stopped left no policy: it is counted, and not drawn.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nmpcrl.analysis import metrics
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims.failure_modes import Ending, ending
from nmpcrl.claims.published import Evidence
from nmpcrl.control import Task
from nmpcrl.report.figures.axes import draw_task, legend, map_grid
from nmpcrl.report.figures.panels import bundle, part, sourced
from nmpcrl.report.figures.style import LIMIT, LOOKS, SUBTITLE, page, subplots
from nmpcrl.study import paper
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
    drawn = drawn.where([len(summary.actions) > 0 for summary in drawn.summaries.values()])
    plant = paper.nmpc(layout).plant
    figure, axes = _against_time(drawn, "actions", plant.action_names, 3.6)
    for i, axis in enumerate(axes):
        axis.axhline(plant.lower[i], **LIMIT)
        axis.axhline(plant.upper[i], **LIMIT)
    learned = [one.actions for one in _learned(drawn)]
    if not learned:
        return sourced(figure, "The inputs of no rollout are kept", drawn)
    outside = sum(metrics.out_of_bounds(one, plant.lower, plant.upper).sum() for one in learned)
    used = np.median([np.nanmax(np.abs(one) / plant.upper, axis=0) for one in learned], axis=0)
    names = (name.partition(" [")[0] for name in plant.action_names)
    parts = " and ".join(
        f"{share:.0%} of the {name}" for share, name in zip(used, names, strict=True)
    )
    left = f"; {outside} inputs leave their bounds" * bool(outside)
    return sourced(figure, f"RDES and GES use up to {parts} allowed{left}", drawn)


@page
def maps(found: Evidence) -> Figure:
    """Where the learned policies lead the robot in every layout, both readings of the decay."""
    drawn = part(found, SHOWN)
    layouts = drawn.summaries.values_of("layout")
    figure, by_layout, grid = map_grid(layouts, 1.95, 1.4)
    for layout, axis in by_layout.items():
        runs = _finished(drawn).summaries.select(layout=layout)
        _map(axis, paper.task(layout), runs)
        axis.set_title(layout, **SUBTITLE)
    for axis in grid[-1]:
        axis.set_xlabel("x [m]")
    for axis in grid[:, 0]:
        axis.set_ylabel("y [m]")
    legend(figure, SHOWN)
    ends = [ending(one.states, one.name.task) for one in _learned(_finished(drawn))]
    arrived, count = ends.count(Ending.ARRIVED), len(_learned(drawn))
    finding = f"After {arrived} of {count} runs of RDES and GES the robot reaches the target"
    return sourced(figure, finding, drawn)


def _against_time(
    drawn: Evidence, name: str, components: tuple[str, ...], height: float
) -> tuple[Figure, Column]:
    """`states` or `actions` of the last rollouts, of both readings together: a row a component."""
    period = paper.nmpc().plant.period
    figure, axes = subplots(len(components), 1, height, sharex=True)
    for learner in SHOWN:
        runs = drawn.summaries.select(learner=learner).values()
        values = np.array([getattr(summary, name) for summary in runs])
        for i, axis in enumerate(axes if values.size else ()):
            bundle(axis, period * np.arange(values.shape[1]), values[:, :, i], learner)
    axes[-1].set_xlabel("time [s]")
    for axis, component in zip(axes, components, strict=True):
        axis.set_ylabel(component)
    legend(figure, SHOWN)
    return figure, axes


def _map(axis: Axes, task: Task, runs: Runs[RunSummary]) -> None:
    """Obstacles, start, target and trajectories, a line a run; a mark where each ended."""
    draw_task(axis, task, labels=False)
    for learner in SHOWN:
        look = LOOKS[learner]
        for summary in runs.select(learner=learner).values():
            known = summary.states[np.isfinite(summary.states).all(axis=1)]
            axis.plot(known[:, 0], known[:, 1], **look.line, linewidth=0.8)
            axis.plot(*known[-1, :2], look.marker, color=look.color, markersize=3.5)
    axis.set(xlim=(task.lower[0], task.upper[0]), ylim=(-3, 6))


def _learned(drawn: Evidence) -> list[RunSummary]:
    """Every run of the paper's two methods."""
    return [summary for e, summary in drawn.summaries.items() if e.learner in LEARNED]


def _finished(found: Evidence) -> Evidence:
    """Without the runs that had to be stopped, which left no policy."""
    return found.where(found.runs.stopped == Stopped.FINISHED)

"""One run on one page: what `nmpcrl show` draws."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from nmpcrl.analysis import metrics
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import draw_task, each_episode, logarithmic_if_wide, over_episodes
from nmpcrl.report.figures.learners import DASHES, largest_steps, thetas
from nmpcrl.report.figures.style import (
    INK,
    LIMIT,
    LOOKS,
    MEANINGS,
    QUIET,
    Drawn,
    page,
    shades,
    titled,
)
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Records

NAMED = 4  # components of theta that are named, those that move most; the others are grey
WIDE = 10  # what an axis goes up to that is linear
FIRST: dict[str, Any] = {"color": INK, "linestyle": ":", "linewidth": 1.2}


@page
def run_page(records: Records, frozen: Records | None = None) -> Drawn:
    """The trajectory without noise, theta, both costs and the size of the steps of one run.

    Args:
        records: the run.
        frozen: the baseline without learning, drawn beside its costs.
    """
    figure, experiment = Drawn(8.8), Experiment(**records.experiment)
    panels = figure.subplot_mosaic(
        [["map", "map"], ["theta", "step"], ["noisy", "noise-free"]], height_ratios=(1.25, 1, 1)
    )
    _map(panels["map"], records, experiment)
    _theta(panels["theta"], records)
    _steps(panels["step"], records)
    for one in filter(None, (frozen, records)):
        learner = one.experiment["learner"]
        look = LOOKS[learner].line | {"label": learner}
        each_episode(panels["noisy"], metrics.training_cost(one), **look)
        episode, judged = one.evaluations["episode"], one.evaluations["cost"]
        known = np.isfinite(judged)
        panels["noise-free"].plot(episode[known], judged[known], marker=".", **look)
    panels["noisy"].legend(fontsize="small")
    for name, label in (("noisy", "cost with noise"), ("noise-free", "cost without noise")):
        logarithmic_if_wide(panels[name])
        panels[name].set_ylabel(label)
    for name in ("theta", "step", "noisy", "noise-free"):
        panels[name].set_xlim(-0.03 * experiment.episodes, 1.03 * experiment.episodes)
        over_episodes(panels[name])
    before, after = metrics.initial_cost(records), metrics.final_cost(records)
    title = f"{experiment.learner}: cost without noise {before:.0f} at first, {after:.0f} at last"
    source = f"{experiment}: {records.facts['stopped']}"
    return titled(figure, title, source, panels["map"])


def _map(axes: Axes, records: Records, experiment: Experiment) -> None:
    """Where theta_init and the last theta lead the robot, without noise."""
    task, rollouts = experiment.task, records.evaluations
    draw_task(axes, task)
    look = LOOKS[experiment.learner]
    for row, style in ((0, FIRST), (-1, {**look.line, "linewidth": 1.8})):
        states = rollouts["states"][row]
        path = states[np.isfinite(states).all(axis=1)]
        label = f"θ after {rollouts['episode'][row]} episodes"
        axes.plot(path[:, 0], path[:, 1], label=label, **style)
        axes.plot(*path[-1:, :2].T, look.marker, color=style["color"], markersize=4)
    axes.set_xlim(task.lower[0] - 0.5, task.upper[0])
    inside = int((task.overlap(path).max(axis=-1) > metrics.TOUCH).sum())
    away = task.distance(path[-1])
    axes.set_title(f"{away:.1f} from the target at the end, {inside} states inside")


def _theta(axes: Axes, records: Records) -> None:
    """theta after each episode; the components that move most are named."""
    values = thetas(records)
    change = np.nan_to_num(np.ptp(values, axis=0))
    named = np.argsort(-change, kind="stable")[:NAMED]
    axes.plot(np.delete(values, named, axis=1), color=QUIET, lw=0.7)
    symbols = [symbol for symbol, _ in MEANINGS.values()]
    for i, shade, line in zip(named, shades(NAMED), DASHES, strict=True):
        axes.plot(values[:, i], color=shade, linestyle=line, label=symbols[i])
    axes.set(title=f"{symbols[named[0]]} moves by {change.max():.2g}", ylabel="component of θ [-]")
    if change.max() > WIDE:
        decades = np.log10(np.nanmax(np.abs(values)))
        axes.set_yscale("symlog", linthresh=1, linscale=max(3, decades / 2))
        axes.yaxis.get_major_locator().set_params(numticks=7)  # type: ignore[call-arg]
    axes.margins(y=0.9)
    axes.legend(loc="upper center", ncols=2, handlelength=1.5, columnspacing=1)


def _steps(axes: Axes, records: Records) -> None:
    """The largest alpha ||phi||^2 of each episode, and the line at 2."""
    largest = largest_steps(records)
    each_episode(axes, largest, **LOOKS[records.experiment["learner"]].line)
    axes.axhline(OVERSHOOT, **LIMIT)
    axes.set_ylim(0, 1.1 * np.nanmax(largest, initial=1.1 * OVERSHOOT))
    over, count = (records.steps["alpha_phi2"] > OVERSHOOT).sum(), len(records.steps["episode"])
    axes.set_title(f"{over} of {count:,} steps above 2")
    axes.set_ylabel(r"largest $\alpha\,\|\phi\|^2$ [-]")

"""Figs. 1 to 4 of the paper, drawn from our runs as it draws them: raw sums, its own colours.

Its text names the colours of two figures: in Fig. 1 RDES is blue, DES black and dashed; in Fig. 2
GES is red, ES blue. It names none for Figs. 3 and 4, in which RDES stays blue and GES red here.
Nowhere else in the book has a learner another look than `style.LOOKS` gives it.
"""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nmpcrl.analysis import metrics
from nmpcrl.claims.thresholds import divergence, instability, of_records, path_distance
from nmpcrl.report.figures.axes import below, label_panel
from nmpcrl.report.figures.style import DECAY_TITLES, LIMIT, SUBTITLE, headed, page, subplots
from nmpcrl.study import paper
from nmpcrl.study.records import Column, Records, Stopped
from nmpcrl.study.store import Runs

BLUE, BLACK, RED = "#0050B5", "#000000", "#C8102E"
FIGURE_1 = {"DES": (BLACK, "--"), "RDES": (BLUE, "-")}
FIGURE_2 = {"ES": (BLUE, "-"), "GES": (RED, "-")}
LEARNED = {"RDES": (BLUE, "-"), "GES": (RED, "--")}  # its two methods, in Figs. 3 and 4

Looks = dict[str, tuple[str, str]]  # colour and line style by learner


@page
def figure_1(runs: Runs[Records]) -> Figure:
    """Sum of the RL cost over each training episode: DES and RDES.

    Args:
        runs: of both, and of the frozen arm, by which divergence is judged and which is not drawn.
    """
    counts = _counted(runs, divergence, FIGURE_1)
    return headed(_summed_costs(runs, FIGURE_1), f"Divergence: {counts}")


@page
def figure_2(runs: Runs[Records]) -> Figure:
    """The same for ES and GES."""
    counts = _counted(runs, instability, FIGURE_2)
    return headed(_summed_costs(runs, FIGURE_2), f"Instability: {counts}")


@page
def figure_3(runs: Runs[Records]) -> Figure:
    """Inputs of the learned policies of RDES and GES against time, without noise."""
    plant = paper.nmpc().plant
    kept = _finished(runs)
    figure, axes = _against_time(kept, 1, plant.action_names, height=4.0)
    for row, low, high in zip(axes, plant.lower, plant.upper, strict=True):
        for axis in row:
            axis.axhline(low, **LIMIT)
            axis.axhline(high, **LIMIT)
    actions = [metrics.final_rollout(records)[1] for records in kept.values()]
    outside = sum(metrics.out_of_bounds(one, plant.lower, plant.upper).sum() for one in actions)
    verb = f"{outside} inputs leave" if outside else "all inputs keep within"
    return headed(figure, f"In {len(actions)} rollouts of RDES and GES, {verb} their bounds")


@page
def figure_4(runs: Runs[Records]) -> Figure:
    """States under the learned policies of RDES and GES against time, without noise."""
    plant, kept = paper.nmpc().plant, _finished(runs)
    (layout,) = runs.values_of("layout")
    figure, axes = _against_time(kept, 0, plant.state_names, height=5.2)
    for row, target in zip(axes, paper.task(layout).target, strict=True):
        for axis in row:
            axis.axhline(target, **LIMIT)
    apart = policy_distances(runs)
    title = f"RDES and GES come to be up to {np.max(apart):.2f} m apart" if apart.size else ""
    return headed(figure, title or "No pair of runs of RDES and GES was finished")


def policy_distances(runs: Runs[Records]) -> Column:
    """Largest distance [m] of RDES from GES, without noise, of each pair that was finished."""
    paths: dict[tuple[str, int], dict[str, Column]] = {}
    for experiment, records in _finished(runs).items():
        pair = paths.setdefault((experiment.decay, experiment.seed), {})
        pair[experiment.learner] = metrics.final_rollout(records)[0]
    pairs = [tuple(pair.values()) for pair in paths.values() if len(pair) == len(LEARNED)]
    return np.array([path_distance(*pair) for pair in pairs])


def _summed_costs(runs: Runs[Records], looks: Looks) -> Figure:
    """Raw training costs, a panel a reading of the decay and a line a seed."""
    decays = runs.values_of("decay")
    figure, panels = subplots(1, len(decays), height=3.4, sharey=True, squeeze=False)
    for axes, decay in zip(panels[0], decays, strict=True):
        for learner, (color, line) in looks.items():
            for i, records in enumerate(runs.select(learner=learner, decay=decay).values()):
                cost = metrics.training_cost(records)
                label = None if i else learner
                axes.plot(np.arange(1, cost.size + 1), cost, color=color, ls=line, label=label)
        label_panel(axes, decay)
    panels[0, 0].set_ylabel("sum of the RL stage cost [-]")
    _legend(figure, looks)
    return figure


def _against_time(
    kept: Runs[Records], part: int, components: tuple[str, ...], height: float
) -> tuple[Figure, Column]:
    """States (part 0) or actions (part 1) of the last rollouts: a row a component."""
    decays, period = kept.values_of("decay") or ("step",), paper.nmpc().plant.period
    options: dict[str, Any] = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, grid = subplots(len(components), len(decays), height, **options)
    for column, decay in zip(grid.T, decays, strict=True):
        for learner, (color, line) in LEARNED.items():
            for records in kept.select(learner=learner, decay=decay).values():
                values = metrics.final_rollout(records)[part]
                for axes, along in zip(column, values.T, strict=True):
                    axes.plot(period * np.arange(along.size), along, color=color, ls=line, lw=1.2)
        column[0].set_title(DECAY_TITLES[decay], **SUBTITLE)
        column[-1].set_xlabel("time [s]")
    for axes, name in zip(grid[:, 0], components, strict=True):
        axes.set_ylabel(name)
    _legend(figure, LEARNED)
    return figure, grid


def _finished(runs: Runs[Records]) -> Runs[Records]:
    """Those of the paper's two methods that left a policy: training was not stopped."""
    return Runs(
        {
            experiment: records
            for experiment, records in runs.items()
            if experiment.learner in LEARNED and records.facts["stopped"] == Stopped.FINISHED
        }
    )


def _legend(figure: Figure, looks: Looks) -> None:
    """One entry a learner, below all panels."""
    axes = figure.axes[0]
    lines = [axes.plot([], [], color=color, ls=line)[0] for color, line in looks.values()]
    below(figure, lines, list(looks))


def _counted(
    runs: Runs[Records], wrong: Callable[[pd.DataFrame], pd.Series], learners: Iterable[str]
) -> str:
    """How many runs of each learner went wrong: "DES in 1 of 4 runs, ..."."""
    known = of_records(runs)
    each = wrong(known).groupby(known.learner)
    counts = {name: each.get_group(name) for name in learners}
    return ", ".join(f"{name} in {one.sum()} of {len(one)} runs" for name, one in counts.items())

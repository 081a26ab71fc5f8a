"""Figures of Expected Sarsa: theta, its largest steps, and the cost with noise and without."""

import numpy as np
from matplotlib.figure import Figure

from nmpcrl.analysis.metrics import by_episode, noise_free_cost, training_cost
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import below, logarithmic_if_wide, over_episodes
from nmpcrl.report.figures.style import (
    DECAY_TITLES,
    INK,
    LOOKS,
    QUIET,
    SUBTITLE,
    TEAL,
    WINE,
    headed,
    most_moved,
    page,
    shades,
    subplots,
    symbol,
)
from nmpcrl.report.run import thetas
from nmpcrl.study import Runs
from nmpcrl.study.paper import THETA_NAMES
from nmpcrl.study.records import Records


@page
def theta_paths(runs: Runs[Records]) -> Figure:
    """theta of the given runs over training, one panel a reading of the decay.

    Components that move by less than 0.02 in every run are drawn in grey.
    """
    decays = runs.values_of("decay")
    figure, panels = subplots(1, len(decays), height=3.8, sharey=True, squeeze=False)
    change = np.max([np.ptp(thetas(records), axis=0) for records in runs.values()], axis=0)
    moving = np.flatnonzero(change > 0.02)
    lines = ["-", "--", "-.", ":"]
    for axes, decay in zip(panels[0], decays, strict=True):
        for run, records in enumerate(runs.select(decay=decay).values()):
            values = thetas(records)
            axes.plot(values, color=QUIET, lw=0.7)
            for i, (component, shade) in enumerate(zip(moving, shades(len(moving)), strict=True)):
                axes.plot(
                    values[:, component],
                    color=shade,
                    ls=lines[i % len(lines)],
                    label=symbol(THETA_NAMES[component]) if run == 0 else None,
                )
        axes.set_title(DECAY_TITLES[decay], **SUBTITLE)
        over_episodes(axes)
    panels[0, 0].set_ylabel("component of θ (no unit)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    below(figure, handles, labels)
    return headed(figure, most_moved(change))


@page
def overshoot(runs: Runs[Records]) -> Figure:
    """The largest alpha ||phi||^2 of each episode of the given runs."""
    figure, axes = subplots(height=3.4)
    worst = 0.0
    for experiment, records in runs.items():
        largest = by_episode(records, records.steps["alpha_phi2"], np.max)
        first = experiment.seed == runs.values_of("seed")[0]
        color, line = (TEAL, "--") if experiment.decay == "step" else (WINE, "-")
        axes.plot(
            np.arange(1, len(largest) + 1),
            largest,
            color=color,
            ls=line,
            label=DECAY_TITLES[experiment.decay] if first else None,
        )
        worst = max(worst, np.nanmax(largest))
    axes.axhline(OVERSHOOT, color=INK, ls=":", lw=1)
    axes.annotate(
        "above: overshoots",
        (0, OVERSHOOT),
        (4, 3),
        axes.get_yaxis_transform(),
        textcoords="offset points",
        bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none"},  # on runs
    )
    side = "passes 2: such a step overshoots" if worst > OVERSHOOT else "stays below 2"
    axes.set(
        title=f"The largest step of an episode {side}",
        ylabel=r"largest $\alpha\,\|\phi\|^2$ (no unit)",
    )
    over_episodes(axes)
    if worst > 10:
        axes.set_yscale("log")
    else:
        axes.set_ylim(0, 1.08 * max(2.2, worst))
    axes.legend()
    return figure


@page
def two_costs(runs: Runs[Records]) -> Figure:
    """Cost with noise and without, of a learner and of the baseline; a column a decay."""
    decays = runs.values_of("decay")
    figure, grid = subplots(2, len(decays), height=5.2, sharex=True, sharey="row", squeeze=False)
    for column, decay in zip(grid.T, decays, strict=True):
        for experiment, records in runs.select(decay=decay).items():
            look = LOOKS[experiment.learner]
            first = experiment.seed == runs.values_of("seed")[0]
            label = experiment.learner if first else None
            cost = training_cost(records)
            column[0].plot(np.arange(1, len(cost) + 1), cost, label=label, lw=1.2, **look.line)
            column[1].plot(*noise_free_cost(records), label=label, **look.line)
        column[0].set_title(DECAY_TITLES[decay], **SUBTITLE)
        over_episodes(column[1], "episodes trained")
    grid[0, 0].set_ylabel("with noise [cost]")
    grid[1, 0].set_ylabel("without noise [cost]")
    for row in grid:
        logarithmic_if_wide(row)
    grid[0, 0].legend()
    fall = frozen_fall(runs)
    return headed(
        figure,
        f"With noise, the cost of a frozen θ falls by up to {fall:.0%} by itself"
        if fall > 0.05
        else "Few episodes: exploration has hardly begun to decay",
    )


def frozen_fall(runs: Runs[Records]) -> float:
    """The largest share by which the noisy cost of a frozen run fell: nothing was learned."""
    return max(_fall(records) for records in runs.select(learner="frozen").values())


def _fall(records: Records) -> float:
    cost = training_cost(records)
    window = max(1, len(cost) // 15)
    return float(1 - np.nanmedian(cost[-window:]) / np.nanmedian(cost[:window]))

"""Figures of Expected Sarsa: theta, its largest steps, and the cost with noise and without."""

from itertools import cycle

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis import metrics
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import (
    below,
    by_decay,
    each_episode,
    legend,
    logarithmic_if_wide,
    over_episodes,
)
from nmpcrl.report.figures.style import (
    INK,
    LOOKS,
    MEANINGS,
    QUIET,
    Drawn,
    page,
    shades,
    subplots,
    titled,
)
from nmpcrl.study import Runs
from nmpcrl.study.records import Records

DASHES = ("-", "--", "-.", ":")
HUGE = 10.0  # of alpha ||phi||^2


def thetas(records: Records) -> Matrix:
    """theta at the start and after each episode, shape (episodes + 1, d)."""
    last = np.append(np.flatnonzero(np.diff(records.steps["episode"])), -1)
    return np.vstack([records.experiment["theta"], records.steps["theta"][last]])


def largest_steps(records: Records) -> Vector:
    """The largest alpha ||phi||^2 of each episode; what is above `HUGE` is drawn there."""
    return metrics.by_episode(records, records.steps["alpha_phi2"].clip(max=HUGE), np.max)


@page
def theta_paths(runs: Runs[Records]) -> Drawn:
    """theta of the given runs over training, one panel a decay of the noise.

    Components that move by less than 0.02 in every run are drawn in grey.
    """
    decays = runs.values_of("decay")
    figure, panels = subplots(1, len(decays), height=3.8, sharey=True, squeeze=False)
    change = np.max([np.ptp(thetas(records), axis=0) for records in runs.values()], axis=0)
    moving, names = np.flatnonzero(change > 0.02), list(MEANINGS)
    looks = list(zip(moving, shades(len(moving)), cycle(DASHES), strict=False))
    for axes, decay in zip(panels[0], decays, strict=True):
        for records in runs.select(decay=decay).values():
            axes.plot(thetas(records), color=QUIET, lw=0.7)
            for i, shade, line in looks:
                axes.plot(thetas(records)[:, i], color=shade, ls=line)
        over_episodes(axes, decay)
    for i, shade, line in looks:
        axes.plot([], [], color=shade, ls=line, label="{} ({})".format(*MEANINGS[names[i]]))
    panels[0, 0].set_ylabel("component of θ (no unit)")
    below(figure, *axes.get_legend_handles_labels())
    most = int(np.argmax(change))
    symbol, _ = MEANINGS[names[most]]
    return titled(figure, f"{symbol} moves most, by up to {change[most]:.2g}")


@page
def overshoot(runs: Runs[Records], learners: tuple[str, ...]) -> Drawn:
    """The largest alpha ||phi||^2 of each episode, one panel a decay; 2 is marked."""
    label = r"largest $\alpha\,\Vert\phi\Vert^2$ (no unit)"
    figure, panels = by_decay(runs, learners, largest_steps, label)
    for axes in panels:
        axes.axhline(OVERSHOOT, color=INK, ls=":", lw=1)
    panels[0].set_ylim(0, None)
    shares = {
        name: np.median([metrics.overshooting(one) for one in runs.select(learner=name).values()])
        for name in learners
    }
    listed = ", ".join(f"{name} {share:.1%}" for name, share in shares.items())
    return titled(figure, f"Steps above 2 (dotted) in the median run: {listed}")


@page
def two_costs(runs: Runs[Records]) -> Drawn:
    """Cost with noise and without, of a learner and of the baseline; a column a decay."""
    decays = runs.values_of("decay")
    figure, grid = subplots(2, len(decays), height=5.2, sharex=True, sharey="row", squeeze=False)
    for column, decay in zip(grid.T, decays, strict=True):
        for experiment, records in runs.select(decay=decay).items():
            look = LOOKS[experiment.learner].line
            each_episode(column[0], metrics.training_cost(records), lw=1.2, **look)
            judged = records.evaluations
            column[1].plot(judged["episode"], judged["cost"], **look)
        over_episodes(column[0], decay, "")
        over_episodes(column[1], "", "episodes trained")
    grid[0, 0].set_ylabel("with noise [cost]")
    grid[1, 0].set_ylabel("without noise [cost]")
    for row in grid:
        logarithmic_if_wide(*row)
    legend(figure, runs.values_of("learner"))
    fall = frozen_fall(runs)
    return titled(figure, f"With noise, the cost falls by up to {fall:.0%} without learning")


def frozen_fall(runs: Runs[Records]) -> float:
    """The largest share by which the noisy cost of a frozen run fell: nothing was learned."""
    return max(_fall(records) for records in runs.select(learner="frozen").values())


def _fall(records: Records) -> float:
    cost = metrics.training_cost(records)
    window = max(1, len(cost) // 15)
    return float(1 - np.nanmedian(cost[-window:]) / np.nanmedian(cost[:window]))

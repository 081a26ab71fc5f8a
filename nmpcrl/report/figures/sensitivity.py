"""Figures of the value's gradient, and of Expected Sarsa that follows it."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.metrics import noise_free_cost, training_cost
from nmpcrl.report.figures.controller import INK, LESS, MORE, SYMBOLS
from nmpcrl.report.figures.style import LOOKS, page, subplots
from nmpcrl.study.paper import THETA_NAMES
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs

LETTING = {"step": "decay per step", "episode": "decay per episode"}


@page
def one_variable(theta: Vector, values: Vector, at: float, slope: float) -> Figure:
    """The value of min (x - theta)^2 subject to x >= 1, and its slope at one theta.

    Args:
        theta: where the problem was solved, shape (k,).
        values: its optimal value there, shape (k,).
        at: the theta of the tangent.
        slope: dV/dtheta there.
    """
    figure, axes = subplots(height=3.0)
    axes.plot(theta, values, color=INK, label=r"$V(\theta)$")
    near = np.array([at - 0.6, at + 0.6])
    axes.plot(near, np.interp(at, theta, values) + slope * (near - at), color=MORE, lw=2.2)
    axes.plot(at, np.interp(at, theta, values), "D", color=MORE, label=f"slope {slope:g}")
    axes.axvline(1, color=LESS, ls="-.", lw=1, label="the constraint lets go")
    axes.set(
        title="The value falls until the constraint lets go",
        xlabel=r"$\theta$ (no unit)",
        ylabel="optimal value (no unit)",
    )
    axes.legend()
    return figure


@page
def gradient_errors(steps: Vector, forward: Vector, central: Vector) -> Figure:
    """How far finite differences are from the envelope theorem's gradient.

    Args:
        steps: the step sizes, shape (k,).
        forward: relative error of forward differences, shape (k,).
        central: relative error of central differences, shape (k,).
    """
    figure, axes = subplots(height=3.4)
    axes.loglog(steps, forward, "s--", color=LESS, ms=4, label="forward: 9 more solves")
    axes.loglog(steps, central, "o-", color=MORE, ms=4, label="central: 18 more solves")
    best = int(np.argmin(central))
    axes.set(
        title=f"Differences agree to {central[best]:.0e}, if the step is near {steps[best]:.0e}",
        xlabel="step in each component of θ (no unit)",
        ylabel="distance to the envelope\ngradient, relative",
    )
    axes.legend()
    return figure


@page
def kink(offsets: Vector, values: Vector, edge: float, slopes: tuple[float, float]) -> Figure:
    """V against theta_c where the start crosses an obstacle's boundary.

    Args:
        offsets: theta_c - edge, shape (k,).
        values: V there, shape (k,).
        edge: the theta_c that puts the start on the boundary.
        slopes: dV/dtheta_c on the left and on the right of it.
    """
    figure, axes = subplots(height=3.3)
    middle = np.interp(0, offsets, values)
    axes.plot(offsets, values - middle, "o", color=INK, ms=4, label="solved")
    for slope, side, color, line in zip(slopes, (-1, 1), (LESS, MORE), ("--", "-"), strict=True):
        reach = np.array([0, side * np.abs(offsets).max()])
        axes.plot(reach, slope * reach, line, color=color, label=f"slope {slope:.1f}")
    axes.set(
        title=f"At the boundary the slope jumps by {slopes[1] - slopes[0]:.1f}",
        xlabel=rf"$\theta_c$ − {edge:.3f} (no unit)",
        ylabel="V − V at the boundary [cost]",
    )
    axes.legend()
    return figure


@page
def theta_paths(study: Runs) -> Figure:
    """theta of the given runs over training, one panel a reading of the decay.

    Components that move by less than 0.02 in every run are drawn in grey.
    """
    decays = study.values_of("decay")
    figure, panels = subplots(1, len(decays), height=3.8, sharey=True, squeeze=False)
    change = np.max([np.ptp(_thetas(records), axis=0) for records in study.values()], axis=0)
    moving = np.flatnonzero(change > 0.02)
    shades = plt.get_cmap("cividis")(np.linspace(0.0, 0.8, len(moving)))
    lines = ["-", "--", "-.", ":"]
    for axes, decay in zip(panels[0], decays, strict=True):
        for run, records in enumerate(study.select(decay=decay).values()):
            thetas = _thetas(records)
            axes.plot(thetas, color="#BBBBBB", lw=0.7)
            for i, (component, shade) in enumerate(zip(moving, shades, strict=True)):
                axes.plot(
                    thetas[:, component],
                    color=shade,
                    ls=lines[i % len(lines)],
                    label=f"${SYMBOLS[THETA_NAMES[component]]}$" if run == 0 else None,
                )
        axes.set(title=LETTING[decay], xlabel="episode")
    panels[0, 0].set_ylabel("component of θ (no unit)")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=max(1, len(labels)))
    figure.suptitle(_most(change), x=0.01, ha="left", fontweight="bold")
    return figure


@page
def overshoot(study: Runs) -> Figure:
    """The largest alpha ||phi||^2 of each episode of the given runs."""
    figure, axes = subplots(height=3.4)
    worst = 0.0
    for experiment, records in study.items():
        episodes, steps = records.steps["episode"], records.steps["alpha_phi2"]
        cuts = np.flatnonzero(np.diff(episodes)) + 1
        largest = [np.nanmax(part) for part in np.split(steps, cuts)]
        first = experiment.seed == study.values_of("seed")[0]
        color, line = (LESS, "--") if experiment.decay == "step" else (MORE, "-")
        axes.plot(
            np.arange(1, len(largest) + 1),
            largest,
            color=color,
            ls=line,
            label=LETTING[experiment.decay] if first else None,
        )
        worst = max(worst, *largest)
    axes.axhline(2, color=INK, ls=":", lw=1)
    axes.annotate(
        "above: overshoots", (0, 2), (4, 3), axes.get_yaxis_transform(), textcoords="offset points"
    )
    side = "passes 2: such a step overshoots" if worst > 2 else "stays below 2"
    axes.set(
        title=f"The largest step of an episode {side}",
        xlabel="episode",
        ylabel=r"largest $\alpha\,\|\phi\|^2$ (no unit)",
    )
    if worst > 10:
        axes.set_yscale("log")
    else:
        axes.set_ylim(0, 1.08 * max(2.2, worst))
    axes.legend()
    return figure


@page
def two_costs(study: Runs) -> Figure:
    """Cost with noise and without, of a learner and of the frozen arm; a column a decay."""
    decays = study.values_of("decay")
    figure, grid = subplots(2, len(decays), height=5.2, sharex=True, sharey="row", squeeze=False)
    for column, decay in zip(grid.T, decays, strict=True):
        for experiment, records in study.select(decay=decay).items():
            look = LOOKS[experiment.learner]
            first = experiment.seed == study.values_of("seed")[0]
            label = experiment.learner if first else None
            cost = training_cost(records)
            column[0].plot(np.arange(1, len(cost) + 1), cost, label=label, lw=1.2, **look.line)
            column[1].plot(*noise_free_cost(records), label=label, **look.line)
        column[0].set_title(LETTING[decay])
        column[1].set_xlabel("episodes trained")
    grid[0, 0].set_ylabel("with noise [cost]")
    grid[1, 0].set_ylabel("without noise [cost]")
    for row in grid:
        _logarithmic_if_wide(row)
    grid[0, 0].legend()
    fall = frozen_fall(study)
    figure.suptitle(
        f"With noise, the cost of a frozen θ falls by up to {fall:.0%} by itself"
        if fall > 0.05
        else "Few episodes: exploration has hardly begun to decay",
        x=0.01,
        ha="left",
        fontweight="bold",
    )
    return figure


def frozen_fall(study: Runs) -> float:
    """The largest share by which the noisy cost of a frozen run fell: nothing was learned."""
    return max(_fall(records) for records in study.select(learner="frozen").values())


def _fall(records: Records) -> float:
    cost = training_cost(records)
    window = max(1, len(cost) // 15)
    return float(1 - np.nanmedian(cost[-window:]) / np.nanmedian(cost[:window]))


def _thetas(records: Records) -> Matrix:
    """theta at the start and after each episode, shape (episodes + 1, d)."""
    last = np.append(np.flatnonzero(np.diff(records.steps["episode"])), -1)
    return np.vstack([records.experiment["theta"], records.steps["theta"][last]])


def _most(change: Vector) -> str:
    """The title of `theta_paths`: which component moved most, in any run."""
    most = int(np.argmax(change))
    return f"${SYMBOLS[THETA_NAMES[most]]}$ moves most, by up to {change[most]:.2g}"


def _logarithmic_if_wide(row: list[Axes]) -> None:
    """A run that blows up must not flatten the others."""
    points = [line.get_ydata() for axes in row for line in axes.get_lines()]
    values = np.concatenate([np.asarray(y, float) for y in points])
    values = values[np.isfinite(values)]
    if values.size and values.max() > 5 * values.min():
        row[0].set_yscale("log")

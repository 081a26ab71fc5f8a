"""Figures of runs over episodes: theta and its steps, costs, the network's errors, GES and TDC."""

from collections.abc import Iterable, Mapping
from itertools import cycle
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis import metrics
from nmpcrl.analysis.extrapolation import Outcome
from nmpcrl.analysis.imitation import Imitation
from nmpcrl.analysis.two_state import Chain, follow, spectral_radius
from nmpcrl.learning.learners import gradient_td, semi_gradient
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import (
    by_decay,
    each_episode,
    entries,
    logarithmic_if_wide,
    over_episodes,
)
from nmpcrl.report.figures.style import (
    AT_ONE,
    INK,
    LIMIT,
    LOOKS,
    MEANINGS,
    QUIET,
    TEAL,
    WINE,
    Drawn,
    page,
    shades,
    subplots,
    titled,
)
from nmpcrl.study import Runs, paper
from nmpcrl.study.records import Records

DASHES = ("-", "--", "-.", ":")
HUGE = 10.0  # of alpha ||phi||^2
WATCHED: dict[str, dict[str, Any]] = {  # by the interventions of `analysis.extrapolation`
    "none": {"label": "RDES", **LOOKS["RDES"].line},
    "theta held": {"label": "θ held", "color": WINE, "linestyle": "--"},
    "true slope": {"label": "true slope", "color": TEAL, "linestyle": "-"},
}
SHOWN = (0.05, 100.0)  # of alpha ||phi||^2; what is larger stands at the edge


# Numbers of a run by episode.


def thetas(records: Records) -> Matrix:
    """theta at the start and after each episode, shape (episodes + 1, d)."""
    last = np.append(np.flatnonzero(np.diff(records.steps["episode"])), -1)
    return np.vstack([records.experiment["theta"], records.steps["theta"][last]])


def largest_steps(records: Records) -> Vector:
    """The largest alpha ||phi||^2 of each episode; what is above `HUGE` is drawn there."""
    return metrics.by_episode(records, records.steps["alpha_phi2"].clip(max=HUGE), np.max)


def online_errors(records: Records) -> Vector:
    """Root mean square of the network's error of the next value in each episode."""
    error = metrics.online_error(records)
    return metrics.by_episode(records, error, metrics.root_mean_square)


def frozen_fall(runs: Runs[Records]) -> float:
    """The largest share by which the noisy cost of a frozen run fell: nothing was learned."""
    falls = []
    for records in runs.select(learner="frozen").values():
        cost = metrics.training_cost(records)
        window = max(1, len(cost) // 15)
        falls.append(1 - np.nanmedian(cost[-window:]) / np.nanmedian(cost[:window]))
    return float(max(falls))


# Expected Sarsa.


@page
def theta_paths(runs: Runs[Records]) -> Drawn:
    """theta of the given runs over training, one panel a decay of the noise.

    Components that move by less than 0.02 in every run are drawn in grey.
    """
    decays = runs.values_of("decay")
    figure, panels = subplots(1, len(decays), height=3.8, sharey=True, squeeze=False)
    change = np.max([np.ptp(thetas(records), axis=0) for records in runs.values()], axis=0)
    moving, meanings = np.flatnonzero(change > 0.02), list(MEANINGS.values())
    looks = list(zip(moving, shades(len(moving)), cycle(DASHES), strict=False))
    for axes, decay in zip(panels[0], decays, strict=True):
        for records in runs.select(decay=decay).values():
            axes.plot(thetas(records), color=QUIET, lw=0.7)
            for i, shade, line in looks:
                axes.plot(thetas(records)[:, i], color=shade, ls=line)
        over_episodes(axes, decay)
    for i, shade, line in looks:
        axes.plot([], [], color=shade, ls=line, label="{} ({})".format(*meanings[i]))
    panels[0, 0].set_ylabel("component of θ (no unit)")
    most = int(np.argmax(change))
    title = f"{meanings[most][0]} moves most, by up to {change[most]:.2g}"
    return titled(figure, title, legend=axes)


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
    title = f"Steps above 2 (dotted) in the median run: {listed}"
    return titled(figure, title, legend=entries(learners))


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
    title = f"With noise, the cost falls by up to {frozen_fall(runs):.0%} without learning"
    return titled(figure, title, legend=entries(runs.values_of("learner")))


# A network in the place of the second solve.


@page
def literal_and_gated(literal: Records, gated: Records) -> Drawn:
    """theta_x over the first two episodes, with and without waiting for the first fit."""
    figure, axes = subplots(height=2.9)
    for records, name, line in ((literal, "literal", "--"), (gated, "gated", "-")):
        theta_x = np.append(records.experiment["theta"][0], records.steps["theta"][:, 0])
        axes.plot(theta_x, line, color=LOOKS["RDES"].color)
        axes.annotate(f" {name}", (theta_x.size - 1, theta_x[-1]), va="center")
    first, *_ = np.flatnonzero(np.isfinite(gated.steps["next_value"]))
    axes.axvline(first, **AT_ONE)
    top = axes.get_xaxis_transform()
    axes.text(first, 0.75, "first fit ", transform=top, ha="right", color="0.35")
    axes.set(xlabel="step", ylabel=r"$\theta_x$ (no unit)")
    axes.margins(x=0.08)
    lowest = literal.steps["theta"][:first, 0].min()
    title = rf"Without a gate, $\theta_x$ falls to {lowest:.2f} before the network is fitted"
    return titled(figure, title)


@page
def online(runs: Runs[Records]) -> Drawn:
    """The error of the next value while learning, one panel a decay of the noise."""
    learners = ("DES", "RDES")
    figure, panels = by_decay(runs, learners, online_errors, "error of the\nnext value [cost]")
    panels[0].set_yscale("log")
    last = {}
    for learner in learners:
        errors = map(online_errors, runs.select(learner=learner).values())
        known = [one[np.isfinite(one)] for one in errors]
        last[learner] = np.median([np.median(one[one.size // 2 :]) for one in known])
    medians = " and ".join(f"{error:.0f} ({name})" for name, error in last.items())
    title = f"In the second half of training, the next value is off by {medians}"
    return titled(figure, f"{title}: medians of the runs", legend=entries(learners))


@page
def held_out_errors(imitations: Iterable[Imitation]) -> Drawn:
    """Error of the two networks on each held-out episode of some runs."""
    imitations = tuple(imitations)
    figure, axes = subplots(height=2.9)
    for k, run in enumerate(imitations):
        fitted = {"DES": (run.without_theta, "(s, a)"), "RDES": (run.with_theta, "(s, a, θ)")}
        for learner, (prediction, inputs) in fitted.items():
            episodes = np.unique(run.episode)
            squares = (prediction - run.value) ** 2
            error = [np.sqrt(squares[run.episode == one].mean()) for one in episodes]
            look = LOOKS[learner].dots(lw=1.2, markersize=3.5) | LOOKS[learner].line
            axes.semilogy(episodes + 1, error, label=f"input {inputs}" if k == 0 else None, **look)
    over_episodes(axes, xlabel="held-out episode")
    axes.set_ylabel("error of the network [cost]")
    axes.legend()
    ratios = np.array([run.ratio for run in imitations])
    helped = f"{(ratios < 1).sum()} of {len(ratios)} runs"
    title = f"With θ as an input, the error is smaller in {helped}"
    return titled(figure, f"{title} (median ratio {np.median(ratios):.2f})")


@page
def interventions(watched: Mapping[str, Mapping[str, Outcome]], finding: str) -> Drawn:
    """Largest alpha ||phi||^2 and median feedback of each episode, two panels a run.

    Args:
        watched: by the name of a run, and then by intervention.
        finding: the title.
    """
    figure, axes = subplots(2, len(watched), 4.6, sharex="col", sharey="row", squeeze=False)
    for (step, feedback), (name, outcomes) in zip(axes.T, watched.items(), strict=True):
        for how, one in outcomes.items():
            episodes = np.arange(1, one.episodes + 1)
            largest = np.where(one.overshoot > 0, one.overshoot, np.nan).clip(max=SHOWN[1])
            step.semilogy(episodes, largest, **WATCHED[how])
            feedback.plot(episodes, one.feedback, **WATCHED[how])
            if one.stopped:
                step.plot(episodes[-1], largest[-1], "X", color=WATCHED[how]["color"], ms=8)
        step.axhline(OVERSHOOT, **LIMIT)
        step.set_ylim(SHOWN[0], 1.5 * SHOWN[1])
        feedback.axhline(1, **AT_ONE)
        step.set_title(name)
        over_episodes(feedback)
    axes[0, 0].set_ylabel(r"largest $\alpha\,\Vert\phi\Vert^2$ (no unit)")
    axes[1, 0].set_ylabel("feedback (no unit)")
    return titled(figure, finding, legend=axes[0, 0])


# Gradient TD in the place of the semi-gradient.


@page
def on_the_chain(chain: Chain, alpha: float, ratios: tuple[float, ...], updates: int) -> Drawn:
    """theta over expected updates, and the spectral radius against beta / alpha."""
    figure, (left, right) = subplots(1, 2, 3.3)
    path = follow(chain, semi_gradient(alpha), updates)[:, 0]
    left.semilogy(np.abs(path), **LOOKS["ES"].line, label="semi-gradient")
    for ratio, line in zip(ratios, ("-", "--", ":", "-."), strict=False):
        rule = gradient_td(alpha, ratio * alpha, chain.gamma)
        path = np.abs(follow(chain, rule, updates)[:, 0])
        label = rf"gradient TD, $\beta = {ratio:g}\alpha$"
        left.semilogy(path, line, color=LOOKS["GES"].color, label=label)
    left.set(xlabel="update", ylabel=r"$|\theta|$ (no unit)", ylim=(1e-3, 1e4))
    grid = np.geomspace(0.05, 20, 2000)
    radius = np.array(
        [spectral_radius(chain, gradient_td(alpha, r * alpha, chain.gamma)) for r in grid]
    )
    right.semilogx(grid, radius, color=LOOKS["GES"].color)
    right.axhline(1, **AT_ONE)
    table_i = paper.BETA / paper.ALPHA
    right.axvline(table_i, color="0.35", linewidth=1, linestyle=":")
    right.annotate(" Table I", (table_i, radius.min()), color="0.35")
    right.set(xlabel=r"$\beta / \alpha$ (no unit)", ylabel="spectral radius (no unit)")
    least = grid[radius < 1].min(initial=np.inf)
    return titled(figure, f"Gradient TD converges once β is above {least:.2f} α", legend=left)

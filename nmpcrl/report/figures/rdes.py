"""Figures of chapter 3: a network in the place of the second solve."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from nmpcrl.analysis import metrics
from nmpcrl.analysis.imitation import Imitation
from nmpcrl.claims.paper_claims import diverged
from nmpcrl.report.figures.style import LOOKS, page, subplots
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs

DECAYS = {"step": "noise decays per step", "episode": "noise decays per episode"}
CEILING = 1.3  # multiple of theta_init's noise-free cost at which the panels without noise end


@page
def literal_and_gated(literal: Records, gated: Records) -> Figure:
    """theta_x over the first two episodes, with and without waiting for the first fit."""
    figure, axes = subplots(height=2.9)
    for records, name, line in ((literal, "literal", "--"), (gated, "gated", "-")):
        theta_x = np.append(records.experiment["theta"][0], records.steps["theta"][:, 0])
        axes.plot(theta_x, line, color=LOOKS["RDES"].color)
        axes.annotate(f" {name}", (theta_x.size - 1, theta_x[-1]), va="center")
    fits = np.flatnonzero(np.isfinite(gated.steps["next_value"]))
    if fits.size:
        axes.axvline(fits[0], color="0.6", linewidth=1)
        place = {"xycoords": ("data", "axes fraction"), "ha": "right", "color": "0.35"}
        axes.annotate("first fit ", (fits[0], 0.75), **place)
    lowest = literal.steps["theta"][: fits[0] if fits.size else None, 0].min()
    axes.set(xlabel="step", ylabel=r"$\theta_x$ [-]", title=f"Without a gate, {_fall(lowest)}")
    axes.margins(x=0.08)
    return figure


@page
def online_errors(study: Runs, learners: tuple[str, ...] = ("DES", "RDES")) -> Figure:
    """Root mean square of the online error in each episode, one panel a reading of the decay."""
    decays = study.values_of("decay")
    figure, axes = subplots(1, len(decays), sharey=True, squeeze=False)
    last: dict[str, list[float]] = {learner: [] for learner in learners}
    for panel, decay in zip(axes[0], decays, strict=True):
        for learner in learners:
            for records in study.select(learner=learner, decay=decay).values():
                error = metrics.by_episode(
                    records, metrics.online_error(records), metrics.root_mean_square
                )
                panel.semilogy(np.arange(1, error.size + 1), error, **thin(learner))
                known = error[np.isfinite(error)]
                last[learner].extend(known[known.size // 2 :])
        label_panel(panel, decay)
    axes[0, 0].set_ylabel("error of the next value [cost]")
    one_entry_each(axes[0, -1], learners)
    means = " and ".join(f"{np.median(last[name]):.0f} ({name})" for name in learners)
    return headed(figure, f"In the second half of training, the next value is off by {means}")


@page
def held_out_errors(imitations: Iterable[Imitation]) -> Figure:
    """Error of the two networks on each held-out episode of some runs."""
    imitations = tuple(imitations)
    figure, axes = subplots(height=2.9)
    for run in imitations:
        for prediction, learner in ((run.without_theta, "DES"), (run.with_theta, "RDES")):
            episodes = np.unique(run.episode)
            squares = (prediction - run.value) ** 2
            error = [np.sqrt(squares[run.episode == one].mean()) for one in episodes]
            axes.semilogy(episodes + 1, error, marker=LOOKS[learner].marker, **thin(learner))
    label_panel(axes, xlabel="held-out episode")
    axes.set_ylabel("error of the network [cost]")
    one_entry_each(
        axes, ("DES", "RDES"), {"DES": "told (s, a)", "RDES": "told (s, a, θ)"}, marker=True
    )
    ratios = np.array([run.ratio for run in imitations])
    helped, all_runs = int((ratios < 1).sum()), len(ratios)
    title = f"Told θ, the network errs less in {helped} of {all_runs} runs"
    axes.set_title(f"{title} (median ratio {np.median(ratios):.2f})")
    return figure


@page
def figure_1(study: Runs) -> Figure:
    """Figure 1 of the paper, DES against RDES, with the noise-free cost and the frozen arm."""
    figure = learning_curves(study, ("DES", "RDES"))
    counts = [f"{name} in {runs_where(study, name, diverged)}" for name in ("DES", "RDES")]
    return headed(figure, f"Divergence: {', '.join(counts)} runs")


@page
def learning_curves(study: Runs, learners: tuple[str, ...]) -> Figure:
    """Summed RL cost of each training episode above, cost without noise below; frozen beside.

    One column a reading of the decay, one line a seed.
    """
    decays, shown = study.values_of("decay"), (*learners, "frozen")
    options = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = subplots(2, len(decays), 5.0, **options)
    for (above, below), decay in zip(axes.T, decays, strict=True):
        for learner in shown:
            for records in study.select(learner=learner, decay=decay).values():
                cost = metrics.training_cost(records)
                above.plot(np.arange(1, cost.size + 1), cost, **thin(learner))
                below.plot(*metrics.noise_free_cost(records), **thin(learner))
        label_panel(above, decay, xlabel="")
        label_panel(below)
    axes[0, 0].set_ylabel("cost of a training episode [-]")
    axes[1, 0].set_ylabel("cost without noise [-]")
    low, high = axes[1, 0].get_ylim()
    axes[1, 0].set_ylim(low, min(high, CEILING * _initial(study)))
    one_entry_each(axes[0, -1], shown)
    return figure


def _initial(study: Runs) -> float:
    return metrics.initial_cost(next(iter(study.values())))


def runs_where(
    study: Runs, learner: str, measure: Callable[[Runs, Experiment, Records], bool]
) -> str:
    """In how many of the learner's runs `measure` holds, in words."""
    judged = [measure(study, *pair) for pair in study.select(learner=learner).items()]
    return f"{sum(judged)} of {len(judged)}"


def _fall(lowest: float) -> str:
    verb = "falls" if lowest < 1 else "stays"
    return rf"$\theta_x$ {verb} to {lowest:.2f} before the network is fitted"


def label_panel(axes: Axes, decay: str = "", xlabel: str = "episode") -> None:
    """Which reading of the decay a panel shows, and whole episodes below."""
    axes.set_title(DECAYS.get(decay, ""), fontsize="medium", fontweight="normal")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel(xlabel)


def thin(learner: str) -> dict[str, Any]:
    """How one of several lines of a learner is drawn."""
    return {**LOOKS[learner].line, "linewidth": 1.2, "markersize": 3.5, "alpha": 0.85}


def one_entry_each(
    axes: Axes,
    learners: tuple[str, ...],
    names: Mapping[str, str] = MappingProxyType({}),
    *,
    marker: bool = False,
) -> None:
    """A legend with one entry a learner, however many lines it has."""
    for learner in learners:
        look = {**thin(learner), "marker": LOOKS[learner].marker if marker else None}
        axes.plot([], [], label=names.get(learner, learner), **look)
    axes.legend()


def headed(figure: Figure, finding: str) -> Figure:
    """The figure with the finding above all panels."""
    figure.suptitle(finding, x=0.01, ha="left", fontsize=10.5, fontweight="bold")
    return figure

"""Figures of RDES: a network in the place of the second solve."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis import metrics
from nmpcrl.analysis.extrapolation import Outcome
from nmpcrl.analysis.imitation import Imitation
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import below, by_decay, over_episodes
from nmpcrl.report.figures.style import (
    AT_ONE,
    LIMIT,
    LOOKS,
    TEAL,
    WINE,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs

WATCHED: dict[str, dict[str, Any]] = {  # by the interventions of `analysis.extrapolation`
    "none": {"label": "RDES", **LOOKS["RDES"].line},
    "theta held": {"label": "θ held", "color": WINE, "linestyle": "--"},
    "true slope": {"label": "true slope", "color": TEAL, "linestyle": "-"},
}
SHOWN = (0.05, 100.0)  # of alpha ||phi||^2; what is larger stands at the edge


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


def online_errors(records: Records) -> Vector:
    """Root mean square of the network's error of the next value in each episode."""
    error = metrics.online_error(records)
    return metrics.by_episode(records, error, metrics.root_mean_square)


@page
def online(runs: Runs[Records], learners: tuple[str, ...] = ("DES", "RDES")) -> Drawn:
    """The error of the next value while learning, one panel a decay of the noise."""
    figure, panels = by_decay(runs, learners, online_errors, "error of the\nnext value [cost]")
    panels[0].set_yscale("log")
    last = {}
    for learner in learners:
        errors = map(online_errors, runs.select(learner=learner).values())
        known = [one[np.isfinite(one)] for one in errors]
        last[learner] = np.median([np.median(one[one.size // 2 :]) for one in known])
    medians = " and ".join(f"{error:.0f} ({name})" for name, error in last.items())
    title = f"In the second half of training, the next value is off by {medians}"
    return titled(figure, f"{title}: medians of the runs")


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
            overshoot = np.where(one.overshoot > 0, one.overshoot, np.nan).clip(max=SHOWN[1])
            step.semilogy(episodes, overshoot, **WATCHED[how])
            feedback.plot(episodes, one.feedback, **WATCHED[how])
            if one.stopped:
                step.plot(episodes[-1], overshoot[-1], "X", color=WATCHED[how]["color"], ms=8)
        step.axhline(OVERSHOOT, **LIMIT)
        step.set_ylim(SHOWN[0], 1.5 * SHOWN[1])
        feedback.axhline(1, **AT_ONE)
        step.set_title(name)
        over_episodes(feedback)
    axes[0, 0].set_ylabel(r"largest $\alpha\,\Vert\phi\Vert^2$ (no unit)")
    axes[1, 0].set_ylabel("feedback (no unit)")
    below(figure, *axes[0, 0].get_legend_handles_labels())
    return titled(figure, finding)

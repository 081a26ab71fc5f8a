"""Figures of RDES: a network in the place of the second solve."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from nmpcrl.analysis import metrics
from nmpcrl.analysis.extrapolation import Outcome
from nmpcrl.analysis.imitation import Imitation
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import label_panel, one_entry_each, over_episodes
from nmpcrl.report.figures.style import (
    AT_ONE,
    LIMIT,
    LOOKS,
    SUBTITLE,
    TEAL,
    WINE,
    headed,
    page,
    subplots,
    thin,
)
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs

WATCHED: dict[str, dict[str, Any]] = {  # by the interventions of `analysis.extrapolation`
    "none": LOOKS["RDES"].line,
    "theta held": {"color": WINE, "linestyle": "--"},
    "true slope": {"color": TEAL, "linestyle": "-"},
}
NAMES = {"none": "RDES", "theta held": "θ held", "true slope": "true slope"}
SHOWN = (0.05, 100.0)  # of alpha ||phi||^2; what is larger stands at the edge


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
        axes.axvline(fits[0], **AT_ONE)
        place = {"xycoords": ("data", "axes fraction"), "ha": "right", "color": "0.35"}
        axes.annotate("first fit ", (fits[0], 0.75), **place)
    lowest = literal.steps["theta"][: fits[0] if fits.size else None, 0].min()
    axes.set(xlabel="step", ylabel=r"$\theta_x$ [-]", title=f"Without a gate, {_fall(lowest)}")
    axes.margins(x=0.08)
    return figure


@page
def online_errors(runs: Runs[Records], learners: tuple[str, ...] = ("DES", "RDES")) -> Figure:
    """Root mean square of the online error in each episode, one panel a reading of the decay."""
    decays = runs.values_of("decay")
    figure, axes = subplots(1, len(decays), sharey=True, squeeze=False)
    last: dict[str, list[float]] = {learner: [] for learner in learners}
    for panel, decay in zip(axes[0], decays, strict=True):
        for learner in learners:
            for records in runs.select(learner=learner, decay=decay).values():
                error = metrics.by_episode(
                    records, metrics.online_error(records), metrics.root_mean_square
                )
                panel.semilogy(np.arange(1, error.size + 1), error, **thin(learner))
                known = error[np.isfinite(error)]
                if known.size:
                    last[learner].append(np.median(known[known.size // 2 :]))
        label_panel(panel, decay)
    axes[0, 0].set_ylabel("error of the\nnext value [cost]")
    one_entry_each(axes[0, -1], learners)
    means = " and ".join(f"{np.median(last[name]):.0f} ({name})" for name in learners)
    title = f"In the second half of training, the next value is off by {means}"
    return headed(figure, f"{title}: medians of the runs")


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
        axes, ("DES", "RDES"), {"DES": "input (s, a)", "RDES": "input (s, a, θ)"}, marker=True
    )
    ratios = np.array([run.ratio for run in imitations])
    helped, all_runs = int((ratios < 1).sum()), len(ratios)
    title = f"With θ as an input, the error is smaller in {helped} of {all_runs} runs"
    axes.set_title(f"{title} (median ratio {np.median(ratios):.2f})")
    return figure


@page
def interventions(watched: Mapping[str, Mapping[str, Outcome]], finding: str) -> Figure:
    """Largest alpha ||phi||^2 and median feedback of each episode, a column a run.

    Args:
        watched: by the name of a run, and then by intervention.
        finding: the title.
    """
    options: dict[str, Any] = {"sharex": "col", "sharey": "row", "squeeze": False, "across": 1}
    figure, axes = subplots(2, len(watched), 4.4, **options)
    for column, (name, outcomes) in zip(axes.T, watched.items(), strict=True):
        for how, one in outcomes.items():
            episodes = np.arange(1, one.episodes + 1)
            step = np.where(one.overshoot > 0, one.overshoot, np.nan).clip(max=SHOWN[1])
            column[0].semilogy(episodes, step, label=NAMES[how], **WATCHED[how])
            column[1].plot(episodes, one.feedback, **WATCHED[how])
            if one.stopped:
                column[0].plot(episodes[-1], step[-1], "X", color=WATCHED[how]["color"], ms=8)
        column[0].axhline(OVERSHOOT, **LIMIT)
        column[0].set_ylim(SHOWN[0], 1.5 * SHOWN[1])
        column[1].axhline(1, **AT_ONE)
        column[0].set_title(name, **SUBTITLE)
        over_episodes(column[1])
    axes[0, 0].set_ylabel(r"largest $\alpha\,\Vert\phi\Vert^2$ [-]")
    axes[1, 0].set_ylabel("feedback [-]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return headed(figure, finding)


def _fall(lowest: float) -> str:
    verb = "falls" if lowest < 1 else "stays"
    return rf"$\theta_x$ {verb} to {lowest:.2f} before the network is fitted"

"""Figures of exact TDC: how fast w may be, and what each part of the learner does."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import below, over_episodes
from nmpcrl.report.figures.style import LIMIT, LOOKS, headed, page, subplots
from nmpcrl.study.records import LAST, Stopped

PARTS: dict[
    str, dict[str, Any]
] = {  # of TDC, each left out in turn; all in its colour but for the printed one
    "TDC": {"linestyle": "-", "linewidth": 2.2},
    "without h": {"linestyle": "--"},
    "not projected": {"linestyle": ":"},
    "slow w": {"linestyle": "-."},
    "GES": LOOKS["GES"].line,
}
WITHOUT = {
    "without h": "Leaving out h",
    "not projected": "Leaving out the projection",
    "slow w": "Slowing w down",
}


@page
def step_of_w(runs: Mapping[float, RunSummary]) -> Figure:
    """beta ||phi||^2 in each episode of TDC, for some beta: what is left of an error of w.

    Args:
        runs: by beta.
    """
    figure, axes = subplots(height=2.9)
    name, first, stopped = r"$\beta\,\|\phi\|^2$", "", ""
    for (beta, run), line in zip(runs.items(), ("--", "-", ":"), strict=False):
        size = run.episodes["alpha_phi2"] * beta / run.name.alpha
        episode = np.arange(1, len(size) + 1)
        label = rf"$\beta$ = {_scientific(beta)}"
        axes.plot(episode, size, color=LOOKS["TDC"].color, linestyle=line, label=label)
        over = np.flatnonzero(size > OVERSHOOT)
        if over.size and not first:
            first = f"With {label}, {name} passes {OVERSHOOT:g} in episode {over[0] + 1}"
            if run.facts["stopped"] != Stopped.FINISHED:
                stopped = ", and the run is stopped"
    axes.axhline(OVERSHOOT, **LIMIT)
    axes.set(ylabel=f"largest {name}", ylim=(0, 1.5 * OVERSHOOT))
    over_episodes(axes)
    axes.legend(loc="lower right")
    return headed(figure, f"{first}{stopped}" if first else f"{name} stays below {OVERSHOOT:g}")


@page
def parts_of_tdc(runs: Mapping[str, RunSummary]) -> Figure:
    """TDC with each of its parts left out: the noise-free cost, and the size of w.

    Args:
        runs: by what is in `PARTS`.
    """
    figure, (left, right) = subplots(1, 2, 3.3)
    for name, run in runs.items():
        look = {"color": LOOKS["TDC"].color} | PARTS[name]
        judged, size = run.evaluations, np.linalg.norm(run.episodes["w"], axis=1)
        left.plot(judged["episode"], judged["cost"] / judged["cost"][0], label=name, **look)
        right.plot(np.arange(1, len(size) + 1), size, **look)
    left.set(ylabel="noise-free cost / first")
    right.set(ylabel="size of w", yscale="log")
    for axes in (left, right):
        over_episodes(axes)
    below(figure, *left.get_legend_handles_labels())
    moved = {name: _end(runs[name]) - _end(runs["TDC"]) for name in WITHOUT}
    most = max(moved, key=lambda name: abs(moved[name]))
    by = f"{'lowers' if moved[most] < 0 else 'raises'} the final cost by {abs(moved[most]):.1%}"
    return headed(figure, f"{WITHOUT[most]} {by} of the first, more than the other two parts do")


def _scientific(value: float) -> str:
    """ "2.5 x 10^-7", as mathematics."""
    mantissa, exponent = f"{value:.1e}".split("e")
    return rf"${mantissa} \cdot 10^{{{int(exponent)}}}$"


def _end(run: RunSummary) -> float:
    """Final noise-free cost in shares of the first; infinite if a rollout failed."""
    cost = run.evaluations["cost"]
    return float(cost[-LAST:].mean() / cost[0])

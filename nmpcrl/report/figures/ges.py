"""Figures of GES and exact TDC: gradient TD in the place of the semi-gradient."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.gradient_td import directions
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.analysis.two_state import Chain, follow, spectral_radius
from nmpcrl.learning.learners import gradient_td, semi_gradient
from nmpcrl.report.figures.axes import below, by_decay, each_episode, over_episodes
from nmpcrl.report.figures.style import AT_ONE, LOOKS, Drawn, page, subplots, titled
from nmpcrl.study import paper
from nmpcrl.study.records import LAST, Records
from nmpcrl.study.store import Runs

PARTS: dict[str, dict[str, Any]] = {  # of TDC, each left out in turn
    "TDC": {"color": LOOKS["TDC"].color, "linestyle": "-", "linewidth": 2.2},
    "without h": {"color": LOOKS["TDC"].color, "linestyle": "--"},
    "not projected": {"color": LOOKS["TDC"].color, "linestyle": ":"},
    "slow w": {"color": LOOKS["TDC"].color, "linestyle": "-."},
    "GES": LOOKS["GES"].line,
}


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
    below(figure, *left.get_legend_handles_labels())
    least = grid[radius < 1].min(initial=np.inf)
    return titled(figure, f"Gradient TD converges once β is above {least:.2f} α")


def correction_shares(records: Records) -> Vector:
    """Length of the corrections over that of the semi-gradients, summed over each episode."""
    parts = directions(records)
    gradient, correction = (np.bincount(parts.episode, one) for one in parts.lengths)
    return correction / gradient


@page
def corrections(runs: Runs[Records]) -> Drawn:
    """Corrections beside semi-gradients in each episode of GES, one panel a decay."""
    label = "correction /\nsemi-gradient (no unit)"
    figure, panels = by_decay(runs, ("GES",), correction_shares, label, 3.0)
    panels[0].set_ylim(0, None)
    for axes in panels:
        axes.axhline(1, **AT_ONE)
    share = np.median([directions(one).share for one in runs.select(learner="GES").values()])
    return titled(figure, f"The corrections are {share:.2f} times as long as δφ (median run)")


@page
def curvatures(measured: tuple[pd.DataFrame, ...]) -> Drawn:
    """Size of the dropped term beside the printed direction, at sampled steps of GES."""
    figure, axes = subplots(height=2.6)
    for run in measured:
        axes.semilogy(run.episode + 1, run.ratio, ".", color=LOOKS["GES"].color)
    axes.axhline(1, **AT_ONE)
    over_episodes(axes)
    axes.set_ylabel("dropped / printed (no unit)")
    median = np.median(np.concatenate([run.ratio for run in measured]))
    return titled(figure, f"The dropped term is {median:.1%} of the printed one (median)")


@page
def parts_of_tdc(runs: Mapping[str, RunSummary]) -> Drawn:
    """TDC with each of its parts left out: the noise-free cost, and the size of w.

    Args:
        runs: by what is in `PARTS`.
    """
    figure, (left, right) = subplots(1, 2, 3.3)
    for name, run in runs.items():
        judged = run.evaluations
        left.plot(judged["episode"], judged["cost"] / judged["cost"][0], label=name, **PARTS[name])
        each_episode(right, np.linalg.norm(run.episodes["w"], axis=1), **PARTS[name])
    left.set(ylabel="noise-free cost / first")
    right.set(ylabel="size of w (no unit)", yscale="log")
    for axes in (left, right):
        over_episodes(axes)
    below(figure, *left.get_legend_handles_labels())
    moved = _end(runs["without h"]) - _end(runs["TDC"])
    return titled(figure, f"Without h, the final cost moves by {moved:+.1%} of the first")


def _end(run: RunSummary) -> float:
    """Final noise-free cost in shares of the first; infinite if a rollout failed."""
    cost = run.evaluations["cost"]
    return float(cost[-LAST:].mean() / cost[0])

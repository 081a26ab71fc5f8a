"""Figures of GES: gradient TD in the place of the semi-gradient."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from nmpcrl.analysis import metrics
from nmpcrl.analysis.gradient_td import Curvature, directions
from nmpcrl.analysis.two_state import Chain, follow, spectral_radius
from nmpcrl.learning.learners import gradient_td, semi_gradient
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.figures.axes import below, label_panel, one_entry_each
from nmpcrl.report.figures.style import AT_ONE, DECAY_TITLES, LOOKS, headed, page, subplots, thin
from nmpcrl.study import paper
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs


@page
def on_the_chain(chain: Chain, alpha: float, ratios: tuple[float, ...], updates: int) -> Figure:
    """theta over expected updates, and the spectral radius against beta / alpha."""
    figure, (left, right) = subplots(1, 2, 3.3)
    path = follow(chain, semi_gradient(alpha), updates)[:, 0]
    left.semilogy(np.abs(path), **LOOKS["ES"].line, label="semi-gradient")
    for ratio, line in zip(ratios, ("-", "--", ":", "-."), strict=False):
        rule = gradient_td(alpha, ratio * alpha, chain.gamma)
        path = np.abs(follow(chain, rule, updates)[:, 0])
        label = rf"gradient TD, $\beta = {ratio:g}\alpha$"
        left.semilogy(path, line, color=LOOKS["GES"].color, label=label)
    left.set(xlabel="update", ylabel=r"$|\theta|$ [-]", ylim=(1e-3, 1e4))
    below(figure, *left.get_legend_handles_labels())
    grid = np.geomspace(0.05, 20, 2000)
    radius = np.array(
        [spectral_radius(chain, gradient_td(alpha, r * alpha, chain.gamma)) for r in grid]
    )
    right.semilogx(grid, radius, color=LOOKS["GES"].color)
    right.axhline(1, **AT_ONE)
    right.axvline(paper.BETA / paper.ALPHA, color="0.35", linewidth=1, linestyle=":")
    right.annotate(" Table I", (paper.BETA / paper.ALPHA, radius.min()), color="0.35")
    right.set(xlabel=r"$\beta / \alpha$ [-]", ylabel="spectral radius [-]")
    enough = grid[radius < 1]
    return headed(
        figure,
        f"Gradient TD converges once β is above {enough.min():.2f} α"
        if enough.size
        else "Gradient TD converges at no ratio shown",
    )


@page
def overshoots(runs: Runs[Records], learners: tuple[str, ...] = ("ES", "GES")) -> Figure:
    """Largest alpha ||phi||^2 of each episode, one panel a reading of the decay; 2 is marked."""
    decays = runs.values_of("decay")
    figure, axes = subplots(1, len(decays), 3.0, sharey=True, squeeze=False)
    for panel, decay in zip(axes[0], decays, strict=True):
        for learner in learners:
            for records in runs.select(learner=learner, decay=decay).values():
                largest = metrics.by_episode(records, records.steps["alpha_phi2"], np.max)
                panel.plot(np.arange(1, largest.size + 1), largest, **thin(learner))
        panel.axhline(OVERSHOOT, color="0.35", linewidth=1)
        edge = {"xycoords": ("axes fraction", "data"), "ha": "right", "va": "bottom"}
        panel.annotate("2", (1, OVERSHOOT), color="0.35", **edge)
        label_panel(panel, decay)
    axes[0, 0].set_ylim(0, None)
    axes[0, 0].set_ylabel(r"largest $\alpha\,\Vert\phi\Vert^2$ [-]")
    one_entry_each(axes[0, -1], learners)
    shares = {
        name: float(np.median([metrics.overshooting(records) for records in mine.values()]))
        for name in learners
        if (mine := runs.select(learner=name))
    }
    return headed(figure, f"In the median run, {_above(shares)}")


def _above(shares: Mapping[str, float]) -> str:
    """What share of the steps of each learner is above 2, in words."""
    if not any(shares.values()):
        return f"no step of {' or '.join(shares)} is above {OVERSHOOT:g}"
    listed = [f"{share:.1%} of the steps of {name}" for name, share in shares.items()]
    return f"{' and '.join(listed)} are above {OVERSHOOT:g}"


@page
def corrections(runs: Runs[Records]) -> Figure:
    """Corrections beside semi-gradients, summed over each episode of GES; a line a run."""
    figure, axes = subplots(height=2.9)
    shares = []
    for experiment, records in runs.select(learner="GES").items():
        parts = directions(records)
        gradient, correction = (np.bincount(parts.episode, one) for one in parts.lengths)
        look = {**thin("GES"), "linestyle": "-" if experiment.decay == "step" else ":"}
        axes.plot(np.arange(1, gradient.size + 1), correction / gradient, **look)
        shares.append(parts.share)
    for decay in runs.values_of("decay"):
        line = "-" if decay == "step" else ":"
        axes.plot([], [], color=LOOKS["GES"].color, linestyle=line, label=DECAY_TITLES[decay])
    axes.axhline(1, **AT_ONE)
    label_panel(axes)
    axes.set(ylabel="correction / semi-gradient [-]", ylim=(0, None))
    below(figure, *axes.get_legend_handles_labels())
    axes.set_title(f"The corrections are {np.median(shares):.2f} times as long as δφ (median run)")
    return figure


@page
def curvatures(measured: tuple[Curvature, ...]) -> Figure:
    """Size of the dropped term beside the printed direction, at sampled steps of GES."""
    figure, axes = subplots(height=2.6)
    for run in measured:
        axes.semilogy(run.episode + 1, run.ratio, ".", color=LOOKS["GES"].color)
    every = np.concatenate([run.ratio for run in measured])
    axes.axhline(1, **AT_ONE)
    label_panel(axes)
    axes.set(ylabel="dropped / printed [-]")
    axes.set_title(f"The dropped term is {np.median(every):.1%} of the printed one (median)")
    return figure

"""Figures of chapter 4: gradient TD in the place of the semi-gradient."""

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from nmpcrl import Matrix, Vector
from nmpcrl.learning.learners import gradient_td, semi_gradient
from nmpcrl.study import metrics, paper
from nmpcrl.study.chain import Chain, follow, growth
from nmpcrl.study.claims import unstable
from nmpcrl.study.curvature import Curvature
from nmpcrl.study.figures.rdes import (
    DECAYS,
    by_episode,
    headed,
    label_panel,
    learning_curves,
    one_entry_each,
    runs_where,
    theta_before,
    thin,
)
from nmpcrl.study.figures.style import LOOKS, PAGE, subplots
from nmpcrl.study.records import Records
from nmpcrl.study.store import Study

OVERSHOOT = 2.0  # alpha ||phi||^2 beyond which a semi-gradient step overshoots its target
TIGHT = 0.999  # cosine from which two features are called parallel


@dataclass(frozen=True, eq=False)
class Directions:
    """What moves theta in each step of a run of GES."""

    episode: Vector  # of each step, shape (steps,)
    semi_gradient: Matrix  # delta phi, shape (steps, d)
    correction: Matrix  # gamma (w'phi) phi+, shape (steps, d)
    delta: Vector  # TD errors
    predicted: Vector  # w'phi, what w expects delta to be

    @property
    def lengths(self) -> tuple[Vector, Vector]:
        """Norms of the semi-gradients and of the corrections."""
        return _norm(self.semi_gradient), _norm(self.correction)

    @property
    def share(self) -> float:
        """Summed length of the corrections over that of the semi-gradients."""
        semi_gradient, correction = self.lengths
        return float(correction.sum() / semi_gradient.sum())

    @property
    def net(self) -> float:
        """How far theta got, over how far the semi-gradients that it met add up to."""
        went = (self.semi_gradient - self.correction).sum(axis=0)
        return float(np.linalg.norm(went) / np.linalg.norm(self.semi_gradient.sum(axis=0)))


def directions(records: Records) -> Directions:
    """Take the steps of a run of GES apart: the correction is what theta did not do of delta phi.

    Eq. (16) gives gamma (w'phi) phi+ = delta phi - (theta' - theta) / alpha, without a solve.
    """
    steps, alpha = records.steps, records.experiment["alpha"]
    known = np.isfinite(steps["delta"])
    before = np.vstack([np.full(steps["w"].shape[1], paper.W_INIT), steps["w"][:-1]])
    along = steps["delta"][:, None] * steps["features"]
    correction = along - (steps["theta"] - theta_before(records)) / alpha
    predicted = np.sum(before * steps["features"], axis=1)
    columns = (steps["episode"], along, correction, steps["delta"], predicted)
    return Directions(*(column[known] for column in columns))


def next_over_this(records: Records) -> Vector:
    """gamma phi'phi+ / phi'phi, step by step: above 1 a semi-gradient step feeds itself."""
    steps = records.steps
    this, after = steps["features"][:-1], steps["features"][1:]
    ratio = paper.GAMMA * np.sum(this * after, axis=1) / np.sum(this**2, axis=1)
    same_episode = steps["episode"][1:] == steps["episode"][:-1]
    return ratio[same_episode & np.isfinite(ratio)]


def parallel_share(records: Records) -> float:
    """Share of the steps whose phi and phi+ point the same way, to a cosine of `TIGHT`."""
    steps = records.steps
    this, after = steps["features"][:-1], steps["features"][1:]
    cosine = np.sum(this * after, axis=1) / (_norm(this) * _norm(after))
    same_episode = steps["episode"][1:] == steps["episode"][:-1]
    return float(np.mean(cosine[same_episode & np.isfinite(cosine)] > TIGHT))


@plt.rc_context(PAGE)
def on_the_chain(chain: Chain, alpha: float, ratios: tuple[float, ...], updates: int) -> Figure:
    """theta over expected updates, and the growth per update against beta / alpha."""
    figure, (left, right) = subplots(1, 2, 3.3)
    path = follow(chain, semi_gradient(alpha), updates)[:, 0]
    left.semilogy(np.abs(path), **LOOKS["ES"].line, label="semi-gradient")
    for ratio, line in zip(ratios, ("-", "--", ":", "-."), strict=False):
        rule = gradient_td(alpha, ratio * alpha, chain.gamma)
        path = np.abs(follow(chain, rule, updates)[:, 0])
        label = rf"gradient TD, $\beta = {ratio:g}\alpha$"
        left.semilogy(path, line, color=LOOKS["GES"].color, label=label)
    left.set(xlabel="update", ylabel=r"$|\theta|$ [-]", ylim=(1e-3, 1e4))
    figure.legend(loc="outside lower center", ncols=4, fontsize="small")
    grid = np.geomspace(0.05, 20, 2000)
    radius = np.array([growth(chain, gradient_td(alpha, r * alpha, chain.gamma)) for r in grid])
    right.semilogx(grid, radius, color=LOOKS["GES"].color)
    right.axhline(1, color="0.6", linewidth=1)
    right.axvline(paper.BETA / paper.ALPHA, color="0.35", linewidth=1, linestyle=":")
    right.annotate(" Table I", (paper.BETA / paper.ALPHA, radius.max()), color="0.35", va="top")
    right.set(xlabel=r"$\beta / \alpha$ [-]", ylabel="growth per update [-]")
    enough = grid[radius < 1]
    return headed(
        figure,
        f"Gradient TD converges once β is above {enough.min():.2f} α"
        if enough.size
        else "Gradient TD converges at no ratio shown",
    )


@plt.rc_context(PAGE)
def overshoots(study: Study, learners: tuple[str, ...] = ("ES", "GES")) -> Figure:
    """Largest alpha ||phi||^2 of each episode, one panel a reading of the decay; 2 is marked."""
    decays = study.values_of("decay")
    figure, axes = subplots(1, len(decays), 3.0, sharey=True, squeeze=False)
    for panel, decay in zip(axes[0], decays, strict=True):
        for learner in learners:
            for records in study.select(learner=learner, decay=decay).values():
                largest = by_episode(records, records.steps["alpha_phi2"], np.max)
                panel.plot(np.arange(1, largest.size + 1), largest, **thin(learner))
        panel.axhline(OVERSHOOT, color="0.35", linewidth=1)
        edge = {"xycoords": ("axes fraction", "data"), "ha": "right", "va": "bottom"}
        panel.annotate("2", (1, OVERSHOOT), color="0.35", **edge)
        label_panel(panel, decay)
    axes[0, 0].set_ylim(0, None)
    axes[0, 0].set_ylabel(r"largest $\alpha\,\Vert\phi\Vert^2$ [-]")
    one_entry_each(axes[0, -1], learners)
    shares = [
        f"{np.median([metrics.overshooting(r) for r in runs.values()]):.1%} of the steps of {name}"
        for name in learners
        if (runs := study.select(learner=name))
    ]
    return headed(figure, f"Steps above 2: {' and '.join(shares)} (medians)")


@plt.rc_context(PAGE)
def corrections(study: Study) -> Figure:
    """Corrections beside semi-gradients, summed over each episode of GES; a line a run."""
    runs = study.select(learner="GES")
    figure, axes = subplots(height=2.9)
    shares = []
    for experiment, records in runs.items():
        parts = directions(records)
        ours, theirs = (np.bincount(parts.episode, length) for length in parts.lengths)
        look = {**thin("GES"), "linestyle": "-" if experiment.decay == "step" else ":"}
        axes.plot(np.arange(1, ours.size + 1), theirs / ours, **look)
        shares.append(parts.share)
    for decay in study.values_of("decay"):
        line = "-" if decay == "step" else ":"
        axes.plot([], [], color=LOOKS["GES"].color, linestyle=line, label=DECAYS[decay])
    axes.axhline(1, color="0.6", linewidth=1)
    label_panel(axes)
    axes.set(ylabel="correction / semi-gradient [-]", ylim=(0, None))
    axes.legend()
    axes.set_title(f"The corrections are {np.median(shares):.2f} times as long as δφ (median run)")
    return figure


@plt.rc_context(PAGE)
def curvatures(measured: tuple[Curvature, ...]) -> Figure:
    """Size of the dropped term beside the printed direction, at sampled steps of GES."""
    figure, axes = subplots(height=2.6)
    for run in measured:
        axes.semilogy(run.episode + 1, run.ratio, ".", color=LOOKS["GES"].color, alpha=0.5)
    every = np.concatenate([run.ratio for run in measured])
    axes.axhline(1, color="0.6", linewidth=1)
    label_panel(axes)
    axes.set(ylabel="dropped / printed [-]")
    axes.set_title(f"The dropped term is {np.median(every):.1%} of the printed one (median)")
    return figure


@plt.rc_context(PAGE)
def figure_2(study: Study) -> Figure:
    """Figure 2 of the paper, ES against GES, with the noise-free cost and the frozen arm."""
    figure = learning_curves(study, ("ES", "GES"))
    counts = [f"{name} in {runs_where(study, name, unstable)}" for name in ("ES", "GES")]
    return headed(figure, f"Instability: {', '.join(counts)} runs")


def _norm(vectors: Matrix) -> Vector:
    return np.linalg.norm(vectors, axis=1)

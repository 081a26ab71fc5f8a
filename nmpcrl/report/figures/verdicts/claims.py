"""One figure a claim: what was measured in each run, and in what share it holds.

Every figure takes the claim's `Verdict`, and its title is the outcome and what it rests on. No run
is dropped: what was cut short is drawn in the grey strip marked ∞.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import PercentFormatter

from nmpcrl import Vector
from nmpcrl.analysis.gradient_td import Curvature
from nmpcrl.analysis.statistics import interquartile_mean
from nmpcrl.bench.learners import ratio
from nmpcrl.claims import paper_claims, thresholds
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.verdict import Assumption, Verdict
from nmpcrl.report.figures.axes import below, jitter, label_panel, logarithmic
from nmpcrl.report.figures.panels import part, shares, strips
from nmpcrl.report.figures.style import (
    AT_ONE,
    BAND,
    INK,
    LOOKS,
    STEP_PARTS,
    SUBTITLE,
    dots,
    hatched,
    headed,
    marked,
    page,
    subplots,
)
from nmpcrl.study import paper
from nmpcrl.study.experiment import PAPER, Experiment
from nmpcrl.study.records import Column, Records, Stopped

SOLVER_NAMES = {"riccati": "riccati", "fatrop": "fatrop", "ipopt": "Ipopt"}
ROOM = 12  # over the largest count, for the sums that stand above
LAGS = 30  # steps
ABOVE: dict[str, Any] = {
    "xycoords": ("data", "axes fraction"),
    "ha": "center",
    "va": "top",
    "rotation": 90,
    "fontsize": "small",
}
PROFILED = (-0.5, 0.15)  # shares of the cost saved
LAYOUT_MARKS = ("o", "s", "^", "D", "v", "P")
SIZE_MARKS = {"small": ("o", "0.55"), "medium": ("^", "0.3"), "large": ("s", "black")}


FINDINGS = {  # what holds in each run or pair of runs that says yes
    "C1": ("DES diverged and RDES did not", "pairs"),
    "C2": ("ES was unstable and GES was not", "pairs"),
    "C6": (
        "with θ as an input, the network's error is at most"
        f" {thresholds.MORE_ACCURATE} times as large",
        "runs",
    ),
    "C9": (f"learning reduces the cost by {thresholds.BETTER:.0%} or more", "runs"),
}


@page
def measured(found: Evidence, verdict: Verdict) -> Figure:
    """A claim of `FINDINGS`: its measure in every run, and in what share it holds.

    The share by which learning reduces the cost may be minus infinity, so C9 is drawn by what is
    left of the cost.
    """
    claim = BY_RUNS[verdict.claim]
    values, border, label = claim.measure(found.runs, found.paths), claim.threshold, claim.label
    if verdict.claim == "C9":
        values, border, label = 1 - values, 1 - border, "noise-free cost, end / start"
    figure, (axis, panel) = _panels()
    strips(axis, values, border)
    axis.set_ylabel(label)
    drawn = part(found, tuple(values))
    return _finished(figure, panel, verdict, *FINDINGS[verdict.claim], drawn)


@page
def times(timings: pd.DataFrame, verdict: Verdict, learner: str) -> Figure:
    """C3 and C4: a step of a learner in steps of ES, by solver and by what takes the time."""
    claim = paper_claims.BY_TIME[verdict.claim]
    solvers = list(timings.solver.unique())
    figure, axis = subplots(height=1.1 + 0.55 * len(solvers))
    axis.axvspan(*claim.claimed, **BAND)
    for row, solver in enumerate(solvers):
        per_learner = timings[timings.solver == solver].set_index("learner")
        for y, name in ((row - 0.2, "ES"), (row + 0.2, learner)):
            end = _bar(axis, y, per_learner.loc[name], per_learner.loc["ES"])
            text = f" {name} {ratio(timings, solver, name).value:.2f}"
            axis.annotate(text, (end, y), va="center", fontsize="small")
    axis.set_yticks(range(len(solvers)), [SOLVER_NAMES.get(solver, solver) for solver in solvers])
    axis.invert_yaxis()
    axis.margins(x=0.12)
    axis.set_xlabel("time of a step / time of a step of ES")
    handles = [Rectangle((0, 0), 1, 1, **hatched(*look)) for look in STEP_PARTS.values()]
    handles.append(Rectangle((0, 0), 1, 1, **BAND))
    names = [*STEP_PARTS, "as claimed"]
    below(figure, handles, names)
    solver = SOLVER_NAMES[paper_claims.SOLVER]
    if paper_claims.SOLVER not in solvers:
        return _titled(figure, verdict, f"no time was taken with {solver}")
    value = ratio(timings, paper_claims.SOLVER, learner)
    finding = f"with {solver}, a step of {learner} takes {value} of one of ES"
    return marked(_titled(figure, verdict, finding), "the published measurement")


@page
def same_policy(found: Evidence, verdict: Verdict) -> Figure:
    """C5: how far RDES and GES come apart in trajectory and in cost; a mark a pair."""
    drawn = part(found, ("RDES", "GES"))
    decays = found.summaries.values_of("decay")
    figure, axes = _panels(len(decays))
    pairs = _pairs(drawn)
    for axis, decay in zip(axes[:-1], decays, strict=True):
        _scatter(axis, pairs, decay)
        axis.set_title(f"noise per {decay}", **SUBTITLE)
        axis.tick_params(labelleft=axis is axes[0])
    axes[0].set_ylabel("noise-free costs apart\n/ cost at the start")
    names = dict.fromkeys(pairs.layout)
    below(figure, [Line2D([], [], label=name, **_layout_mark(name)) for name in names])
    finding = "RDES and GES end in the same policy"
    return _finished(figure, axes[-1], verdict, finding, "pairs", drawn)


@page
def violations(found: Evidence, verdict: Verdict) -> Figure:
    """C7: how many states of a run lay in an obstacle, in training and without noise, by size."""
    drawn = part(found, PAPER)
    figure, axes = _panels(2)
    kinds = {"inside": "in training", "eval_inside": "without noise"}
    for axis, (column, title) in zip(axes[:-1], kinds.items(), strict=True):
        _counts(axis, drawn.runs, column)
        axis.set_xlabel(title)
        axis.tick_params(labelleft=axis is axes[0])
    axes[0].set_ylabel("states of a run\nin an obstacle")
    top = max(axis.get_ylim()[1] for axis in axes[:-1])
    for axis in axes[:-1]:
        axis.set_ylim(-0.5, ROOM * top)
    sizes = zip(SIZE_MARKS.values(), ("Ξ up to 0.01", "up to 0.1", "above"), strict=True)
    handles = [
        Line2D([], [], label=name, **dots("frozen", marker=m, color=c)) for (m, c), name in sizes
    ]
    below(figure, handles)
    unit = f"runs of {' and '.join(BY_RUNS[verdict.claim].learners)}"
    return _finished(figure, axes[-1], verdict, "all constraints held", unit, drawn)


@page
def theorem(
    assumptions: Iterable[Assumption], verdict: Verdict, records: Records, curvature: Curvature
) -> Figure:
    """C8: how dependent the transitions of a run of GES are, and how large the dropped term is."""
    figure, (lags, dropped) = subplots(1, 2, across=1, tall=4.8)
    delta = records.steps["delta"][np.isfinite(records.steps["delta"])]
    steps = np.arange(1, min(LAGS, delta.size // 2) + 1)
    lags.bar(steps, [np.corrcoef(delta[:-k], delta[k:])[0, 1] for k in steps], color=INK)
    independent = 2 / np.sqrt(delta.size)
    lags.axhspan(-independent, independent, **BAND)
    lags.axhline(0, color=INK, linewidth=0.8)
    lags.set(xlabel="steps between two TD errors", ylabel="correlation")
    lags.set_title("grey: if drawn independently", **SUBTITLE)
    dropped.semilogy(curvature.episode + 1, curvature.ratio, ".", color=LOOKS["GES"].color)
    dropped.axhline(1, **AT_ONE)
    label_panel(dropped)
    dropped.set_ylabel("dropped term / printed direction")
    listed = tuple(assumptions)
    broken = sum(not one.holds for one in listed)
    finding = f"{broken} of {len(listed)} assumptions of two theorems do not hold for what is run"
    mark = f"a run of GES trained for this page: {Experiment(**records.experiment)}"
    return marked(_titled(figure, verdict, finding), mark)


@page
def learners(found: Evidence, finding: str) -> Figure:
    """All learners: interquartile mean of the final cost, and how many runs save how much."""
    figure, (middles, profile) = subplots(1, 2, across=1, tall=5.4)
    costs = {name: _final_costs(found, name) for name in found.summaries.values_of("learner")}
    means = {name: interquartile_mean(*cost) for name, cost in costs.items()}
    placed = logarithmic(middles, "x", np.concatenate([cost for cost, _ in costs.values()]), 1.0)
    for row, (name, mean) in enumerate(means.items()):
        look = LOOKS[name]
        cost = placed(costs[name][0])
        middles.plot(cost, row + jitter(cost.size, 0.25), ".", color=look.color, alpha=0.25)
        middles.plot(placed([mean.low, mean.high]), [row, row], color="black", linewidth=2.2)
        middles.plot(placed(mean.value), row, look.marker, color=look.color, mec="black")
        _profile(profile, 1 - costs[name][0], name)
    middles.set_yticks(range(len(means)), means)
    middles.axvline(1, **AT_ONE)
    middles.set(xlabel="noise-free cost, end / start", ylim=(len(means) - 0.5, -0.5))
    profile.set(
        xlabel="reduction of the noise-free cost, at least", ylabel="share of runs", ylim=(0, 1)
    )
    profile.xaxis.set_major_formatter(PercentFormatter(1, decimals=0))
    below(figure, *profile.get_legend_handles_labels())
    return marked(headed(figure, finding), found.mark)


def _panels(measured: int = 1) -> tuple[Figure, Column]:
    """Room for what was measured, and a narrower panel for the share of yes."""
    widths = (2.6 / measured,) * measured + (1,)
    return subplots(1, measured + 1, 3.7, width_ratios=widths, tall=1.3 + 2.3 * (measured + 1))


def _pairs(drawn: Evidence) -> pd.DataFrame:
    """How far RDES and GES are apart in path and in cost, a row a layout, decay and seed."""
    apart = paper_claims.policy_distances(drawn.runs, drawn.paths)
    return apart.assign(cost=apart.cost.mask(apart.failed, np.inf)).reset_index()


def _scatter(axis: Axes, pairs: pd.DataFrame, decay: str) -> None:
    """A mark a pair of one reading, in a panel that has room for both; its shape is the layout."""
    box = Rectangle(
        (0, 0), thresholds.SAME_PATH, thresholds.SAME_COST, facecolor="0.88", edgecolor=INK
    )
    axis.add_patch(box)
    across = logarithmic(axis, "x", pairs.path.to_numpy(float), thresholds.SAME_PATH)
    up = logarithmic(axis, "y", pairs.cost.to_numpy(float), thresholds.SAME_COST)
    for one in pairs[pairs.decay == decay].dropna(subset="cost").itertuples():
        axis.plot(across(one.path), up(one.cost), **_layout_mark(one.layout))
    axis.set_xlabel("robots apart [m]")


def _layout_mark(layout: str) -> dict[str, Any]:
    """A hollow mark by layout; those of one's own share one."""
    shapes = dict(zip(paper.LAYOUTS, LAYOUT_MARKS, strict=True))
    look = dots("GES", marker=shapes.get(layout, "o"), markersize=4.5)
    return {**look, "markerfacecolor": "none", "markeredgewidth": 0.8}


def _counts(axis: Axes, runs: pd.DataFrame, column: str) -> None:
    """Counts by size, a point a run, learners side by side; above them, how many in all."""
    names = list(runs.learner.unique())
    for i, name in enumerate(names):
        for offset, (size, (marker, color)) in zip(
            (-0.27, 0, 0.27), SIZE_MARKS.items(), strict=True
        ):
            counts = runs[f"{column}_{size}"][runs.learner == name].to_numpy(float)
            x = i + offset + jitter(counts.size, 0.1)
            axis.plot(x, counts, marker, color=color, markersize=2.5)
            axis.annotate(f"{counts.sum():.0f}", (i + offset, 0.99), **ABOVE)
    axis.set_yscale("symlog", linthresh=1)
    axis.set_xticks(range(len(names)), names)


def _profile(axis: Axes, saved: Vector, learner: str) -> None:
    """Share of runs that save at least as much."""
    thresholds = np.linspace(*PROFILED, 121)
    reached = [np.mean(saved >= threshold) for threshold in thresholds]
    axis.plot(thresholds, reached, label=learner, **LOOKS[learner].line)


def _bar(axis: Axes, row: float, mine: pd.Series, reference: pd.Series) -> float:
    """A step of a learner, part by part, in steps of the reference; where the bar ends."""
    parts = (mine.solves * mine.ms_per_solve, np.nan_to_num(mine.ms_per_fit), mine.ms_per_rest)
    left = 0.0
    for part_of, look in zip(parts, STEP_PARTS.values(), strict=True):
        width = float(part_of / reference.ms_per_step)
        axis.barh(row, width, 0.36, left, **hatched(*look))
        left += width
    return left


def _final_costs(found: Evidence, learner: str) -> tuple[Vector, list[str]]:
    """Noise-free cost at the end over that at the start, and the layout, of each run.

    A run that had to be stopped left no policy, so that its cost is infinite.
    """
    runs = part(found, (learner,)).runs
    cost = runs.final_cost.where(runs.stopped == Stopped.FINISHED, np.inf) / runs.initial_cost
    return cost.to_numpy(float), runs.layout.tolist()


def _finished(
    figure: Figure, panel: Axes, verdict: Verdict, finding: str, unit: str, drawn: Evidence
) -> Figure:
    """With the share of yes, the title, and where the runs come from."""
    shares(panel, verdict)
    yes, of = verdict.counts["all"]
    asked = f"{finding} in {yes} of {of} {unit}" if of else f"there are no {unit} to be asked"
    _titled(figure, verdict, asked)
    return marked(figure, drawn.mark)


def _titled(figure: Figure, verdict: Verdict, finding: str) -> Figure:
    title = f"{verdict.claim} {verdict.words}: {finding}"
    return headed(figure, title)

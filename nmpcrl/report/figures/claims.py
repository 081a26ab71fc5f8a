"""One figure a claim: what was measured in each run, and in what share it holds.

Every figure takes the claim's `Verdict`, and its title is the outcome and what it rests on. No run
is dropped: what was cut short is drawn in the grey strip marked ∞.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import PercentFormatter

from nmpcrl.analysis.statistics import interquartile_mean, rate
from nmpcrl.bench.learners import ratio
from nmpcrl.claims import paper_claims, rule, thresholds
from nmpcrl.claims.by_runs import Values
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.verdict import Assumption, Verdict
from nmpcrl.report.figures.axes import (
    below,
    interval,
    jitter,
    legend,
    logarithmic,
    over_episodes,
    stacked,
)
from nmpcrl.report.figures.results import part
from nmpcrl.report.figures.style import (
    AT_ONE,
    BAND,
    INK,
    LIMIT,
    LOOKS,
    STEP_PARTS,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.study import paper
from nmpcrl.study.experiment import PAPER, Experiment
from nmpcrl.study.records import Records, Stopped

LAGS = 30  # steps
ROOM = 12  # over the largest count, for the sums that stand above
PROFILED = np.linspace(-0.5, 0.15, 121)  # shares of the cost saved
LAYOUT_MARKS = ("o", "s", "^", "D", "v", "P")
SIZES = {  # of an overlap: mark, colour, words
    "small": ("o", "0.55", "Ξ up to 0.01"),
    "medium": ("^", "0.3", "up to 0.1"),
    "large": ("s", "black", "above"),
}
FINDINGS = {  # what holds in each run or pair of runs that says yes
    "C1": "DES diverged and RDES did not",
    "C2": "ES was unstable and GES was not",
    "C6": f"with θ the network's error is at most {thresholds.MORE_ACCURATE} times as large",
    "C9": f"learning reduces the cost by {thresholds.BETTER:.0%} or more",
}


@page
def measured(found: Evidence, verdict: Verdict) -> Drawn:
    """A claim of `FINDINGS`: its measure in every run, and in what share it holds.

    The share by which learning reduces the cost may be minus infinity, so C9 is drawn by what is
    left of the cost.
    """
    claim = BY_RUNS[verdict.claim]
    values, border, label = claim.measure(found.runs, found.paths), claim.threshold, claim.label
    if verdict.claim == "C9":
        values, border, label = 1 - values, 1 - border, "noise-free cost, end / start"
    figure, (axes, panel) = subplots(1, 2, 3.7, width_ratios=(2.6, 1))
    _strips(figure, axes, values, border)
    axes.set_ylabel(label)
    _shares(panel, verdict)
    drawn = part(found, tuple(values))
    return _judged(figure, verdict, _counted(verdict, FINDINGS[verdict.claim]), drawn.mark)


@page
def times(timings: pd.DataFrame, verdict: Verdict, learner: str) -> Drawn:
    """C3 and C4: a step of a learner in steps of ES, by solver and by what takes the time."""
    claim = paper_claims.BY_TIME[verdict.claim]
    chosen = timings[timings.learner.isin(["ES", learner])]
    solvers = list(chosen.solver.unique())
    figure, axes = subplots(height=1.1 + 0.55 * len(solvers))
    axes.axvspan(*claim.claimed, label="as claimed", **BAND)
    of_es = chosen.solver.map(chosen[chosen.learner == "ES"].set_index("solver").ms_per_step)
    times = (chosen.solves * chosen.ms_per_solve, chosen.ms_per_fit.fillna(0.0), chosen.ms_per_rest)
    parts = pd.DataFrame(dict(zip(STEP_PARTS, times, strict=True))).div(of_es, axis=0)
    rows = chosen.solver.map(solvers.index) + np.where(chosen.learner == "ES", -0.2, 0.2)
    stacked(axes, parts.set_index(rows), STEP_PARTS, 0.36)
    for y, end, row in zip(rows, parts.sum(axis=1), chosen.itertuples(), strict=True):
        text = f" {row.learner} {ratio(timings, row.solver, row.learner).value:.2f}"
        axes.annotate(text, (end, y), va="center", fontsize="small")
    axes.set_yticks(range(len(solvers)), solvers)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.set_xlabel("time of a step / time of a step of ES")
    below(figure, *axes.get_legend_handles_labels())
    value = ratio(timings, paper_claims.SOLVER, learner)
    finding = f"with Ipopt, a step of {learner} takes {value} of one of ES"
    return _judged(figure, verdict, finding, "the published measurement")


@page
def same_policy(found: Evidence, verdict: Verdict) -> Drawn:
    """C5: how far RDES and GES come apart in trajectory and in cost; a mark a pair."""
    drawn = part(found, ("RDES", "GES"))
    decays = found.summaries.values_of("decay")
    figure, axes = subplots(len(decays) + 1, 1, 8.2)
    pairs = paper_claims.policy_distances(drawn.runs, drawn.paths)
    pairs = pairs.assign(cost=pairs.cost.mask(pairs.failed, np.inf)).reset_index()
    for panel, decay in zip(axes, decays, strict=False):
        _scatter(panel, pairs, decay)
        panel.set(title=f"noise per {decay}", ylabel="noise-free costs apart\n/ cost at the start")
    _shares(axes[-1], verdict)
    names = dict.fromkeys(pairs.layout)
    below(figure, [Line2D([], [], label=name, **_layout_mark(name)) for name in names])
    return _judged(
        figure, verdict, _counted(verdict, "RDES and GES end in the same policy"), drawn.mark
    )


@page
def violations(found: Evidence, verdict: Verdict) -> Drawn:
    """C7: how many states of a run lay in an obstacle, in training and without noise, by size."""
    drawn = part(found, PAPER)
    figure, axes = subplots(3, 1, 8.2)
    kinds = {"inside": "in training", "eval_inside": "without noise"}
    for panel, (column, title) in zip(axes, kinds.items(), strict=False):
        _counts(panel, drawn.runs, column)
        panel.set(title=title, ylabel="states of a run\nin an obstacle")
    top = max(panel.get_ylim()[1] for panel in axes[:-1])
    for panel in axes[:-1]:
        panel.set_ylim(-0.5, ROOM * top)
    _shares(axes[-1], verdict)
    handles = [
        Line2D([], [], label=words, color=color, marker=mark, linestyle="", markersize=4)
        for mark, color, words in SIZES.values()
    ]
    below(figure, handles)
    unit = f"{_counted(verdict, 'all constraints held')} of {' and '.join(BY_RUNS['C7'].learners)}"
    return _judged(figure, verdict, unit, drawn.mark)


@page
def theorem(
    assumptions: Iterable[Assumption], verdict: Verdict, records: Records, curvature: pd.DataFrame
) -> Drawn:
    """C8: how dependent the transitions of a run of GES are, and how large the dropped term is."""
    figure, (lags, dropped) = subplots(2, 1, 4.8)
    delta = records.steps["delta"][np.isfinite(records.steps["delta"])]
    steps = np.arange(1, min(LAGS, delta.size // 2) + 1)
    lags.bar(steps, [np.corrcoef(delta[:-k], delta[k:])[0, 1] for k in steps], color=INK)
    independent = 2 / np.sqrt(delta.size)
    lags.axhspan(-independent, independent, **BAND)
    lags.axhline(0, color=INK, linewidth=0.8)
    lags.set(xlabel="steps between two TD errors", ylabel="correlation")
    lags.set_title("grey: if drawn independently")
    dropped.semilogy(curvature.episode + 1, curvature.ratio, ".", color=LOOKS["GES"].color)
    dropped.axhline(1, **AT_ONE)
    over_episodes(dropped)
    dropped.set_ylabel("dropped term /\nprinted direction")
    holding = [one.holds for one in assumptions]
    broken = f"{len(holding) - sum(holding)} of {len(holding)} assumptions of two theorems"
    source = f"a run of GES trained for this page: {Experiment(**records.experiment)}"
    return _judged(figure, verdict, f"{broken} do not hold for what is run", source)


@page
def learners(found: Evidence, finding: str) -> Drawn:
    """All learners: interquartile mean of the final cost, and how many runs save how much.

    A run that had to be stopped left no policy, so that its cost is infinite.
    """
    figure, (middles, profile) = subplots(2, 1, 5.4)
    runs = found.runs
    costs = runs.final_cost.where(runs.stopped == Stopped.FINISHED, np.inf) / runs.initial_cost
    placed = logarithmic(middles, "x", costs.to_numpy(float), 1.0)
    names = found.summaries.values_of("learner")
    for row, name in enumerate(names):
        look, mine = LOOKS[name], costs[runs.learner == name].to_numpy(float)
        mean = interquartile_mean(mine, list(runs.layout[runs.learner == name]))
        middles.plot(placed(mine), row + jitter(len(mine), 0.25), ".", color=look.color, alpha=0.25)
        middles.plot(placed([mean.low, mean.high]), [row, row], color="black", linewidth=2.2)
        middles.plot(placed(mean.value), row, look.marker, color=look.color, mec="black")
        reached = [np.mean(1 - mine >= share) for share in PROFILED]
        profile.plot(PROFILED, reached, label=name, **look.line)
    middles.set_yticks(range(len(names)), names)
    middles.axvline(1, **AT_ONE)
    middles.set(xlabel="noise-free cost, end / start", ylim=(len(names) - 0.5, -0.5))
    profile.set(
        xlabel="reduction of the noise-free cost, at least", ylabel="share of runs", ylim=(0, 1)
    )
    profile.xaxis.set_major_formatter(PercentFormatter(1, decimals=0))
    legend(figure, names)
    return titled(figure, finding, found.mark)


def _strips(figure: Drawn, axes: Axes, values: Values, border: float) -> None:
    """Every run's number above its layout: learners side by side, the second decay hollow.

    A short line is the median of a learner and decay; the dashed one is the claim's threshold.
    """
    placed = logarithmic(axes, "y", values.to_numpy(float).ravel(), border)
    layouts, decays = values.index.unique("layout"), values.index.unique("decay")
    columns = [(name, decay) for name in values for decay in decays]
    for column, (name, decay) in enumerate(columns):
        face = LOOKS[name].color if decay == decays[0] else "white"
        for i, layout in enumerate(layouts):
            known = placed(values[name].xs((layout, decay), level=("layout", "decay")).dropna())
            x = i + 0.19 * (column - (len(columns) - 1) / 2)
            look = LOOKS[name].dots(mfc=face, markersize=3, mew=0.7)
            axes.plot(x + jitter(known.size, 0.07), known, **look)
            if known.size:  # of a half that is infinite and one that is not, the middle is neither
                middle = np.quantile(known, 0.5, method="higher")
                axes.hlines(middle, x - 0.09, x + 0.09, color=INK)
    axes.axhline(border, **LIMIT)
    axes.set_xlabel("layout")
    axes.set_xticks(range(len(layouts)), layouts)
    kinds = [Line2D([], [], label=name, **LOOKS[name].dots()) for name in values]
    for decay, face in zip(decays, (LOOKS["frozen"].color, "white"), strict=False):
        look = LOOKS["frozen"].dots(marker="o", mfc=face)
        kinds.append(Line2D([], [], label=f"noise per {decay}", **look))
    below(figure, kinds)


def _shares(axes: Axes, verdict: Verdict) -> None:
    """The share of yes with Wilson's interval: overall, in each layout, with each decay."""
    names = ["all", *verdict.by_layout, *verdict.by_decay]
    for limit in (rule.NEARLY_NONE, rule.MAJORITY, rule.NEARLY_ALL):
        axes.axvline(limit, **LIMIT)
    labels = []
    for row, name in enumerate(names):
        yes, of = verdict.counts.get(name, (0, 0))
        per = "per " * (name in verdict.by_decay)
        labels.append(f"{per}{name}  {yes}/{of}")
        if of:
            interval(axes, row, rate(yes, of), color=INK, markersize=5 if name == "all" else 3.5)
    axes.set_yticks(range(len(names)), labels, fontsize="small")
    axes.set(xlim=(-0.04, 1.04), ylim=(len(names) - 0.5, -0.5), xlabel="share of yes")
    axes.set_xticks((0, 0.5, 1), ("0", "0.5", "1"))


def _scatter(axes: Axes, pairs: pd.DataFrame, decay: str) -> None:
    """A mark a pair of one decay, in a panel that has room for both; its shape is the layout."""
    box: dict[str, Any] = {"facecolor": "0.88", "edgecolor": INK}
    axes.add_patch(Rectangle((0, 0), thresholds.SAME_PATH, thresholds.SAME_COST, **box))
    across = logarithmic(axes, "x", pairs.path.to_numpy(float), thresholds.SAME_PATH)
    up = logarithmic(axes, "y", pairs.cost.to_numpy(float), thresholds.SAME_COST)
    for one in pairs[pairs.decay == decay].dropna(subset="cost").itertuples():
        axes.plot(across(one.path), up(one.cost), **_layout_mark(one.layout))
    axes.set_xlabel("robots apart [m]")


def _layout_mark(layout: str) -> dict[str, Any]:
    """A hollow mark by layout; those of one's own share one."""
    marks = dict(zip(paper.LAYOUTS, LAYOUT_MARKS, strict=True))
    return LOOKS["GES"].dots(marker=marks.get(layout, "o"), markersize=4.5, mfc="none", mew=0.8)


def _counts(axes: Axes, runs: pd.DataFrame, column: str) -> None:
    """Counts by size, a point a run, learners side by side; above them, how many in all."""
    names = list(runs.learner.unique())
    above: dict[str, Any] = {"ha": "center", "va": "top", "rotation": 90, "fontsize": "small"}
    above["transform"] = axes.get_xaxis_transform()
    for i, name in enumerate(names):
        for x, (size, (mark, color, _)) in zip((-0.27, 0, 0.27), SIZES.items(), strict=True):
            counts = runs[f"{column}_{size}"][runs.learner == name].to_numpy(float)
            at = i + x + jitter(counts.size, 0.1)
            axes.plot(at, counts, mark, color=color, markersize=2.5)
            axes.text(i + x, 0.99, f"{counts.sum():.0f}", **above)
    axes.set_yscale("symlog", linthresh=1)
    axes.set_xticks(range(len(names)), names)


def _counted(verdict: Verdict, finding: str) -> str:
    """What holds, and in how many runs or pairs of them."""
    yes, of = verdict.counts["all"]
    return f"{finding} in {yes} of {of} {verdict.unit}"


def _judged(figure: Drawn, verdict: Verdict, finding: str, source: str) -> Drawn:
    """With claim, outcome and finding above, and where the runs come from below."""
    return titled(figure, f"{verdict.claim} {verdict.words}: {finding}", source)

"""One figure a claim: what was measured in each run, and in what share it holds.

Every figure takes the claim's `Verdict`, and its title is the outcome and what it rests on. No run
is dropped: what was cut short is drawn in the grey strip marked ∞.
"""

from collections.abc import Iterable
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from nmpcrl.analysis.statistics import rate
from nmpcrl.bench.learners import ratio
from nmpcrl.claims import paper_claims, rule, thresholds
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.verdict import Assumption, Verdict
from nmpcrl.report.figures.axes import (
    interval,
    logarithmic,
    over_episodes,
    rows,
    stacked,
    strips,
)
from nmpcrl.report.figures.results import part
from nmpcrl.report.figures.style import (
    AT_ONE,
    BAND,
    INK,
    LIMIT,
    LOOKS,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Records, Stopped

LAGS = 30  # steps
PROFILED = np.linspace(-0.5, 0.15, 121)  # shares of the cost saved
STEP_PARTS = {  # of a learning step: colour and hatching
    "solves": ("0.2", ""),
    "network": ("0.42", "//"),
    "the rest": ("0.56", "..."),
}
FINDINGS = {  # what holds in each run or pair of runs that says yes
    "C1": "DES diverged and RDES did not",
    "C2": "ES was unstable and GES was not",
    "C5": "RDES and GES end in the same policy",
    "C6": f"with θ the network's error is at most {thresholds.MORE_ACCURATE} times as large",
    "C7": "RDES kept all constraints",
    "C9": f"learning reduces the cost by {thresholds.BETTER:.0%} or more",
}


@page
def measured(found: Evidence, verdict: Verdict) -> Drawn:
    """A claim of `FINDINGS`: its measure in every run or pair, and in what share it holds.

    The share by which learning reduces the cost may be minus infinity, so C9 is drawn by what is
    left of the cost.
    """
    claim = BY_RUNS[verdict.claim]
    values, border, label = claim.measure(found.runs, found.paths), claim.threshold, claim.label
    if verdict.claim == "C9":
        values, border, label = 1 - values, 1 - border, "noise-free cost, end / start"
    figure, (axes, panel) = subplots(1, 2, 3.7, width_ratios=(2.6, 1))
    placed = logarithmic(axes, values.to_numpy(float).ravel(), border)
    kinds = strips(axes, values, placed)
    axes.axhline(border, **LIMIT)
    axes.set_ylabel(fill(label, 24))
    _shares(panel, verdict)
    yes, of = verdict.counts["all"]
    title = _judged(verdict, f"{FINDINGS[verdict.claim]} in {yes} of {of} {verdict.unit}")
    return titled(figure, title, part(found, claim.learners).mark, kinds)


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
    places = chosen.solver.map(solvers.index) + np.where(chosen.learner == "ES", -0.2, 0.2)
    stacked(axes, parts.set_index(places), STEP_PARTS, 0.36)
    for y, end, row in zip(places, parts.sum(axis=1), chosen.itertuples(), strict=True):
        text = f" {row.learner} {ratio(timings, row.solver, row.learner).value:.2f}"
        axes.annotate(text, (end, y), va="center", fontsize="small")
    axes.set_yticks(range(len(solvers)), solvers)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.set_xlabel("time of a step / time of a step of ES")
    value = ratio(timings, paper_claims.SOLVER, learner)
    finding = f"with Ipopt, a step of {learner} takes {value} of one of ES"
    return titled(figure, _judged(verdict, finding), "the published measurement", axes)


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
    return titled(figure, _judged(verdict, f"{broken} do not hold for what is run"), source)


@page
def learners(found: Evidence, finding: str) -> Drawn:
    """All learners: how many runs reduce the cost by how much.

    A run that had to be stopped left no policy, so that its cost is infinite.
    """
    figure, axes = subplots()
    runs = found.runs
    costs = runs.final_cost.where(runs.stopped == Stopped.FINISHED, np.inf) / runs.initial_cost
    for name in found.summaries.values_of("learner"):
        mine = costs[runs.learner == name].to_numpy(float)
        reached = [np.mean(1 - mine >= share) for share in PROFILED]
        axes.plot(PROFILED, reached, label=name, **LOOKS[name].line)
    axes.set(xlabel="reduction of the noise-free cost, at least", ylabel="share of runs")
    axes.set_ylim(0, 1)
    axes.xaxis.set_major_formatter("{x:.0%}")
    return titled(figure, finding, found.mark, axes)


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
    rows(axes, labels)
    axes.set(xlim=(-0.04, 1.04), xlabel="share of yes")
    axes.set_xticks((0, 0.5, 1), ("0", "0.5", "1"))


def _judged(verdict: Verdict, finding: str) -> str:
    """A claim, its outcome, and the finding."""
    return f"{verdict.claim} {verdict.words}: {finding}"

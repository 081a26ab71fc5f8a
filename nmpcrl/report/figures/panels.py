"""Parts of figures that show evidence: bundles of runs, strips by layout, shares of yes."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nmpcrl.analysis.statistics import rate
from nmpcrl.claims import rule
from nmpcrl.claims.by_runs import Values
from nmpcrl.claims.published import Evidence
from nmpcrl.claims.verdict import Verdict
from nmpcrl.report.figures.axes import below, jitter, logarithmic
from nmpcrl.report.figures.style import INK, LIMIT, LOOKS, dots, headed, line, marked
from nmpcrl.study.records import Column

QUARTILES = (0.25, 0.5, 0.75)


def part(found: Evidence, learners: tuple[str, ...], layout: str | None = None) -> Evidence:
    """The runs of some learners, in one layout or in all, learner by learner."""
    kept = found.runs.learner.isin(learners)
    return found.where(kept & (found.runs.layout == layout) if layout else kept)


def bundle(axis: Axes, along: Column, runs: Column, learner: str) -> None:
    """A learner's runs, shape (runs, points): each thin, their quartiles a band, the median thick.

    Values that are not known, after a failed solve, are left out.
    """
    axis.plot(along, runs.T, color=LOOKS[learner].color, linewidth=0.5, alpha=0.35)
    known = np.isfinite(runs).any(axis=0)
    quartiles = np.full((3, along.size), np.nan)
    quartiles[:, known] = np.nanquantile(runs[:, known], QUARTILES, axis=0)
    _middle_half(axis, along, quartiles, learner)


def ranges(axis: Axes, along: Column, runs: Column, learner: str) -> None:
    """The same for runs of which no line can be followed: all of them are a paler band."""
    color = LOOKS[learner].color
    axis.fill_between(along, runs.min(axis=0), runs.max(axis=0), color=color, alpha=0.12, lw=0)
    # between a run that is off the scale and one that is not there is nothing
    _middle_half(axis, along, np.quantile(runs, QUARTILES, axis=0, method="higher"), learner)


def _middle_half(axis: Axes, along: Column, quartiles: Column, learner: str) -> None:
    low, middle, high = quartiles
    color = LOOKS[learner].color
    axis.fill_between(along, low, high, color=color, alpha=0.15, linewidth=0)
    axis.plot(along, middle, **line(learner))


def strips(axis: Axes, values: Values, border: float) -> None:
    """Every run's number above its layout: learners side by side, the second reading hollow.

    A short line is the median of a learner and reading; the dashed one is the claim's border.
    """
    placed = logarithmic(axis, "y", values.to_numpy(float).ravel(), border)
    layouts, decays = values.index.unique("layout"), values.index.unique("decay")
    columns = [(name, decay) for name in values for decay in decays]
    for column, (name, decay) in enumerate(columns):
        face = LOOKS[name].color if decay == decays[0] else "white"
        for i, layout in enumerate(layouts):
            known = placed(values[name].xs((layout, decay), level=("layout", "decay")).dropna())
            x = i + 0.19 * (column - (len(columns) - 1) / 2)
            look = dots(name, mfc=face, markersize=3, mew=0.7)
            axis.plot(x + jitter(known.size, 0.07), known, **look)
            if known.size:  # of a half that is infinite and one that is not, the middle is neither
                middle = np.quantile(known, 0.5, method="higher")
                axis.hlines(middle, x - 0.09, x + 0.09, color=INK)
    axis.axhline(border, **LIMIT)
    axis.set_xlabel("layout")
    axis.set_xticks(range(len(layouts)), layouts)
    kinds = [Line2D([], [], label=name, **dots(name)) for name in values]
    for decay, face in zip(decays, (LOOKS["frozen"].color, "white"), strict=False):
        look = dots("frozen", marker="o", mfc=face)
        kinds.append(Line2D([], [], label=f"noise per {decay}", **look))
    figure = axis.figure
    assert isinstance(figure, Figure)
    below(figure, kinds)


def shares(axis: Axes, verdict: Verdict) -> None:
    """The share of yes with Wilson's interval: overall, in each layout, in each reading."""
    names = {"all": "all"} | {name: name for name in verdict.by_layout}
    names |= {name: f"per {name}" for name in verdict.by_decay}
    for limit in (rule.NEARLY_NONE, rule.MAJORITY, rule.NEARLY_ALL):
        axis.axvline(limit, **LIMIT)
    labels = []
    for row, name in enumerate(names):
        yes, of = verdict.counts.get(name, (0, 0))
        labels.append(f"{names[name]}  {yes}/{of}")
        if of:
            share = rate(yes, of)
            axis.plot([share.low, share.high], [row, row], color=INK, linewidth=1.6)
            axis.plot(share.value, row, "o", color="black", markersize=5 if name == "all" else 3.5)
    axis.set_yticks(range(len(names)), labels, fontsize="small")
    axis.set(xlim=(-0.04, 1.04), ylim=(len(names) - 0.5, -0.5))
    axis.set_xticks((0, 0.5, 1), ("0", "0.5", "1"))
    axis.set_xlabel("share of yes")


def sourced(figure: Figure, title: str, drawn: Evidence) -> Figure:
    """With the finding above and where the runs come from below."""
    return marked(headed(figure, title), drawn.mark)

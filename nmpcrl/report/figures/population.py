"""Random layouts: in which share a claim holds, and what tells beforehand where ES works."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import PercentFormatter

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.claims.thresholds import improves
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome
from nmpcrl.report.drawn import label
from nmpcrl.report.figures.axes import below, interval, plain
from nmpcrl.report.figures.style import (
    BAND,
    INK,
    LIMIT,
    OCHRE,
    TEAL,
    WINE,
    Drawn,
    page,
    subplots,
    titled,
)
from nmpcrl.studies.difficulty import OPEN, PILOT
from nmpcrl.studies.population import EXPECTED

LOOK: Mapping[Outcome, dict[str, Any]] = {  # of an outcome
    REPRODUCED: {"color": TEAL, "marker": "D", "markersize": 5.5},
    PARTLY: {"color": INK, "marker": "o", "markersize": 5.5},
    NOT: {"color": WINE, "marker": "X", "markersize": 5.5},
    UNDECIDABLE: {"color": "0.5", "marker": "s", "markersize": 5.5},
}
NAMED: dict[str, Any] = {  # the share of A to F
    "marker": "|", "color": OCHRE, "markersize": 11, "markeredgewidth": 2, "linestyle": "",
    "label": "A to F",
}  # fmt: skip
LABELS = {
    "closest": "clearance [BARN]",
    "visibility": "visibility [BARN]",
    "dispersion": "dispersion [BARN]",
    "dimension": "width [BARN]",
    "tortuosity": "tortuosity [BARN]",
    "cost": "initial cost",
    "slope": r"the cost's slope in $\theta_c$",
    "overshoot": r"initial $\alpha\Vert\phi\Vert^2$",
    "closes": r"$\theta_c$ that closes a gap",
}
ROW = 0.23  # height of a row [inches]
SHOWN = 0.03  # theta_c below which a mark stands at the edge
ENDS = ((True, TEAL, "o", 3, "ES improves"), (False, WINE, "X", 4, "it does not"))


@page
def shares(found: pd.DataFrame, six: pd.DataFrame, finding: str) -> Drawn:
    """One row a claim: in which share of the layouts it holds, beside A to F and what was expected.

    Args:
        found: of `population.shares`, of the drawn layouts.
        six: the same of A to F.
        finding: the title.
    """
    figure, axes = subplots(height=ROW * len(found) + 1.6)
    for y, row in enumerate(found.itertuples()):
        expected = EXPECTED[str(row.claim)]
        width = expected.high - expected.low
        axes.add_patch(Rectangle((expected.low, y - 0.32), width, 0.64, **BAND))
        interval(axes, y, Estimate(row.share, row.low, row.high), **LOOK[row.outcome])
        named = six.share[six.claim == row.claim]
        axes.plot(named, [y] * len(named), **NAMED)
    axes.set_yticks(range(len(found)), [label(str(name)) for name in found.claim])
    axes.set(xlim=(-0.02, 1.02), ylim=(len(found) - 0.4, -0.6), xlabel="share of layouts")
    axes.xaxis.set_major_formatter(PercentFormatter(1, 0))
    handles: list[Any] = [
        Line2D([], [], label=str(outcome), **LOOK[outcome])
        for outcome in LOOK
        if (found.outcome == outcome).any()
    ]
    handles += [Line2D([], [], **NAMED), Rectangle((0, 0), 1, 1, label="expected", **BAND)]
    below(figure, handles)
    return titled(figure, finding)


@page
def predictors(scores: pd.DataFrame, runs: pd.DataFrame, closes: pd.Series, finding: str) -> Drawn:
    """Where ES ends against where a gap closes, and how well each measure tells that beforehand.

    Args:
        scores: of `predictors.predictor_scores`.
        runs: of ES, of `rows.table`.
        closes: theta_c at which the first gap of the first trajectory closes, a run's layout each.
        finding: the title.
    """
    figure, (ends, areas) = subplots(2, 1, ROW * len(scores) + 3.9)
    better = improves(runs)
    for well, color, mark, size, name in ENDS:
        there = better == well
        values = runs.theta_8[there].clip(lower=SHOWN)
        ends.plot(closes[there], values, mark, color=color, markersize=size, label=name)
    shut = np.geomspace(SHOWN, OPEN, 50)
    ends.plot(shut, shut, **LIMIT, label="the gap is closed above")
    ends.set(yscale="log", ylabel=r"$\theta_c$ after learning", xlim=(0, None))
    ends.set_xlabel(r"$\theta_c$ at which the first gap closes")
    plain(ends.yaxis)
    below(figure, *ends.get_legend_handles_labels())
    order = [*scores.auc.map(lambda one: one.value).sort_values(ascending=False).index]
    areas.axvline(0.5, **LIMIT)
    looks = {PILOT: {"color": TEAL, "marker": "D"}}
    for y, name in enumerate(order):
        interval(areas, y, scores.auc[name], **looks.get(name, {"color": INK}))
    areas.set_yticks(range(len(order)), [LABELS[name] for name in order], fontsize="small")
    areas.set(ylim=(len(order) - 0.4, -0.6), xlabel="area under the ROC curve")
    areas.set_title("how well it tells beforehand")
    return titled(figure, finding)

"""Random layouts: in which share a claim holds, and what tells beforehand where ES works."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import PercentFormatter

from nmpcrl.claims.thresholds import improves
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, Outcome
from nmpcrl.report.drawn import label
from nmpcrl.report.figures.axes import below, plain
from nmpcrl.report.figures.style import (
    BAND,
    INK,
    LIMIT,
    SUBTITLE,
    TEAL,
    WINE,
    headed,
    page,
    subplots,
)
from nmpcrl.studies.difficulty import OPEN, PILOT
from nmpcrl.studies.population import EXPECTED

LOOK: Mapping[Outcome, tuple[str, str]] = {  # colour and mark of an outcome
    REPRODUCED: (TEAL, "D"), PARTLY: (INK, "o"), NOT: (WINE, "X"),
}  # fmt: skip
OTHER = ("0.5", "s")  # of one that is not decidable
NAMED: dict[str, Any] = {  # the share of A to F
    "marker": "|", "color": "#B37A00", "markersize": 11, "markeredgewidth": 2, "linestyle": "",
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
def shares(found: pd.DataFrame, six: pd.DataFrame, finding: str) -> Figure:
    """One row a claim: in which share of the layouts it holds, beside A to F and what was expected.

    Args:
        found: of `population.shares`, of the drawn layouts.
        six: the same of A to F.
        finding: the title.
    """
    height = ROW * len(found) + 1.3
    figure, axes = subplots(height=height + 0.3)
    for y, row in enumerate(found.itertuples()):
        colour, mark = LOOK.get(row.outcome, OTHER)
        expected = EXPECTED[str(row.claim)]
        width = expected.high - expected.low
        axes.add_patch(Rectangle((expected.low, y - 0.32), width, 0.64, **BAND))
        axes.plot([row.low, row.high], [y, y], color=colour, linewidth=1.6)
        axes.plot(row.share, y, mark, color=colour, markersize=5.5)
        named = six.share[six.claim == row.claim]
        axes.plot(named, [y] * len(named), **NAMED)
    axes.set_yticks(range(len(found)), [label(str(name)) for name in found.claim])
    axes.set(xlim=(-0.02, 1.02), ylim=(len(found) - 0.4, -0.6), xlabel="share of layouts")
    axes.xaxis.set_major_formatter(PercentFormatter(1, 0))
    handles: list[Any] = [
        Line2D([], [], color=colour, marker=mark, markersize=5.5, label=str(outcome))
        for outcome, (colour, mark) in LOOK.items()
        if (found.outcome == outcome).any()
    ]
    handles += [Line2D([], [], label="A to F", **NAMED), Rectangle((0, 0), 1, 1, **BAND)]
    below(figure, handles, [*(one.get_label() for one in handles[:-1]), "expected"])
    return headed(figure, finding)


@page
def predictors(scores: pd.DataFrame, runs: pd.DataFrame, closes: pd.Series, finding: str) -> Figure:
    """Where ES ends against where a gap closes, and how well each measure tells that beforehand.

    Args:
        scores: of `predictors.predictor_scores`.
        runs: of ES, of `rows.table`.
        closes: theta_c at which the first gap of the first trajectory closes, a run's layout each.
        finding: the title.
    """
    figure, (ends, areas) = subplots(1, 2, across=1, tall=ROW * len(scores) + 3.9)
    _ends(ends, runs, closes)
    below(figure, *ends.get_legend_handles_labels())
    order = [*scores.auc.map(lambda one: one.value).sort_values(ascending=False).index]
    areas.axvline(0.5, **LIMIT)
    for y, name in enumerate(order):
        area, colour = scores.auc[name], TEAL if name == PILOT else INK
        areas.plot([area.low, area.high], [y, y], color=colour, linewidth=1.6)
        areas.plot(area.value, y, "D" if name == PILOT else "o", color=colour, markersize=5)
    areas.set_yticks(range(len(order)), [LABELS[name] for name in order], fontsize="small")
    areas.set(ylim=(len(order) - 0.4, -0.6), xlabel="area under the ROC curve")
    areas.set_title("how well it tells beforehand", **SUBTITLE)
    return headed(figure, finding)


def _ends(axes: Axes, runs: pd.DataFrame, closes: pd.Series) -> None:
    """The last theta_c of each run over that at which a gap closes."""
    better = improves(runs)
    for well, colour, mark, size, name in ENDS:
        there = better == well
        values = runs.theta_8[there].clip(lower=SHOWN)
        axes.plot(closes[there], values, mark, color=colour, markersize=size, label=name)
    shut = np.geomspace(SHOWN, OPEN, 50)
    axes.plot(shut, shut, **(LIMIT | {"label": "the gap is closed above"}))
    axes.set(yscale="log", ylabel=r"$\theta_c$ after learning", xlim=(0, None))
    axes.set_xlabel(r"$\theta_c$ at which the first gap closes")
    plain(axes.yaxis)

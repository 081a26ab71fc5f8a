"""A figure of chapter 5: how many runs failed, and for which reason."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from nmpcrl.claims.failure_modes import WELL, Ending, Failure, Mechanism
from nmpcrl.claims.published import Evidence
from nmpcrl.report.figures.axes import stacked
from nmpcrl.report.figures.style import (
    SUBTITLE,
    TEAL,
    WINE,
    hatched,
    headed,
    marked,
    page,
    subplots,
)

GOOD = "0.92"  # the grey of what went well
PATTERNS = (  # colour and hatching of what did not: of mechanisms, and of endings
    (("#5C0F3A", ""), (WINE, "//"), ("#A0487A", "--"), ("#BC6F9A", "\\\\"), (WINE, "xx")),
    (("#0B4744", ""), (TEAL, "||"), ("#3D8F8A", "++"), ("#0B4744", "x"), (TEAL, "-")),
)
BELOW: dict[str, Any] = {"bbox_to_anchor": (0.5, 0), "borderaxespad": 3.2, "ncols": 3}
STOPPED = "stopped in training"


@page
def reasons(found: Evidence) -> Figure:
    """How many runs of each learner met which mechanism, and how their last rollouts ended."""
    moved = found.runs[found.runs.learner != "frozen"]
    tall = 2 * (1.5 + 0.3 * moved.learner.nunique())
    figure, axes = subplots(1, 2, across=1, tall=tall, sharey=True)
    ends = moved.ending.mask(moved.wrong == Failure.STOPPED, STOPPED)
    arrived, *worse = Ending
    kinds = (moved.mechanism, (*Mechanism, WELL)), (ends, (STOPPED, *worse, arrived))
    for axis, (kind, names), patterns in zip(axes, kinds, PATTERNS, strict=True):
        counts = pd.crosstab(moved.learner, kind)
        counts = counts.reindex(moved.learner.unique(), columns=list(names), fill_value=0)
        looks = dict(zip(names, (*patterns[: len(names) - 1], (GOOD, "")), strict=True))
        _numbered(axis, counts, looks)
        handles = [Rectangle((0, 0), 1, 1, **hatched(*look)) for look in looks.values()]
        axis.legend(handles, names, loc="upper center", **BELOW)
        axis.set_xlabel("runs")
    axes[0].set_title("mechanism when the cost rose", **SUBTITLE)
    axes[1].set_title("how the last rollout ended", **SUBTITLE)
    axes[0].invert_yaxis()
    wrong = moved.mechanism[moved.mechanism != WELL].value_counts()
    listed = ", ".join(f"{count} {name}" for name, count in wrong.items())
    title = f"{wrong.sum()} of {len(moved)} runs failed{': ' if listed else ''}{listed}"
    return marked(headed(figure, title), found.mark)


def _numbered(axis: Axes, counts: pd.DataFrame, looks: Mapping[str, tuple[str, str]]) -> None:
    """A bar a learner, with the number in each part that has room for it."""
    enough = 0.06 * counts.sum(axis=1).max()
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
    for name, bars in stacked(axis, counts, looks, 0.7).items():
        labels = [str(n) if n > enough else "" for n in counts[name]]
        axis.bar_label(bars, labels, label_type="center", fontsize="small", bbox=box)

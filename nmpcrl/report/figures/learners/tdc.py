"""What each part of exact TDC does."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from nmpcrl.analysis.summary import RunSummary
from nmpcrl.report.figures.axes import below, over_episodes
from nmpcrl.report.figures.style import LOOKS, headed, page, subplots
from nmpcrl.study.records import LAST

PARTS: dict[
    str, dict[str, Any]
] = {  # of TDC, each left out in turn; all in its colour but for the printed one
    "TDC": {"linestyle": "-", "linewidth": 2.2},
    "without h": {"linestyle": "--"},
    "not projected": {"linestyle": ":"},
    "slow w": {"linestyle": "-."},
    "GES": LOOKS["GES"].line,
}
WITHOUT = {
    "without h": "Leaving out h",
    "not projected": "Leaving out the projection",
    "slow w": "Slowing w down",
}


@page
def parts_of_tdc(runs: Mapping[str, RunSummary]) -> Figure:
    """TDC with each of its parts left out: the noise-free cost, and the size of w.

    Args:
        runs: by what is in `PARTS`.
    """
    figure, (left, right) = subplots(1, 2, 3.3)
    for name, run in runs.items():
        look = {"color": LOOKS["TDC"].color} | PARTS[name]
        judged, size = run.evaluations, np.linalg.norm(run.episodes["w"], axis=1)
        left.plot(judged["episode"], judged["cost"] / judged["cost"][0], label=name, **look)
        right.plot(np.arange(1, len(size) + 1), size, **look)
    left.set(ylabel="noise-free cost / first")
    right.set(ylabel="size of w", yscale="log")
    for axes in (left, right):
        over_episodes(axes)
    below(figure, *left.get_legend_handles_labels())
    moved = {name: _end(runs[name]) - _end(runs["TDC"]) for name in WITHOUT}
    most = max(moved, key=lambda name: abs(moved[name]))
    return headed(
        figure, f"{WITHOUT[most]} moves the final cost most: by {moved[most]:+.1%} of the first"
    )


def _end(run: RunSummary) -> float:
    """Final noise-free cost in shares of the first; infinite if a rollout failed."""
    cost = run.evaluations["cost"]
    return float(cost[-LAST:].mean() / cost[0])

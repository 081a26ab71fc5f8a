"""The figure of problems whose answer is known: a linear plant, and that of Gros and Zanon."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nmpcrl import Vector
from nmpcrl.report.figures.axes import jitter
from nmpcrl.report.figures.style import INK, LOOKS, TEAL, WINE, Look, headed, page, subplots
from nmpcrl.studies.other_problems import Runs

OWN = {
    "LSTD-Q": Look(TEAL, (0, (6, 2)), "h"),
    "LSTD-Q, batches of 20": Look(TEAL, (0, (6, 2)), "h"),
    "LSTD-Q, every step": Look(WINE, (0, (3, 1, 1, 1)), "p"),
    "DPG": Look("#5B5EA6", (0, (1, 1)), "*"),
}
MOST = 3.0  # largest cost that is drawn
NAMES = {  # of what the learners are compared with
    "best_policy": "best policy", "best_theta": "best θ", "informed": "knows the plant",
}  # fmt: skip


@page
def known(paths: Mapping[str, Vector], truth: Vector, found: Runs) -> Figure:
    """The gains that theta plans with beside the best one; what each seed ends with.

    Args:
        paths: by learner, the two entries of K after each episode, shape (episodes + 1, 2).
        truth: the best K, shape (2,).
        found: the published runs on the example of Gros and Zanon.
    """
    figure, (above, below) = subplots(1, 2, across=1, tall=5.6)
    for name, path in paths.items():
        look = OWN.get(name) or LOOKS[name]
        above.plot(*path.T, color=look.color, linestyle=look.linestyle, linewidth=1.2, label=name)
        above.plot(*path[-1], look.marker, color=look.color, markersize=7)
    above.plot(*truth, "+", color=INK, markersize=16, markeredgewidth=1.6, label="best K")
    above.set(xlabel="$K_1$", ylabel="$K_2$", title="Linear plant")
    above.legend(fontsize="small")
    _ends(below, found)
    first = found.medians.idxmin()
    times = found.medians[first] / found.references["best_policy"]
    return headed(
        figure,
        "LSTD-Q finds the best gain of a linear plant; with a wrong model,"
        f" {first} comes to {times:.1f} times the best cost",
    )


def _ends(axes: Axes, found: Runs) -> None:
    """Cost without noise of each seed's last theta, and lines for what is possible."""
    for place, (arm, costs) in enumerate(found.tests.items()):
        look = OWN.get(str(arm)) or LOOKS[str(arm)]
        shown = np.minimum(np.sort(costs.to_numpy()), MOST)
        where = place + jitter(len(costs), 0.3)
        axes.plot(shown, where, look.marker, color=look.color, markersize=3)
        axes.plot(np.median(shown), place, "|", color=INK, markersize=16)
    for (name, label), dashes in zip(NAMES.items(), (":", "-.", "--"), strict=True):
        value = found.references[name]
        axes.axvline(value, label=label, color="0.35", linewidth=0.9, linestyle=dashes)
    names = ["no learning" if arm == "frozen" else str(arm) for arm in found.tests]
    axes.set_yticks(range(len(names)), names, fontsize="small")
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="cost of a step [-]", title="Gros and Zanon")
    axes.set_xlim(0.8 * found.references["best_policy"], 1.3 * MOST)
    axes.legend(fontsize="small", loc="center right", bbox_to_anchor=(1.0, 0.37))

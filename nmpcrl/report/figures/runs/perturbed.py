"""How far runs that began almost alike come apart."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from nmpcrl import Vector
from nmpcrl.report.figures.axes import label_panel, legend
from nmpcrl.report.figures.style import LIMIT, headed, line, page, subplots
from nmpcrl.study.experiment import Experiment


@page
def replicas(perturbed: Mapping[Experiment, Vector], solvers: Vector, start: float) -> Figure:
    """How far perturbed replicas are apart against episodes.

    `perturbed` (by run) and `solvers` (riccati and Ipopt) hold the largest difference of theta in
    each episode; `start` is how far apart the perturbed begin.
    """
    decays = tuple(dict.fromkeys(e.decay for e in perturbed))
    figure, axes = subplots(1, len(decays), 3.4, sharex=True, sharey=True, squeeze=False)
    for axis, decay in zip(axes[0], decays, strict=True):
        for experiment, apart in perturbed.items():
            if experiment.decay == decay:
                _plot(axis, apart, **line(experiment.learner))
        axis.axhline(start, **LIMIT)
        axis.set(yscale="log")
        label_panel(axis, decay)
        axis.xaxis.set_major_locator(MaxNLocator(3, integer=True))
    _plot(axes[0, 0], solvers, color="0.45", linewidth=2.4)
    axes[0, 0].set_ylabel("largest difference in θ")
    learners = tuple(dict.fromkeys(experiment.learner for experiment in perturbed))
    other = Line2D([], [], color="0.45", linewidth=2.4, label="ES, riccati and Ipopt")
    legend(figure, learners, other)
    grown = sorted({e.learner for e, apart in perturbed.items() if apart[-1] > start})
    title = "Of all perturbed replicas, none end further apart than they began"
    if grown:
        title = f"A difference of {start:.0e} grows in runs of {' and '.join(grown)}"
    return headed(figure, title)


def _plot(axis: Axes, apart: Vector, **look: Any) -> None:
    axis.plot(np.arange(1, apart.size + 1), apart, **look)

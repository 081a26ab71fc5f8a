"""Figs. 1 and 2 of the paper for the few runs that a chapter trains, one line a run."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nmpcrl.analysis import metrics
from nmpcrl.claims.thresholds import divergence, instability, of_records
from nmpcrl.report.figures.axes import label_panel, one_entry_each
from nmpcrl.report.figures.style import headed, page, subplots, thin
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs

CEILING = 1.3  # multiple of theta_init's noise-free cost at which the panels without noise end


@page
def figure_1(runs: Runs[Records]) -> Figure:
    """Figure 1 of the paper, DES against RDES, with the noise-free cost and the frozen arm."""
    figure = _curves(runs, ("DES", "RDES"))
    counts = [f"{name} in {_runs_where(runs, name, divergence)}" for name in ("DES", "RDES")]
    return headed(figure, f"Divergence: {', '.join(counts)} runs")


@page
def figure_2(runs: Runs[Records]) -> Figure:
    """Figure 2 of the paper, ES against GES, with the noise-free cost and the frozen arm."""
    figure = _curves(runs, ("ES", "GES"))
    counts = [f"{name} in {_runs_where(runs, name, instability)}" for name in ("ES", "GES")]
    return headed(figure, f"Instability: {', '.join(counts)} runs")


@page
def _curves(runs: Runs[Records], learners: tuple[str, ...]) -> Figure:
    """Summed RL cost of each training episode above, cost without noise below; frozen beside.

    One column a reading of the decay, one line a seed.
    """
    decays, shown = runs.values_of("decay"), (*learners, "frozen")
    options: dict[str, Any] = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = subplots(2, len(decays), 5.0, **options)
    for (above, below), decay in zip(axes.T, decays, strict=True):
        for learner in shown:
            for records in runs.select(learner=learner, decay=decay).values():
                cost = metrics.training_cost(records)
                above.plot(np.arange(1, cost.size + 1), cost, **thin(learner))
                below.plot(*metrics.noise_free_cost(records), **thin(learner))
        label_panel(above, decay, xlabel="")
        label_panel(below)
    axes[0, 0].set_ylabel("cost of a\ntraining episode [-]")
    axes[1, 0].set_ylabel("cost without noise [-]")
    low, high = axes[1, 0].get_ylim()
    initial = metrics.initial_cost(next(iter(runs.values())))
    axes[1, 0].set_ylim(low, min(high, CEILING * initial))
    one_entry_each(axes[0, -1], shown)
    return figure


def _runs_where(
    runs: Runs[Records], learner: str, wrong: Callable[[pd.DataFrame], pd.Series]
) -> str:
    """How many of the learner's runs went wrong, in words."""
    known = of_records(runs)
    mine = wrong(known[known.learner == learner])
    return f"{mine.sum()} of {len(mine)}"

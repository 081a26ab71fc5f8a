"""Rows of `rows.table` for runs in which nothing happened, with the values of a test."""

from dataclasses import asdict
from typing import Any

import pandas as pd

from nmpcrl.analysis.rows import EVAL_INSIDE, INSIDE, THETA, as_text
from nmpcrl.study import Experiment

START_COST = 1000.0  # noise-free cost of theta_init
QUIET = {
    "stopped": "finished",
    "initial_cost": START_COST,
    "final_cost": START_COST,
    "late_cost_range": 0.0,
    "cost_ratio": 1.0,
    "steps_done": 39_000,
    "distance": 0.1,
    "imitation_with": 0.5,
    "imitation_without": 1.0,
}
NONE = ("inputs", "outside", "worst_overlap", "eval_worst_overlap", *INSIDE, *EVAL_INSIDE)


def quiet_row(experiment: Experiment, **unlike: Any) -> dict[str, Any]:
    """The row of a run in which nothing happened, with other values where `unlike` has them."""
    fields = {name: as_text(value) for name, value in asdict(experiment).items()}
    theta = dict(zip(THETA, experiment.theta, strict=True))
    return fields | QUIET | dict.fromkeys(NONE, 0) | theta | unlike


def timings(rdes=0.5, ges=1.0, width=0.0, waited=0.0, solvers=("fatrop", "ipopt")) -> pd.DataFrame:
    """Ratios of the times of a step, with intervals as wide on either side."""
    ratios = {"ES": 1.0, "RDES": rdes, "GES": ges}
    rows = [
        (solver, learner, waited, ratio, ratio - width, ratio + width)
        for solver in solvers
        for learner, ratio in ratios.items()
    ]
    columns = ["solver", "learner", "waited", "ratio", "ratio_low", "ratio_high"]
    return pd.DataFrame(rows, columns=columns)

"""Tables of a reader's own runs: one row for each evaluation of a `Trial`."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import interquartile_mean, probability_of_improvement
from nmpcrl.study.records import Records, Stopped


def evaluations(runs: Iterable[Records]) -> pd.DataFrame:
    """Every rollout without noise of some runs, such as the values of `fetch_all`.

    A run that diverges has no policy: its last row has an infinite cost.

    Returns:
        Columns learner, seed, episode, cost (summed, without noise) and theta.
    """
    rows = list[dict[str, Any]]()
    for run in runs:
        named = {name: run.experiment[name] for name in ("learner", "seed")}
        columns = (run.evaluations[name] for name in ("episode", "cost", "theta"))
        for episode, cost, theta in zip(*columns, strict=True):
            rows.append({**named, "episode": int(episode), "cost": float(cost), "theta": theta})
        if run.facts["stopped"] != Stopped.FINISHED:
            rows.append({**rows[-1], "episode": run.experiment["episodes"], "cost": np.inf})
    return pd.DataFrame(rows)


def final_costs(rows: pd.DataFrame) -> pd.DataFrame:
    """The last cost of each run of `evaluations`: one row a seed, one column a learner."""
    last = rows.groupby(["seed", "learner"]).cost.last()
    return last.unstack("learner")[list(rows.learner.unique())]


def summarise(costs: pd.DataFrame, baseline: str) -> pd.DataFrame:
    """Each learner's interquartile mean, and its probability to cost less than the baseline.

    Args:
        costs: of `final_costs`; the seeds are one stratum.
        baseline: the learner that the others are compared with.

    Returns:
        One row for each learner and an `Estimate` in each column: "interquartile mean" and
        "P(costs less)".
    """
    strata = ["all"] * len(costs)
    return pd.DataFrame(
        {
            "interquartile mean": interquartile_mean(costs[name].to_numpy(), strata),
            "P(costs less)": probability_of_improvement(
                costs[name].to_numpy(), costs[baseline].to_numpy(), strata
            ),
        }
        for name in costs
    ).set_axis(pd.Index(costs.columns, name="learner"))

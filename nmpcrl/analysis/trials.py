"""Runs of one's own, compared: one row an evaluation of each `Trial`."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import interquartile_mean, probability_of_improvement
from nmpcrl.study.records import Records, Stopped


def evaluations(runs: Iterable[Records]) -> pd.DataFrame:
    """Every rollout without noise, at the start and on the way.

    A run that diverges ends in a row of infinite cost: it left no policy.

    Args:
        runs: records, as the values of `fetch_all`.

    Returns:
        Columns learner, seed, episode, cost (summed, without noise) and theta.
    """
    return pd.DataFrame([row for run in runs for row in _rows(run)])


def _rows(run: Records) -> list[dict[str, Any]]:
    named = {name: run.experiment[name] for name in ("learner", "seed")}
    columns = (run.evaluations[name] for name in ("episode", "cost", "theta"))
    rows = [
        {**named, "episode": int(episode), "cost": float(cost), "theta": theta}
        for episode, cost, theta in zip(*columns, strict=True)
    ]
    if run.facts["stopped"] != Stopped.FINISHED:
        rows.append({**rows[-1], "episode": run.experiment["episodes"], "cost": np.inf})
    return rows


def final_costs(rows: pd.DataFrame) -> pd.DataFrame:
    """The last cost of each run: one row a seed, one column a learner.

    Args:
        rows: of `evaluations`.
    """
    last = rows.groupby(["seed", "learner"]).cost.last()
    return last.unstack("learner")[list(rows.learner.unique())]


def summarise(costs: pd.DataFrame, baseline: str) -> pd.DataFrame:
    """Each learner's interquartile mean, and how likely its run costs less than the baseline's.

    Args:
        costs: of `final_costs`; the seeds are one stratum.
        baseline: the learner with which the others are compared.

    Returns:
        One row a learner and an `Estimate` in each column: "interquartile mean" and
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

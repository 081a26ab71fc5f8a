"""Tables of a reader's own runs: one row for each evaluation of a `Trial`."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import interquartile_mean, probability_of_improvement
from nmpcrl.study.records import Records, Stopped


def evaluations(runs: Iterable[Records]) -> pd.DataFrame:
    """Every rollout without noise of some runs, such as the values of `fetch_all`.

    Columns learner, seed, episode, cost and theta. The last cost of a run that diverges is
    infinite: it has no policy.
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
    """Each learner's "interquartile mean" of `final_costs`, and "P(costs less)" than the baseline.

    Each is an `Estimate`; the seeds are one stratum.
    """
    strata, than = ["all"] * len(costs), costs[baseline].to_numpy()
    rows = {
        name: {
            "interquartile mean": interquartile_mean(cost.to_numpy(), strata),
            "P(costs less)": probability_of_improvement(cost.to_numpy(), than, strata),
        }
        for name, cost in costs.items()
    }
    return pd.DataFrame.from_dict(rows, "index").rename_axis("learner")

"""Runs outside the study: any learner and any controller, one row an evaluation.

The study runs learners that it names on the paper's robot. A plant, a task or a learner of one's
own has no name there. `trial` trains it in this process, stores nothing, and judges theta without
noise, as the study does.
"""

from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.statistics import interquartile_mean, probability_of_improvement
from nmpcrl.control import Nmpc
from nmpcrl.learning import Diverged, Exploration, Learner, Weights, evaluate, train
from nmpcrl.learning.training import absurd
from nmpcrl.study import paper


def trial(
    learner: Learner, nmpc: Nmpc, theta: Vector, explore: Exploration, *, every: int = 5
) -> pd.DataFrame:
    """Train a learner from `theta`, and judge theta without noise at the start and on the way.

    A run that diverges ends in a row of infinite cost: it left no policy.

    Args:
        learner: moves theta; one that holds a network or a generator is to be made anew.
        nmpc: acts, and is what is learned.
        theta: to start with, shape (2n + m + 1,).
        explore: the noise; its shape says how many episodes there are, and how long they are.
        every: episodes between two evaluations.

    Returns:
        Columns learner, episode, cost (summed, without noise) and theta.
    """
    episodes, steps = explore.scale.shape
    weights = Weights(np.array(theta, float), np.full(len(theta), paper.W_INIT))
    rows = [_row(learner, nmpc, weights, 0, steps)]
    try:
        for step in train(learner, nmpc, weights, explore):
            done, over = step.episode + 1, step.time == steps - 1 or step.failure
            due = done % every == 0 or done == episodes
            if over and due and not absurd(step.weights):
                rows.append(_row(learner, nmpc, step.weights, done, steps))
    except Diverged:
        rows.append({**rows[-1], "episode": episodes, "cost": np.inf})
    return pd.DataFrame(rows)


def _row(
    learner: Learner, nmpc: Nmpc, weights: Weights, episode: int, steps: int
) -> dict[str, Any]:
    cost = evaluate(nmpc, weights.theta, steps).cost
    return {"learner": learner.name, "episode": episode, "cost": cost, "theta": weights.theta}


def final_costs(rows: pd.DataFrame) -> pd.DataFrame:
    """The last cost of each run: one row a seed, one column a learner.

    Args:
        rows: of `trial`, with a column seed.
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

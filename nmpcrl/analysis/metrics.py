"""Numbers of one run, from its records."""

from collections.abc import Callable
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Task
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import paper
from nmpcrl.study import records as stored
from nmpcrl.study.records import Column, Records, StepStatus

TOUCH = 1e-6  # largest violation that is within the solver's tolerance
TIGHT = 0.999  # least cosine of parallel features
LATE = 20  # episodes at the end of training; at most the second half
Run = Any  # `Records`, or a `RunSummary`, which also has experiment and evaluations


def training_cost(records: Records) -> Vector:
    """Sum of the RL cost over each episode, noise included, shape (episodes,): Figs. 1 and 2.

    nan for an episode that a failed solve cut short, or that the run did not reach.
    """
    steps = records.steps
    episodes, length = records.experiment["episodes"], records.experiment["steps"]
    total = np.bincount(steps["episode"], np.nan_to_num(steps["cost"]), minlength=episodes)
    count = np.bincount(steps["episode"], steps["status"] != StepStatus.FAILED, minlength=episodes)
    return np.where(count == length, total, np.nan)


def initial_cost(run: Run) -> float:
    """Noise-free cost of theta_init."""
    return float(run.evaluations["cost"][0])


def final_cost(run: Run) -> float:
    """Noise-free cost at the end: see `records.final_cost`."""
    return stored.final_cost(run.evaluations["cost"])


def late_cost_range(run: Run) -> float:
    """Range of the noise-free cost in the second half of training, relative to the initial cost.

    Infinite if a rollout failed, or training ended earlier.
    """
    cost, episode = run.evaluations["cost"], run.evaluations["episode"]
    late = cost[episode >= run.experiment["episodes"] / 2]
    if not late.size or not np.isfinite(late).all():
        return np.inf
    return float((late.max() - late.min()) / cost[0])


def late_training_cost(cost: Vector) -> float:
    """Median of `training_cost` over the last `LATE` episodes, or over a shorter second half.

    An episode whose cost is nan costs infinitely much.
    """
    window = min(LATE, max(1, len(cost) // 2))
    return float(np.median(np.nan_to_num(cost[-window:], nan=np.inf)))


def cost_ratio(cost: Vector, frozen: Vector) -> float:
    """`late_training_cost` of a run over the frozen learner's under the same noise.

    The ratio is infinite if the run alone lost half of its late episodes, 0 if the frozen learner
    alone did, nan if both did.
    """
    return late_training_cost(cost) / late_training_cost(frozen)


def overshooting(records: Records) -> float:
    """Share of the steps with alpha ||phi||^2 above `OVERSHOOT`."""
    return float(np.mean(records.steps["alpha_phi2"] > OVERSHOOT))


def out_of_bounds(actions: Column, lower: Vector, upper: Vector) -> Any:
    """Whether each action, shape (..., m), leaves the action space by more than `TOUCH`."""
    return np.any((actions < lower - TOUCH) | (actions > upper + TOUCH), axis=-1)


def boundary_share(records: Records, task: Task) -> float:
    """Share of the steps in a state with Xi + theta_c = 0, where V has a kink.  # departure L"""
    edge = task.overlap(records.steps["state"]) + theta_before(records)[:, -1:]
    return float((np.abs(edge) <= TOUCH).any(axis=-1).mean())


def theta_before(records: Records) -> Matrix:
    """theta of the solve of each step, shape (steps, d)."""
    return np.vstack([records.experiment["theta"], records.steps["theta"][:-1]])


def online_error(records: Records) -> Vector:
    """Predicted minus true Q(s+, a+) of each step; nan where the true value is not known.

    The next step of the episode solves in s+ with theta' of this step's update. To first order
    V_theta(s+) = V_theta'(s+) - phi+'(theta' - theta).
    """
    steps = records.steps
    move = steps["theta"] - theta_before(records)
    solved = steps["value"][1:] - np.sum(steps["features"][1:] * move[:-1], axis=1)
    error = np.where(_goes_on(records), steps["next_value"][:-1] - solved, np.nan)
    return np.append(error, np.nan)


def by_episode(records: Records, column: Vector, summary: Callable[[Vector], float]) -> Vector:
    """`summary` of the known values of a column in each episode, shape (episodes,)."""
    episodes, known = records.steps["episode"], np.isfinite(column)
    result = np.full(records.experiment["episodes"], np.nan)
    for episode in np.unique(episodes[known]):
        result[episode] = summary(column[known & (episodes == episode)])
    return result


def root_mean_square(values: Vector) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def next_over_this(records: Records) -> Vector:
    """gamma phi'phi+ / phi'phi of each step: above 1 a semi-gradient step enlarges delta."""
    this, after = _successive_features(records)
    ratio: Vector = paper.GAMMA * np.sum(this * after, axis=1) / np.sum(this**2, axis=1)
    return ratio


def parallel_share(records: Records) -> float:
    """Share of the steps whose phi and phi+ are parallel, to a cosine of `TIGHT`."""
    this, after = _successive_features(records)
    lengths = np.linalg.norm(this, axis=1) * np.linalg.norm(after, axis=1)
    return float(np.mean(np.sum(this * after, axis=1) / lengths > TIGHT))


def _successive_features(records: Records) -> tuple[Matrix, Matrix]:
    """phi and phi+ of each step, where both are known, each of shape (pairs, d)."""
    features = records.steps["features"]
    known = _goes_on(records) & np.isfinite(features[:-1] + features[1:]).all(axis=1)
    return features[:-1][known], features[1:][known]


def _goes_on(records: Records) -> Any:
    """Whether the step after each step but the last is of the same episode."""
    episode = records.steps["episode"]
    return episode[1:] == episode[:-1]

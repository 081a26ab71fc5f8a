"""Numbers of one run, from its records."""

from collections.abc import Callable

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Task
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import paper
from nmpcrl.study.records import Column, Records, StepStatus
from nmpcrl.study.records import final_cost as records_final_cost

TOUCH = 1e-6  # largest violation that is within the solver's tolerance
TIGHT = 0.999  # least cosine of parallel features
LATE = 20  # episodes at the end of training; at most the second half


def training_cost(records: Records) -> Vector:
    """Sum of the RL cost over each episode, noise included, shape (episodes,): Figs. 1 and 2.

    nan for an episode that a failed solve cut short, or that the run did not reach.
    """
    steps = records.steps
    episodes, length = records.experiment["episodes"], records.experiment["steps"]
    total = np.bincount(steps["episode"], np.nan_to_num(steps["cost"]), minlength=episodes)
    count = np.bincount(steps["episode"], steps["status"] != StepStatus.FAILED, minlength=episodes)
    return np.where(count == length, total, np.nan)


def noise_free_cost(records: Records) -> tuple[Column, Vector]:
    """The episodes before each rollout without noise, and the rollout's cost."""
    return records.evaluations["episode"], records.evaluations["cost"]


def initial_cost(records: Records) -> float:
    """Noise-free cost of theta_init."""
    return float(records.evaluations["cost"][0])


def final_cost(records: Records) -> float:
    """Noise-free cost at the end: see `records.final_cost`."""
    return records_final_cost(records.evaluations["cost"])


def final_theta(records: Records) -> Vector:
    """theta when training stopped, shape (d,)."""
    result: Vector = records.steps["theta"][-1]
    return result


def final_rollout(records: Records) -> tuple[Column, Column]:
    """States (K + 1, n) and actions (K + 1, m) of the last rollout without noise."""
    return records.evaluations["states"][-1], records.evaluations["actions"][-1]


def gain(records: Records) -> float:
    """Relative reduction of the noise-free cost by learning."""
    return 1 - final_cost(records) / initial_cost(records)


def late_cost_range(records: Records) -> float:
    """Range of the noise-free cost in the second half of training, relative to the initial cost.

    Infinite if a rollout failed, or training ended earlier.
    """
    return late_cost_range_of(*noise_free_cost(records), records.experiment["episodes"])


def late_cost_range_of(episode: Column, cost: Vector, episodes: int) -> float:
    """`late_cost_range` by the rollouts' episodes and costs; the first is under theta_init."""
    late = cost[episode >= episodes / 2]
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
    """`late_training_cost` of a run over that of the frozen learner under the same noise.

    Infinite if the run alone lost half of its late episodes, 0 if the frozen learner alone did,
    nan (not known) if both did.

    Args:
        cost: `training_cost` of the run.
        frozen: `training_cost` of the frozen learner with the same seed, layout and decay.
    """
    return late_training_cost(cost) / late_training_cost(frozen)


def overshooting(records: Records) -> float:
    """Share of the steps with alpha ||phi||^2 above `OVERSHOOT`."""
    return float(np.mean(records.steps["alpha_phi2"] > OVERSHOOT))


def theta_distance(a: Records, b: Records) -> float:
    """Largest relative difference between the components of two final thetas."""
    first, second = final_theta(a), final_theta(b)
    return float(np.max(np.abs(first - second) / np.maximum(np.abs(first), np.abs(second))))


def obstacle_violations(states: Column, task: Task) -> Vector:
    """Xi of the worst obstacle in each state in which it is above `TOUCH`."""
    worst = task.overlap(states).max(axis=-1)
    result: Vector = worst[worst > TOUCH]
    return result


def input_violations(actions: Column, lower: Vector, upper: Vector) -> int:
    """Number of actions that leave the action space by more than `TOUCH`."""
    return int(((actions < lower - TOUCH) | (actions > upper + TOUCH)).any(axis=-1).sum())


def boundary_share(records: Records, task: Task) -> float:
    """Share of the steps in a state with Xi + theta_c = 0, where V has a kink.  # departure L"""
    edge = task.overlap(records.steps["state"]) + theta_before(records)[:, -1:]
    return float((np.abs(edge) <= TOUCH).any(axis=-1).mean())


def memory(records: Records) -> float:
    """Correlation of consecutive TD errors; 0 if transitions were drawn independently."""
    delta = records.steps["delta"][np.isfinite(records.steps["delta"])]
    return float(np.corrcoef(delta[:-1], delta[1:])[0, 1])


def theta_before(records: Records) -> Vector:
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
    same_episode = steps["episode"][1:] == steps["episode"][:-1]
    error = np.where(same_episode, steps["next_value"][:-1] - solved, np.nan)
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
    steps = records.steps
    this, after = steps["features"][:-1], steps["features"][1:]
    ratio = paper.GAMMA * np.sum(this * after, axis=1) / np.sum(this**2, axis=1)
    same_episode = steps["episode"][1:] == steps["episode"][:-1]
    result: Vector = ratio[same_episode & np.isfinite(ratio)]
    return result


def parallel_share(records: Records) -> float:
    """Share of the steps whose phi and phi+ are parallel, to a cosine of `TIGHT`."""
    steps = records.steps
    this, after = steps["features"][:-1], steps["features"][1:]
    cosine = np.sum(this * after, axis=1) / (
        np.linalg.norm(this, axis=1) * np.linalg.norm(after, axis=1)
    )
    same_episode = steps["episode"][1:] == steps["episode"][:-1]
    return float(np.mean(cosine[same_episode & np.isfinite(cosine)] > TIGHT))

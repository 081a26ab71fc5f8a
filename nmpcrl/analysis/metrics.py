"""Numbers of one run, from its records."""

from collections.abc import Callable

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Task
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import paper
from nmpcrl.study.records import Column, Records, StepStatus
from nmpcrl.study.records import final_cost as records_final_cost

TOUCH = 1e-6  # a violation this small is the solver's tolerance, not a violation
TIGHT = 0.999  # cosine from which two features are called parallel
LATE = 20  # episodes that stand for the end of training; at most the second half


def training_cost(records: Records) -> Vector:
    """Sum of the RL cost over each episode, noise included, shape (episodes,): Figs. 1 and 2.

    nan for an episode that a failed solve cut short, or that was never reached.
    """
    steps = records.steps
    episodes, length = records.experiment["episodes"], records.experiment["steps"]
    total = np.bincount(steps["episode"], np.nan_to_num(steps["cost"]), minlength=episodes)
    count = np.bincount(steps["episode"], steps["status"] != StepStatus.FAILED, minlength=episodes)
    return np.where(count == length, total, np.nan)


def noise_free_cost(records: Records) -> tuple[Column, Vector]:
    """After how many episodes theta was judged without noise, and the cost it then had."""
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
    """Share of the noise-free cost that learning took away; negative if it added."""
    return 1 - final_cost(records) / initial_cost(records)


def late_cost_range(records: Records) -> float:
    """Range of the noise-free cost over the second half of training, as a share of the first's.

    Infinite where a rollout failed, or training did not get that far.
    """
    return late_cost_range_of(*noise_free_cost(records), records.experiment["episodes"])


def late_cost_range_of(episode: Column, cost: Vector, episodes: int) -> float:
    """`late_cost_range` from the rollouts' episodes and costs; the first one judged theta_init."""
    late = cost[episode >= episodes / 2]
    if not late.size or not np.isfinite(late).all():
        return np.inf
    return float((late.max() - late.min()) / cost[0])


def late_training_cost(cost: Vector) -> float:
    """Median training cost of the last `LATE` episodes, or of the second half if that is fewer.

    An episode that was cut short, or never reached, costs infinitely much.

    Args:
        cost: of each episode, as `training_cost` gives it, shape (episodes,).
    """
    window = min(LATE, max(1, len(cost) // 2))
    return float(np.median(np.nan_to_num(cost[-window:], nan=np.inf)))


def cost_ratio(cost: Vector, frozen: Vector) -> float:
    """`late_training_cost` of a run over that of its frozen arm, which meets the same noise.

    Infinite where the run lost half of its late episodes, so that it diverged; 0 where the frozen
    arm did and the run did not; nan where both did. Then the frozen theta fares no better than the
    one that was learned, and whether learning diverged cannot be said: the answer is missing.

    Args:
        cost: of each episode of the run, as `training_cost` gives it, shape (episodes,).
        frozen: that of the run of the frozen learner with the same seed, layout and decay.
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
    """Xi of the worst obstacle, where it is above 0 by more than `TOUCH`: one value a violation."""
    worst = task.overlap(states).max(axis=-1)
    result: Vector = worst[worst > TOUCH]
    return result


def input_violations(actions: Column, lower: Vector, upper: Vector) -> int:
    """How many actions leave the action space by more than `TOUCH`."""
    return int(((actions < lower - TOUCH) | (actions > upper + TOUCH)).any(axis=-1).sum())


def boundary_share(records: Records, task: Task) -> float:
    """Share of the steps whose state lies on a boundary Xi + theta_c = 0, where V has a kink.

    theta is the one that the step was solved with.  # departure L
    """
    edge = task.overlap(records.steps["state"]) + theta_before(records)[:, -1:]
    return float((np.abs(edge) <= TOUCH).any(axis=-1).mean())


def memory(records: Records) -> float:
    """Correlation of consecutive TD errors; 0 if transitions were drawn independently."""
    delta = records.steps["delta"][np.isfinite(records.steps["delta"])]
    return float(np.corrcoef(delta[:-1], delta[1:])[0, 1])


def theta_before(records: Records) -> Vector:
    """theta that each step was solved with, shape (steps, d)."""
    return np.vstack([records.experiment["theta"], records.steps["theta"][:-1]])


def online_error(records: Records) -> Vector:
    """What each step took for Q(s+, a+) minus what it was; nan where that is not known.

    The next step of the episode solves in s+, but with the theta that this step moved. Its value is
    carried back by the gradient: V_theta(s+) = V_theta'(s+) - phi+'(theta' - theta) to first order.
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
    """gamma phi'phi+ / phi'phi, step by step: above 1 a semi-gradient step feeds itself."""
    steps = records.steps
    this, after = steps["features"][:-1], steps["features"][1:]
    ratio = paper.GAMMA * np.sum(this * after, axis=1) / np.sum(this**2, axis=1)
    same_episode = steps["episode"][1:] == steps["episode"][:-1]
    result: Vector = ratio[same_episode & np.isfinite(ratio)]
    return result


def parallel_share(records: Records) -> float:
    """Share of the steps whose phi and phi+ point the same way, to a cosine of `TIGHT`."""
    steps = records.steps
    this, after = steps["features"][:-1], steps["features"][1:]
    cosine = np.sum(this * after, axis=1) / (
        np.linalg.norm(this, axis=1) * np.linalg.norm(after, axis=1)
    )
    same_episode = steps["episode"][1:] == steps["episode"][:-1]
    return float(np.mean(cosine[same_episode & np.isfinite(cosine)] > TIGHT))

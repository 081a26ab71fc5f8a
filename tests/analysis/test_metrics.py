"""Metrics on hand-made records, where every number can be checked by eye."""

import numpy as np
import pytest

from nmpcrl.analysis import metrics
from nmpcrl.control import Obstacle, Task
from nmpcrl.study.records import Records

D = 9  # components of theta


def records(
    costs,
    *,
    status=None,
    judged=(100.0, 90.0),
    at=None,
    episodes=None,
    theta=None,
    states=None,
    delta=None,
) -> Records:
    """A run from the costs of its steps, one row an episode, and its noise-free costs."""
    costs = np.array(costs, float)
    number, length = costs.shape
    rows = costs.size
    theta = np.zeros((rows, D)) if theta is None else np.array(theta, float)
    steps = {
        "episode": np.repeat(np.arange(number), length),
        "cost": costs.ravel(),
        "status": np.zeros(rows, int) if status is None else np.array(status),
        "theta": theta,
        "state": np.zeros((rows, 3)) if states is None else np.array(states, float),
        "alpha_phi2": np.linspace(0, 4, rows),
        "delta": np.zeros(rows) if delta is None else np.array(delta, float),
    }
    judged = np.array(judged, float)
    evaluations = {
        "episode": np.arange(judged.size) if at is None else np.array(at),
        "cost": judged,
        "states": np.zeros((judged.size, 4, 3)),
        "actions": np.zeros((judged.size, 4, 2)),
    }
    asked = {"episodes": episodes or number, "steps": length, "theta": (0.0,) * D}
    return Records(asked, steps, evaluations, {"stopped": "finished"})


@pytest.mark.parametrize(
    ("costs", "changes", "expected"),
    [
        ([[1, 2], [3, 4]], {}, [3, 7]),
        ([[1, 2], [3, np.nan]], {"status": [0, 0, 0, 2]}, [3, np.nan]),  # cut short
        ([[1, 2], [3, 4]], {"status": [0, 0, 0, 2]}, [3, np.nan]),  # its last update failed
        ([[1, 2]], {"status": [0, 1]}, [3]),  # a restart is no failure
        ([[1, 2]], {"episodes": 3}, [3, np.nan, np.nan]),  # never reached
    ],
)
def test_the_training_cost_is_the_sum_over_each_episode_that_went_to_its_end(
    costs, changes, expected
):
    found = metrics.training_cost(records(costs, **changes))
    assert found == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize(
    ("judged", "final", "gain"),
    [
        ([100, 50, 40, 30, 20], 30, 0.7),
        ([100, 150, 150, 150], 150, -0.5),
        ([100, 50, np.inf, 40], np.inf, -np.inf),
    ],
)
def test_the_final_cost_is_the_mean_of_the_last_rollouts(judged, final, gain):
    run = records([[1]], judged=judged)
    assert metrics.initial_cost(run) == 100
    assert (metrics.final_cost(run), metrics.gain(run)) == (final, pytest.approx(gain))


@pytest.mark.parametrize(
    ("judged", "at", "expected"),
    [
        ([100, 900, 70, 60, 65], [0, 1, 2, 3, 4], 0.1),
        ([100, 90], [0, 1], np.inf),  # no rollout in the second half
        ([100, 70, np.inf, 60], [0, 1, 3, 4], np.inf),
        ([100, 70, np.inf, np.inf], [0, 1, 3, 4], np.inf),
    ],
)
def test_the_late_cost_range_is_judged_in_the_second_half_only(judged, at, expected):
    run = records(np.ones((4, 1)), judged=judged, at=at)
    assert metrics.late_cost_range(run) == pytest.approx(expected)


LOST, FULL, ONE_LOST = np.full(4, np.nan), np.full(4, 10.0), np.array([10.0] * 59 + [np.nan])
LATE = np.array([10.0] * 40 + [30.0] * 11 + [1000.0] * 9)  # median of the last 20: 30


@pytest.mark.parametrize(
    ("cost", "frozen", "ratio"),
    [
        (LATE, np.full(60, 10.0), 3.0),
        (np.array([999.0, 999, 20, 20]), FULL, 2.0),  # no more than the second half
        (np.array([30.0]), np.array([10.0]), 3.0),
        (np.array([1.0, np.nan]), np.ones(2), np.inf),
        (LOST, FULL, np.inf),
        (FULL, LOST, 0.0),
        (LOST, LOST, np.nan),
        (ONE_LOST, ONE_LOST, 1.0),  # one lost episode counts as one of high cost
    ],
)
def test_the_cost_ratio_compares_medians_and_a_lost_episode_costs_infinitely_much(
    cost, frozen, ratio
):
    assert metrics.cost_ratio(cost, frozen) == pytest.approx(ratio, nan_ok=True)


def test_overshooting_counts_the_steps_strictly_above_two():
    assert metrics.overshooting(records(np.ones((1, 5)))) == pytest.approx(2 / 5)  # 0 1 2 3 4


def test_the_distance_between_thetas_is_relative_and_symmetric():
    a = records([[1]], theta=[[1.0] * D])
    b = records([[1]], theta=[[1.0] * (D - 1) + [2.0]])
    assert metrics.theta_distance(a, b) == metrics.theta_distance(b, a) == pytest.approx(0.5)
    assert metrics.theta_distance(a, a) == 0


def test_neither_a_boundary_nor_an_unknown_state_is_a_violation():
    task = scene()
    states = np.array([[1.25, 0, 0], [1.25 - 1e-3, 0, 0], [5, 5, 0], [np.nan] * 3])
    (worst,) = metrics.obstacle_violations(states, task)
    assert worst == pytest.approx(task.overlap(states[1]).max())
    actions = np.array([[1, 2], [-1, -2], [1.1, 0], [0, -2.1], [np.nan, np.nan]])
    assert metrics.input_violations(actions, np.array([-1.0, -2.0]), np.array([1.0, 2.0])) == 2


def test_the_boundary_is_the_one_of_the_theta_that_the_step_was_solved_with():
    on_boundary = [1.25, 0, 0]  # Xi = 0
    theta = np.zeros((3, D))
    theta[0, -1] = 0.1  # moves the boundary away from the second step on
    run = records([[1, 1, 1]], states=[on_boundary] * 3, theta=theta)
    assert metrics.boundary_share(run, scene()) == pytest.approx(2 / 3)


def test_independent_errors_have_no_memory_and_alternating_ones_a_negative_one():
    rng = np.random.default_rng(0)
    free = records(np.ones((1, 4000)), delta=rng.normal(size=4000))
    assert abs(metrics.memory(free)) < 0.05
    assert metrics.memory(records(np.ones((1, 4)), delta=[1, -1, 1, -1])) == pytest.approx(-1)
    unknown = records(np.ones((1, 6)), delta=[np.nan, np.nan, 1, 2, 3, 4])
    assert metrics.memory(unknown) == pytest.approx(1)


def scene() -> Task:
    """One obstacle at the origin, which a robot of 0.5 m touches at 1.25 m."""
    return Task(
        start=np.array([-2.0, 0.0, 0.0]),
        target=np.array([6.0, 0.0, 0.0]),
        lower=np.array([-9.0, -9.0, -np.inf]),
        upper=np.array([9.0, 9.0, np.inf]),
        obstacles=(Obstacle(0.0, 0.0),),
    )

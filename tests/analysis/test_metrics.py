"""Metrics on hand-made records, where every number can be checked by eye."""

import numpy as np
import pytest

from nmpcrl.analysis import metrics
from nmpcrl.control import Obstacle, Task
from nmpcrl.study import paper
from nmpcrl.study.records import Records

D = 9  # components of theta


def records(costs, *, judged=(100.0, 90.0), at=None, episodes=None, **columns) -> Records:
    """A run from the costs of its steps, one row an episode, its noise-free costs and columns."""
    costs = np.array(costs, float)
    (number, length), rows = costs.shape, costs.size
    steps = {
        "episode": np.repeat(np.arange(number), length),
        "cost": costs.ravel(),
        "status": np.zeros(rows, int),
        "theta": np.zeros((rows, D)),
        "alpha_phi2": np.linspace(0, 4, rows),
        **{name: np.array(column) for name, column in columns.items()},
    }
    judged = np.array(judged, float)
    at = np.arange(judged.size) if at is None else np.array(at)
    asked = {"episodes": episodes or number, "steps": length, "theta": (0.0,) * D}
    return Records(asked, steps, {"episode": at, "cost": judged}, {"stopped": "finished"})


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


def test_steps_above_two_overshoot_and_neither_a_bound_nor_an_unknown_action_is_violated():
    assert metrics.overshooting(records(np.ones((1, 5)))) == pytest.approx(2 / 5)  # 0 1 2 3 4
    actions = np.array([[1, 2], [-1, -2], [1.1, 0], [0, -2.1], [np.nan, np.nan]])
    found = metrics.out_of_bounds(actions, np.array([-1.0, -2.0]), np.array([1.0, 2.0]))
    assert found.tolist() == [False, False, True, True, False]


def test_boundaries_are_of_the_theta_of_a_step_and_predictions_compared_with_the_next_one():
    theta, bounds = np.zeros((3, D)), np.full(3, 9.0)
    theta[0, -1] = 0.1  # moves the boundary away from the second step on
    run = records([[1, 1, 1]], state=[[1.25, 0, 0]] * 3, theta=theta)  # where Xi = 0
    scene = Task(np.zeros(3), np.zeros(3), -bounds, bounds, obstacles=(Obstacle(0.0, 0.0),))
    assert metrics.boundary_share(run, scene) == pytest.approx(2 / 3)
    phi = np.zeros((6, D))
    phi[:, :2] = [[1, 0], [2, 0], [0, 1], [3, 0], [np.nan, 0], [1, 1]]
    run = records(np.ones((2, 3)), features=phi)  # three pairs are of two episodes, or unknown
    np.testing.assert_allclose(metrics.next_over_this(run), [2 * paper.GAMMA, 0])
    assert metrics.parallel_share(run) == 0.5
    phi, theta = np.random.default_rng(0).normal(size=(2, 6, D))
    before, wrong = np.vstack([np.zeros(D), theta[:-1]]), np.arange(1.0, 7.0)
    true = np.append(np.sum(before[:-1] * phi[1:], axis=1), 0.0)
    run = records(np.ones((2, 3)), features=phi, theta=theta,
                  value=np.sum(before * phi, axis=1), next_value=true + wrong)  # fmt: skip
    np.testing.assert_allclose(metrics.online_error(run), [1, 2, np.nan, 4, 5, np.nan])

"""The task: Xi and the RL cost by hand, and what is refused."""

import numpy as np
import pytest
from small_problems import BEHIND, task

from nmpcrl.control import Obstacle

STILL = np.zeros(2)


def test_overlap_and_cost_are_equations_nineteen_and_twenty_by_hand():
    states = np.array([[0.5, 2.2, 0.3], [0.5, 2.2 + 1.25, -1.0], [1.0, 1.0, 0.0]])
    by_hand = [1, 0, 1 - 4 * (0.5**2 + 1.2**2) / 2.5**2]
    np.testing.assert_allclose(task().overlap(states)[:, 0], by_hand, rtol=1e-13, atol=1e-15)
    assert task().overlap(states[2])[1] == pytest.approx(1 - 4 * (2.0**2 + 0.5**2) / 2.5**2)
    many = np.random.default_rng(0).uniform(-3, 9, (4, 5, 3))
    one_by_one = [[task().overlap(s) for s in row] for row in many]
    np.testing.assert_array_equal(task().overlap(many), one_by_one)
    small = task(obstacles=(Obstacle(0.0, 0.0, diameter=0.5),), robot_diameter=0.3)
    assert small.overlap(np.array([0.4, 0.0, 0.0]))[0] == pytest.approx(0, abs=1e-15)
    state, action = np.array([0.5, 1.2, 0.5]), np.array([0.3, -0.4])  # of norm 0.5
    tracking = 8.0**2 + 0.8**2 + 0.1 * (np.pi / 2 - 0.5) ** 2
    penalty = 50 * (1 - 4 * 1.0**2 / 2.5**2 + 0.35)  # the second obstacle is too far away
    assert task().stage_cost(state, action) == pytest.approx(tracking + penalty, rel=1e-14)
    for off, turned, paid in ((1.4999, 0.0, 0.5), (1.5, 0.0, 0.0), (1.4999, 0.1, 0.0)):
        near = np.array([8.5 - off, 2.0, np.pi / 2 + turned])
        expected = off**2 + 0.1 * turned**2 + paid
        assert task().stage_cost(near, action) == pytest.approx(expected, rel=1e-12)
    crowded = task(obstacles=(Obstacle(8.5, 2.0),))
    assert crowded.stage_cost(crowded.target, STILL) == 0


@pytest.mark.parametrize("angle", [0.0, 1.0, 4.0])
def test_the_penalty_vanishes_at_a_centre_distance_of_1452_millimetres(angle):
    centre, direction = np.array([0.5, 2.2, 0.0]), np.array([np.cos(angle), np.sin(angle), 0.0])
    alone = task(obstacles=(Obstacle(0.5, 2.2),))
    assert alone.collision_penalty(centre + 1.4523 * direction) > 0
    assert alone.collision_penalty(centre + 1.4524 * direction) == 0
    assert 1.25 * np.sqrt(1.35) == pytest.approx(1.4524, abs=5e-5)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_the_penalty_adds_up_over_obstacles_and_a_target_may_lie_outside_the_box(count):
    some = task(obstacles=(Obstacle(0.5, 2.2),) * count)
    at = np.array([0.5, 2.2, 0.0])
    assert some.overlap(at).shape == (count,)
    assert some.collision_penalty(at) == pytest.approx(count * 50 * 1.35)
    assert task(**BEHIND, target_may_lie_outside=True).target[0] == 8.5

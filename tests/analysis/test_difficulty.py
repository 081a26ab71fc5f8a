"""Measures of difficulty, against cases that are worked out by hand."""

import numpy as np
import pytest

from nmpcrl.analysis import difficulty
from nmpcrl.analysis.difficulty import (
    barn,
    clearance,
    measure,
    raised_cost,
    sight,
    spaced,
    stops_arriving,
)
from nmpcrl.study import paper

ONE = ((3.0, 3.0),)  # in the middle of the box, [-3, 9]^2; its disc has a radius of 1.25


@pytest.fixture(scope="module")
def task():
    return paper.task_among(ONE)


def test_the_closest_is_the_disc_or_the_wall_and_0_within_the_disc(task):
    points = np.array([[3.0, 5.0], [-2.8, 3.0], [3.5, 3.0]])
    assert clearance(points, task) == pytest.approx([0.75, 0.2, 0.0])


def test_sight_ends_at_the_disc_or_at_the_wall(task):
    east, north, west, south = sight(np.array([[0.0, 3.0]]), 4, task)[0]
    assert (east, north, west, south) == pytest.approx((3 - 1.25, 6.0, 3.0, 6.0))


def test_a_slanted_ray_meets_the_disc_where_it_cuts_the_circle(task):
    # from (0, 0) along the diagonal the centre is 3 sqrt(2) away
    diagonal = sight(np.array([[0.0, 0.0]]), 8, task)[0][1]
    assert diagonal == pytest.approx(3 * np.sqrt(2) - 1.25)


def test_within_a_disc_nothing_is_seen(task):
    assert sight(np.array([[3.2, 3.0]]), 16, task)[0] == pytest.approx(np.zeros(16))


def test_points_along_a_path_are_equally_far_apart_however_it_was_sampled():
    path = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.0], [1.0, 0.0], [1.0, 0.5]])
    points = spaced(path)
    assert len(points) == 11
    assert points[:7, 0] == pytest.approx(0.15 * np.arange(7))
    assert points[-1] == pytest.approx([1.0, 0.5])


def test_a_path_beside_a_wall_has_its_distance_its_width_and_two_changes():
    task = paper.task_among(((-2.0, 8.9),))  # far away
    path = np.array([[3.0, -2.7], [3.0 + 1e-9, -2.7]])
    found = barn(path, task)
    assert found["closest"] == pytest.approx(0.3)
    assert found["tortuosity"] == pytest.approx(1.0)
    # the wall is within 0.45 m in the 5 directions of the 16 with 0.3 / sin <= 0.45
    assert found["dispersion"] == pytest.approx(2.0)
    # up and down are 12 m, as left and right; both diagonals end at the near wall and a side wall
    assert found["dimension"] == pytest.approx((0.3 + 6) * np.sqrt(2))


def test_the_least_width_between_two_discs_is_their_distance():
    task = paper.task_among(((3.0, 1.0), (3.0, 5.0)))
    points = np.array([[3.0, 3.0], [3.0, 3.0 + 1e-9]])
    assert barn(points, task)["dimension"] == pytest.approx(4 - 2 * 1.25)


def test_tortuosity_of_a_half_circle_is_half_of_pi(task):
    angle = np.linspace(0, np.pi, 2001)
    path = np.stack([3 + 4 * np.cos(angle), 3 + 4 * np.sin(angle)], axis=1)
    assert barn(path, task)["tortuosity"] == pytest.approx(np.pi / 2, rel=1e-5)


def test_the_first_gap_of_e_closes_before_that_of_d_as_their_rollouts_show():
    found = {name: measure(paper.LAYOUTS[name]) for name in "DE"}
    assert 0.15 < found["E"].closes < 0.2 < found["D"].closes < 0.25
    assert found["E"].cost == pytest.approx(4369.70, abs=0.01)
    assert 0 < found["E"].overshoot < 2
    assert all(np.isfinite(getattr(found["D"], name)) for name in difficulty.MEASURES)


@pytest.mark.parametrize("horizon", [10, 20])
def test_the_robot_stops_arriving_in_e_where_its_gap_has_closed(horizon):
    grid = np.array([0.0, 0.15, 0.2, 0.5])
    assert stops_arriving(paper.LAYOUTS["E"], horizon, grid) == 0.2


def test_with_one_obstacle_the_robot_always_arrives():
    assert np.isnan(stops_arriving(ONE, 10, np.array([0.0, 0.2])))


def test_raising_theta_c_across_the_closing_of_a_gap_costs_much_and_by_nothing_nothing():
    theta = np.array([*paper.THETA_INIT[:-1], 0.15])
    assert raised_cost("E", theta, 0.0) == 0
    assert raised_cost("E", theta, 1 / 3) > 0.5

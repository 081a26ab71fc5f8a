"""Layouts: each criterion of the screening, and the widths of gaps."""

import numpy as np
import pytest

from nmpcrl.study import paper
from nmpcrl.study.layouts import gaps, screen

AWAY = ((0.0, 7.5), (3.0, 7.5), (5.5, 7.5), (8.0, 7.5))  # all at the upper wall


def moved(*centres):
    """`AWAY` with its first obstacles put elsewhere."""
    return (*centres, *AWAY[len(centres) :])


@pytest.fixture(scope="module")
def task():
    return paper.task()


def test_a_layout_whose_straight_way_is_free_is_refused():
    screening = screen(AWAY)
    assert not screening.blocked
    assert not screening.passed


def test_one_obstacle_on_the_straight_way_blocks_it_and_one_beside_it_does_not():
    middle = np.mean([paper.START[:2], paper.TARGET[:2]], axis=0)
    assert screen(moved(tuple(middle))).blocked
    assert screen(moved((middle[0], middle[1] - 1.2))).blocked
    assert not screen(moved((middle[0], middle[1] - 1.3))).blocked


@pytest.mark.parametrize("end", [paper.START, paper.TARGET])
def test_start_and_target_lie_outside_every_penalty_zone(end):
    middle = (3.0, 1.7)
    edge = 1.25 * np.sqrt(1.35)
    assert screen(moved(middle, (end[0], end[1] + edge + 0.01))).clear
    assert not screen(moved(middle, (end[0], end[1] + edge - 0.01))).clear


def test_a_robot_that_is_walled_in_does_not_arrive():
    wall = tuple((-0.6, y) for y in (-1.2, 0.8, 2.8, 4.8))
    screening = screen(wall)
    assert screening.blocked
    assert screening.clear
    assert not screening.arrives
    assert not screening.passed


def test_a_gap_between_two_obstacles_is_their_distance_less_what_plans_keep_of_each(task):
    x, y, _ = task.discs
    path = np.array([[x[0], y[0]], [x[1], y[1]]]).mean(axis=0) + [[-0.5, -0.75], [0.5, 0.75]]
    apart = np.hypot(x[0] - x[1], y[0] - y[1])
    assert gaps(task, path, 0.0)[0, 1] == pytest.approx(apart - 2 * 1.25)
    assert gaps(task, path, 0.44)[0, 1] == pytest.approx(apart - 2 * 1.25 * 1.2)


def test_a_gap_to_a_wall_is_crossed_below_an_obstacle_and_not_above_it(task):
    x, y, _ = task.discs
    below = np.array([[x[1] - 1, y[1] - 2.0], [x[1] + 1, y[1] - 2.0]])
    assert gaps(task, below, 0.0)[1, -2] == pytest.approx(y[1] + 3.0 - 1.25)
    assert (1, -2) not in gaps(task, below + [0, 4.0], 0.0)


def test_a_path_that_stands_still_goes_through_no_gap(task):
    assert gaps(task, np.full((5, 2), [1.7, 1.4]), 0.0) == {}


def test_a_layout_closes_where_the_gap_of_the_first_rollout_does_at_theta_c_of_the_margin():
    assert screen(paper.LAYOUTS["A"]).kind == "open"
    (x, y), second, *others = paper.LAYOUTS["A"]
    towards = np.array(second) - [x, y]
    nearer = np.array(second) - 0.15 * towards / np.linalg.norm(towards)
    assert screen(((x, y), tuple(nearer), *others)).kind == "closing"

"""A trajectory's summary: each number against one whose numbers can be read off."""

import numpy as np
import pytest

from nmpcrl.analysis.trajectory import closes_at, describe
from nmpcrl.study import paper
from nmpcrl.study.layouts import gaps

FAR = 1.25 * np.sqrt(1.35)  # from a centre; the penalty begins here [m]
# One obstacle in the middle of the way, three at the upper wall.
TASK = paper.task(((3.0, 0.0), (0.0, 7.5), (3.0, 7.5), (6.0, 7.5)))
NEAR = paper.task(((8.5, 3.2), (0.0, 7.5), (3.0, 7.5), (6.0, 7.5)))


def along(*points, heading=np.pi / 2):
    """States with a heading, by default the target's, at these positions."""
    return np.column_stack([np.array(points), np.full(len(points), heading)])


def test_a_straight_trajectory_is_as_long_as_its_ends_are_apart():
    found = describe(along(*np.linspace([-2.5, 2.0], [8.5, 2.0], 12)), TASK, 0.5)
    assert found.length == pytest.approx(11.0)
    assert found.clearance == pytest.approx(np.hypot(0.5, 2.0) - 1.25)
    assert describe(along([3.0, 1.0]), TASK, 0.5).clearance == pytest.approx(-0.25)


@pytest.mark.parametrize(
    ("away", "heading", "arrival"),
    [
        ([3.0, 0.1, 2.0, 0.6, 0.4, 0.0], np.pi / 2, 4 * 0.5),  # it left once
        ([3.0, 0.1, 2.0, 0.6], np.pi / 2, np.inf),
        ([0.0, 0.0, 0.0], -np.pi / 2, 0),  # wherever it looks
        ([0.0, 0.0, np.nan, np.nan], np.pi / 2, np.inf),  # a solve failed
    ],
)
def test_the_robot_has_arrived_when_it_is_at_the_target_to_stay(away, heading, arrival):
    states = along(*([8.5 - one, 2.0] for one in away), heading=heading)
    assert describe(states, TASK, 0.5).arrival == pytest.approx(arrival)


def test_coming_close_is_charged_within_the_margin_and_a_gap_closes_at_no_width():
    beside, within = [3.0, FAR + 0.01], [3.0, 1.25]
    assert describe(along(beside), TASK, 0.5).penalty == 0
    assert describe(along(beside, within), TASK, 0.5).penalty == pytest.approx(50 * 0.35)
    assert describe(along([8.5, 2.1]), NEAR, 0.5).penalty == 0
    task, path = paper.task("A"), np.array([[5.5, 0.5], [7.5, 2.5]])
    shut = closes_at(task, path)
    assert min(gaps(task, path, shut).values()) == pytest.approx(0, abs=1e-12)
    assert shut == pytest.approx((np.hypot(1.5, 2.5) / 2.5) ** 2 - 1)
    beside_a_wall = paper.task(((7.0, -1.0),)), np.array([[7.0, -2.8], [8.0, -2.8]])
    assert closes_at(*beside_a_wall) == pytest.approx((2 / 1.25) ** 2 - 1)
    assert closes_at(task, np.full((3, 2), [1.7, 1.4])) == np.inf  # through no gap

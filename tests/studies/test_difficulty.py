"""Measures of difficulty, against cases that are worked out by hand, and predictors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.learning.rollout import evaluate
from nmpcrl.studies.difficulty import (
    auc,
    barn,
    brier,
    clearance,
    measure,
    predicted,
    sight,
    spaced,
    stops_arriving,
)
from nmpcrl.study import paper

ONE = ((3.0, 3.0),)  # in the middle of the box, [-3, 9]^2; its disc has a radius of 1.25
TASK = paper.task(ONE)


def test_the_closest_is_the_disc_or_the_wall_and_0_within_the_disc():
    points = np.array([[3.0, 5.0], [-2.8, 3.0], [3.5, 3.0]])
    assert clearance(points, TASK) == pytest.approx([0.75, 0.2, 0.0])


@pytest.mark.parametrize(
    ("point", "directions", "seen"),
    [
        ((0.0, 3.0), 4, [3 - 1.25, 6.0, 3.0, 6.0]),  # the disc, and three walls
        # along the diagonal the centre is 3 sqrt(2) away
        ((0.0, 0.0), 8, [9, 3 * np.sqrt(2) - 1.25, 9, 3 * np.sqrt(2), 3, 3 * np.sqrt(2), 3,
                         3 * np.sqrt(2)]),
        ((3.2, 3.0), 16, np.zeros(16)),  # within the disc
    ],
)  # fmt: skip
def test_sight_ends_at_the_disc_or_at_the_wall(point, directions, seen):
    assert sight(np.array([point]), directions, TASK)[0] == pytest.approx(seen)


def test_points_of_a_path_are_equally_far_apart_and_its_distance_and_width_are_by_hand():
    path = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.0], [1.0, 0.0], [1.0, 0.5]])
    points = spaced(path)
    assert len(points) == 11
    assert points[:7, 0] == pytest.approx(0.15 * np.arange(7))
    assert points[-1] == pytest.approx([1.0, 0.5])
    task = paper.task(((-2.0, 8.9),))  # far away
    found = barn(np.array([[3.0, -2.7], [3.0 + 1e-9, -2.7]]), task)
    assert found["closest"] == pytest.approx(0.3)
    assert found["tortuosity"] == pytest.approx(1.0)
    # the wall is within 0.45 m in the 5 directions of the 16 with 0.3 / sin <= 0.45
    assert found["dispersion"] == pytest.approx(2.0)
    # up and down are 12 m, as left and right; both diagonals end at the near wall and a side wall
    assert found["dimension"] == pytest.approx((0.3 + 6) * np.sqrt(2))
    task = paper.task(((3.0, 1.0), (3.0, 5.0)))
    points = np.array([[3.0, 3.0], [3.0, 3.0 + 1e-9]])
    assert barn(points, task)["dimension"] == pytest.approx(4 - 2 * 1.25)
    angle = np.linspace(0, np.pi, 2001)
    path = np.stack([3 + 4 * np.cos(angle), 3 + 4 * np.sin(angle)], axis=1)
    assert barn(path, TASK)["tortuosity"] == pytest.approx(np.pi / 2, rel=1e-5)


def test_the_first_gap_of_e_closes_before_that_of_d_as_their_rollouts_show():
    found = {name: measure(paper.LAYOUTS[name]) for name in "DE"}
    assert 0.15 < found["E"]["closes"] < 0.2 < found["D"]["closes"] < 0.25
    assert found["E"]["cost"] == pytest.approx(4369.70, abs=0.01)
    assert 0 < found["E"]["overshoot"] < 2
    half = np.append(np.zeros(8), 0.005)  # of the step along which the slope is measured
    raised, first = (evaluate(paper.nmpc("E"), paper.THETA_INIT + one, paper.STEPS).cost
                     for one in (half, 0 * half))  # fmt: skip
    assert found["E"]["slope"] == pytest.approx((raised - first) / 0.005, rel=0.2)
    assert np.isfinite([*found["D"].values()]).all()
    for horizon in (10, 20):
        grid = np.array([0.0, 0.15, 0.2, 0.5])
        assert stops_arriving(paper.LAYOUTS["E"], horizon, grid) == 0.2
    assert np.isnan(stops_arriving(ONE, 10, np.array([0.0, 0.2])))


@given(st.lists(st.tuples(st.integers(0, 4), st.booleans()), min_size=2, max_size=20))
def test_auc_counts_pairs_and_is_unknown_of_one_kind(layouts):
    score, success = map(np.array, zip(*layouts, strict=True))
    pairs = [(a > b) + 0.5 * (a == b) for a in score[success] for b in score[~success]]
    found = auc(score, success)
    assert np.isnan(found) if not pairs else found == pytest.approx(np.mean(pairs))


def test_brier_by_hand_and_a_fit_is_finite_without_a_slope_left_in_its_loss():
    assert brier(np.array([1.0, 0.0]), np.array([True, False])) == 0
    assert brier(np.array([0.5, 0.5]), np.array([True, False])) == 0.25
    rng = np.random.default_rng(0)
    x = rng.normal(size=40)
    y = rng.random(40) < 1 / (1 + np.exp(-2 * x))
    slope, p = predicted(x, y, x)
    assert (p - y).sum() == pytest.approx(0, abs=1e-4)
    assert ((p - y) * (x - x.mean()) / x.std()).sum() + slope == pytest.approx(0, abs=1e-4)
    measure = np.arange(10.0)
    slope, p = predicted(measure, measure > 4, measure)
    assert 0 < slope < 10
    assert auc(p, measure > 4) == 1
    slope, p = predicted(measure[:5], np.ones(5, bool), np.array([7.0]))
    assert abs(slope) < 1e-3
    assert 0.9 < p.item() < 1
    with pytest.raises(ValueError, match="1 of 2 measures are not finite"):
        predicted(np.array([1.0, np.inf]), np.array([True, False]), measure)

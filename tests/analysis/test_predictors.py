"""Predictors: closed forms, an independent count of pairs, and what a bootstrap must give."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.analysis.predictors import Logistic, auc, brier, fit, over_layouts
from nmpcrl.analysis.statistics import rate


def test_auc_is_1_where_every_success_scores_above_every_failure_and_a_half_where_all_tie():
    success = np.array([True, True, False, False])
    assert auc(np.array([4, 3, 2, 1]), success) == 1
    assert auc(np.array([1, 2, 3, 4]), success) == 0
    assert auc(np.zeros(4), success) == 0.5


@given(st.lists(st.tuples(st.integers(0, 4), st.booleans()), min_size=2, max_size=20))
def test_auc_counts_pairs(layouts):
    score, success = map(np.array, zip(*layouts, strict=True))
    pairs = [(a > b) + 0.5 * (a == b) for a in score[success] for b in score[~success]]
    found = auc(score, success)
    assert np.isnan(found) if not pairs else found == pytest.approx(np.mean(pairs))


def test_auc_of_one_kind_is_unknown():
    assert np.isnan(auc(np.arange(3), np.ones(3, bool)))


def test_brier_of_a_certain_and_right_prediction_is_0_and_of_a_coin_a_quarter():
    assert brier(np.array([1.0, 0.0]), np.array([True, False])) == 0
    assert brier(np.array([0.5, 0.5]), np.array([True, False])) == 0.25


def test_a_fit_has_no_slope_left_in_its_loss():
    rng = np.random.default_rng(0)
    x = rng.normal(size=40)
    y = rng.random(40) < 1 / (1 + np.exp(-2 * x))
    found = fit(x, y, ridge=1.0)
    z, p = (x - found.centre) / found.scale, found(x)
    assert (p - y).sum() == pytest.approx(0, abs=1e-4)
    assert ((p - y) * z).sum() + found.slope == pytest.approx(0, abs=1e-4)


def test_successes_that_a_measure_separates_have_a_finite_slope():
    found = fit(np.arange(10.0), np.arange(10) > 4, ridge=1.0)
    assert 0 < found.slope < 10
    assert auc(found(np.arange(10.0)), np.arange(10) > 4) == 1


def test_where_all_succeed_the_measure_says_nothing():
    found = fit(np.arange(5.0), np.ones(5, bool), ridge=1.0)
    assert found == Logistic(2.0, found.scale, found.intercept, 0.0)
    assert found(np.array([7.0])) == pytest.approx(5.5 / 6)


def test_a_measure_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="1 of 2 measures are not finite"):
        fit(np.array([1.0, np.inf]), np.array([True, False]), ridge=1.0)


def test_the_bootstrap_of_a_share_is_about_as_wide_as_wilsons_interval():
    held = np.arange(120) < 60
    found, wilson = over_layouts(partial(np.mean, axis=-1), held), rate(60, 120)
    assert found.value == 0.5
    assert (found.low, found.high) == pytest.approx((wilson.low, wilson.high), abs=0.01)


def test_columns_of_different_length_are_refused():
    with pytest.raises(ValueError, match=r"columns of \[2, 3\] layouts"):
        over_layouts(auc, np.zeros(2), np.zeros(3, bool))


def test_a_statistic_over_all_axes_is_refused():
    with pytest.raises(ValueError, match="over the last axis is needed"):
        over_layouts(np.mean, np.arange(4.0))

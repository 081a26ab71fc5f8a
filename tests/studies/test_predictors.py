"""Predictors: closed forms, and an independent count of pairs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.studies.difficulty import auc, brier, predicted


@given(st.lists(st.tuples(st.integers(0, 4), st.booleans()), min_size=2, max_size=20))
def test_auc_counts_pairs_and_is_unknown_of_one_kind(layouts):
    score, success = map(np.array, zip(*layouts, strict=True))
    pairs = [(a > b) + 0.5 * (a == b) for a in score[success] for b in score[~success]]
    found = auc(score, success)
    assert np.isnan(found) if not pairs else found == pytest.approx(np.mean(pairs))


def test_brier_of_a_certain_and_right_prediction_is_0_and_of_a_coin_a_quarter():
    assert brier(np.array([1.0, 0.0]), np.array([True, False])) == 0
    assert brier(np.array([0.5, 0.5]), np.array([True, False])) == 0.25


def test_a_fit_has_no_slope_left_in_its_loss():
    rng = np.random.default_rng(0)
    x = rng.normal(size=40)
    y = rng.random(40) < 1 / (1 + np.exp(-2 * x))
    slope, p = predicted(x, y, x)
    assert (p - y).sum() == pytest.approx(0, abs=1e-4)
    assert ((p - y) * (x - x.mean()) / x.std()).sum() + slope == pytest.approx(0, abs=1e-4)


def test_a_fit_is_finite_where_a_measure_separates_successes_or_all_succeed():
    measure = np.arange(10.0)
    slope, p = predicted(measure, measure > 4, measure)
    assert 0 < slope < 10
    assert auc(p, measure > 4) == 1
    slope, p = predicted(measure[:5], np.ones(5, bool), np.array([7.0]))
    assert abs(slope) < 1e-3
    assert 0.9 < p.item() < 1
    with pytest.raises(ValueError, match="1 of 2 measures are not finite"):
        predicted(np.array([1.0, np.inf]), np.array([True, False]), measure)

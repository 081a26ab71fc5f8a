"""Estimates against closed forms, and intervals against how often they cover what is true."""

from functools import partial
from math import comb

import numpy as np
import pytest
from scipy import stats

from nmpcrl.analysis import statistics
from nmpcrl.analysis.statistics import CONFIDENCE, Estimate, interquartile_mean, over_layouts, rate

LAYOUTS = np.repeat(list("ABCDEF"), 20)  # the strata of the main table


@pytest.mark.parametrize(("held", "of"), [(0, 5), (1, 7), (60, 120), (119, 120), (4, 4)])
def test_the_interval_of_a_rate_holds_what_lies_within_two_of_its_own_deviations(held, of):
    """Wilson's bounds are the p at which (held / of - p)^2 = z^2 p (1 - p) / of."""
    estimate, z = rate(held, of), stats.norm.ppf(1 - (1 - CONFIDENCE) / 2)
    assert estimate.value == held / of
    for bound in (estimate.low, estimate.high):
        away = (held / of - bound) ** 2
        assert away == pytest.approx(z**2 * bound * (1 - bound) / of, abs=1e-12)


@pytest.mark.parametrize(("gained", "lost"), [(0, 0), (4, 0), (0, 4), (3, 17), (8, 8)])
def test_pairs_that_change_go_either_way_with_the_same_chance(gained, lost):
    changed, fewer = gained + lost, min(gained, lost)
    tail = sum(comb(changed, i) for i in range(fewer + 1)) / 2**changed
    assert statistics.paired_p(gained, lost) == pytest.approx(min(1.0, 2 * tail))


@pytest.mark.parametrize(
    ("scores", "value"),
    [
        ([100.0, 3, 1, 2, 4, -50, 5, 6], 3.5),
        ([0, 1, 2, 3, 4, 5, np.inf, np.inf], 3.5),
        ([0, 1, 2, 3, 4, np.inf, np.inf, np.inf], np.inf),
    ],
)
def test_the_interquartile_mean_is_the_mean_of_the_middle_half(scores, value):
    estimate = interquartile_mean(np.array(scores), ["A"] * 8)
    assert estimate.value == value
    assert estimate.low <= value <= estimate.high
    assert (estimate.high == np.inf) == (np.inf in scores)


def test_draws_stay_within_a_layout_and_improvement_is_mann_and_whitney_s_u():
    between = interquartile_mean(np.repeat([1.0, 2, 3, 4, 5, 6], 20), LAYOUTS)
    assert (between.low, between.high) == (between.value, between.value)
    scores = np.random.default_rng(3).normal(size=120)
    assert interquartile_mean(scores, LAYOUTS) == interquartile_mean(scores, LAYOUTS)
    single = interquartile_mean(np.array([1.0, 2, 3]), ["A", "A", "B"])
    assert single.value == 2
    assert np.isnan([single.low, single.high]).all()
    rng = np.random.default_rng(4)
    first, second = rng.integers(0, 5, (2, 30)).astype(float)
    u = stats.mannwhitneyu(second, first).statistic
    estimate = statistics.probability_of_improvement(first, second, ["A"] * 30)
    assert estimate.value == pytest.approx(u / 30**2)


@pytest.mark.parametrize(
    ("first", "second", "layouts", "value"),
    [
        ([1, 1, 50, 50, 50, 50], [2, 2, 40, 40, 40, 40], "AABBBB", 0.5),  # worse than all of A
        ([1e9, 1e9], [np.inf, np.inf], "AA", 1),
        ([np.inf, np.inf], [np.inf, np.inf], "AA", 0.5),
    ],
)
def test_layouts_weigh_the_same_and_a_failure_ties_with_a_failure(first, second, layouts, value):
    assert statistics.probability_of_improvement(first, second, layouts).value == value


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.parametrize("of", [interquartile_mean, statistics.probability_of_improvement])
def test_intervals_cover_the_truth_about_as_often_as_they_say(of):
    """Costs that differ by layout, common to the pairs that are compared."""
    rng, scale = np.random.default_rng(2), np.repeat([1.0, 1.1, 1.2, 1.3, 1.4, 1.5], 20)
    if of is interquartile_mean:
        drawn = [(one * scale,) for one in rng.lognormal(0, 0.5, (20_060, 120))]
        true = float(np.median(stats.trim_mean(drawn[60:], 0.25, axis=2)))
    else:
        common, ours, theirs = rng.normal(size=(3, 60, 120))
        drawn = [*zip(common + ours, common + theirs + 0.5, strict=True)]
        true = stats.norm.cdf(0.5 / 2)  # of two runs, each of variance 2
    found = [of(*one, LAYOUTS) for one in drawn[:60]]
    assert 0.88 <= np.mean([one.low <= true <= one.high for one in found]) <= 1


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: rate(0, 0), "0 of 0 runs is not a rate"),
        (lambda: rate(3, 2), "3 of 2 runs"),
        (lambda: interquartile_mean([1, np.nan], "AA"), "1 of 2 scores are nan"),
        (lambda: statistics.probability_of_improvement([], [], ""), "0 of 0 scores are nan"),
        (
            lambda: statistics.probability_of_improvement([1] * 3, [1] * 2, "AAA"),
            "3 runs .* paired with 2",
        ),
        (lambda: over_layouts(np.mean, np.arange(4.0)), "over the last axis is needed"),
    ],
)
def test_an_estimate_without_a_meaning_is_refused(call, said):
    with pytest.raises(ValueError, match=said):
        call()


def test_the_bootstrap_of_a_share_of_layouts_is_about_as_wide_as_wilson_s_interval():
    found, wilson = over_layouts(partial(np.mean, axis=-1), np.arange(120) < 60), rate(60, 120)
    assert found.value == 0.5
    assert (found.low, found.high) == pytest.approx((wilson.low, wilson.high), abs=0.01)
    assert f"{Estimate(0.5, 0.25, 0.75):.0%}" == "50% [25%, 75%]"

"""Estimates against closed forms, and intervals against how often they cover what is true."""

import time
from functools import partial
from math import comb

import numpy as np
import pytest
from scipy import stats

from nmpcrl.analysis.statistics import (
    CONFIDENCE,
    Estimate,
    interquartile_mean,
    over_layouts,
    paired_p,
    performance_profile,
    probability_of_improvement,
    rate,
)

LAYOUTS = np.repeat(list("ABCDEF"), 20)  # the strata of the main table


def covered(estimates: list[Estimate], true: float) -> float:
    """Share of the intervals that hold the true value."""
    return float(np.mean([one.low <= true <= one.high for one in estimates]))


# Rates


@pytest.mark.parametrize(("held", "of"), [(0, 5), (1, 7), (60, 120), (119, 120), (4, 4)])
def test_the_interval_of_a_rate_holds_what_lies_within_two_of_its_own_deviations(held, of):
    """Wilson's bounds are the p at which (held / of - p)^2 = z^2 p (1 - p) / of."""
    estimate, z = rate(held, of), stats.norm.ppf(1 - (1 - CONFIDENCE) / 2)
    assert estimate.value == held / of
    for bound in (estimate.low, estimate.high):
        away = (held / of - bound) ** 2
        assert away == pytest.approx(z**2 * bound * (1 - bound) / of, abs=1e-12)


def test_a_rate_of_all_runs_is_not_certain():
    assert rate(4, 4).high == 1
    assert rate(3, 3).low < 0.5 < rate(4, 4).low


@pytest.mark.parametrize(("held", "of"), [(0, 0), (3, 2), (-1, 2)])
def test_what_is_not_a_rate_is_refused(held, of):
    with pytest.raises(ValueError, match=f"{held} of {of} runs"):
        rate(held, of)


def test_the_interval_of_a_rate_covers_the_mean_over_layouts_that_differ():
    rng, chances = np.random.default_rng(1), np.array([0.02, 0.1, 0.4, 0.7, 0.9, 0.98])
    held = rng.binomial(20, chances, (1000, 6)).sum(axis=1)
    assert covered([rate(int(k), 120) for k in held], chances.mean()) >= CONFIDENCE


@pytest.mark.parametrize(("gained", "lost"), [(0, 0), (4, 0), (0, 4), (3, 17), (8, 8)])
def test_pairs_that_change_go_either_way_with_the_same_chance(gained, lost):
    changed, fewer = gained + lost, min(gained, lost)
    tail = sum(comb(changed, i) for i in range(fewer + 1)) / 2**changed
    assert paired_p(gained, lost) == pytest.approx(min(1.0, 2 * tail))


# The interquartile mean


def test_the_interquartile_mean_is_the_mean_of_the_middle_half():
    scores = np.array([100.0, 3, 1, 2, 4, -50, 5, 6])
    estimate = interquartile_mean(scores, ["A"] * 8)
    assert estimate.value == np.mean([2, 3, 4, 5])
    assert estimate.low <= estimate.value <= estimate.high


def test_a_quarter_of_failures_leaves_the_interquartile_mean_finite_and_more_do_not():
    scores = np.arange(8.0)
    scores[-2:] = np.inf
    assert interquartile_mean(scores, ["A"] * 8).value == np.mean([2, 3, 4, 5])
    assert interquartile_mean(scores, ["A"] * 8).high == np.inf
    scores[-3:] = np.inf
    assert interquartile_mean(scores, ["A"] * 8).value == np.inf


@pytest.mark.weekly
@pytest.mark.slow
def test_the_interval_of_the_interquartile_mean_covers_it_about_as_often_as_it_says():
    rng, scale = np.random.default_rng(2), np.repeat([1.0, 1.1, 1.2, 1.3, 1.4, 1.5], 20)

    def drawn(runs):
        return rng.lognormal(0, 0.5, (runs, 120)) * scale

    true = float(np.median(stats.trim_mean(drawn(20_000), 0.25, axis=1)))
    estimates = [interquartile_mean(scores, LAYOUTS) for scores in drawn(60)]
    assert 0.88 <= covered(estimates, true) <= 0.99


def test_draws_stay_within_their_layout():
    """Layouts that differ, and runs within one that do not: nothing is left to chance."""
    scores = np.repeat([1.0, 2, 3, 4, 5, 6], 20)
    estimate = interquartile_mean(scores, LAYOUTS)
    assert (estimate.low, estimate.high) == (estimate.value, estimate.value)


def test_the_same_runs_give_the_same_interval():
    scores = np.random.default_rng(3).normal(size=120)
    assert interquartile_mean(scores, LAYOUTS) == interquartile_mean(scores, LAYOUTS)


def test_one_run_of_a_layout_has_a_value_and_no_interval():
    estimate = interquartile_mean(np.array([1.0, 2, 3]), ["A", "A", "B"])
    assert estimate.value == 2
    assert np.isnan([estimate.low, estimate.high]).all()


# The probability of improvement


def test_the_probability_of_improvement_is_mann_and_whitney_s_u_over_the_number_of_pairs():
    rng = np.random.default_rng(4)
    first, second = rng.integers(0, 5, (2, 30)).astype(float)
    u = stats.mannwhitneyu(second, first).statistic
    estimate = probability_of_improvement(first, second, ["A"] * 30)
    assert estimate.value == pytest.approx(u / 30**2)


def test_layouts_are_not_compared_with_each_other_and_weigh_the_same():
    first = np.array([1.0, 1, 50, 50, 50, 50])
    second = np.array([2.0, 2, 40, 40, 40, 40])  # better in B, and worse than all of A
    assert probability_of_improvement(first, second, list("AABBBB")).value == 0.5


def test_a_failure_loses_against_any_run_and_ties_with_a_failure():
    failed, whole = np.full(2, np.inf), np.full(2, 1e9)
    assert probability_of_improvement(whole, failed, ["A"] * 2).value == 1
    assert probability_of_improvement(failed, failed, ["A"] * 2).value == 0.5


@pytest.mark.weekly
@pytest.mark.slow
def test_the_interval_of_the_probability_of_improvement_covers_it_about_as_often_as_it_says():
    rng, noise = np.random.default_rng(5), 1.0
    shift = 0.5
    estimates = [
        probability_of_improvement(common + ours, common + theirs + shift, LAYOUTS)
        for common, ours, theirs in rng.normal(scale=noise, size=(40, 3, 120))
    ]
    true = stats.norm.cdf(shift / (2 * noise))  # of two runs, each of variance 2
    assert 0.88 <= covered(estimates, true) <= 1


def test_runs_without_a_partner_are_refused():
    with pytest.raises(ValueError, match="3 runs cannot be paired with 2"):
        probability_of_improvement(np.ones(3), np.ones(2), ["A"] * 3)


# The performance profile


def test_the_profile_says_which_share_of_the_runs_reaches_each_threshold():
    profile = performance_profile(np.array([0.0, 0.1, 0.1, -np.inf]), np.array([-1, 0, 0.1, 0.2]))
    assert list(profile.share) == [0.75, 0.75, 0.5, 0]
    for row in profile.itertuples():
        assert rate(int(4 * row.share), 4) == Estimate(row.share, row.low, row.high)


# All of them


@pytest.mark.parametrize(
    "estimate",
    [
        lambda scores: interquartile_mean(scores, ["A"] * len(scores)),
        lambda scores: probability_of_improvement(scores, scores, ["A"] * len(scores)),
        lambda scores: performance_profile(scores, np.zeros(1)),
    ],
)
@pytest.mark.parametrize(("scores", "said"), [([1, np.nan], "1 of 2"), ([], "0 of 0")])
def test_what_is_not_known_is_refused(estimate, scores, said):
    with pytest.raises(ValueError, match=f"{said} scores are nan"):
        estimate(np.array(scores, float))


def test_the_bootstrap_of_a_share_of_layouts_is_about_as_wide_as_wilson_s_interval():
    found, wilson = over_layouts(partial(np.mean, axis=-1), np.arange(120) < 60), rate(60, 120)
    assert found.value == 0.5
    assert (found.low, found.high) == pytest.approx((wilson.low, wilson.high), abs=0.01)


@pytest.mark.parametrize(
    ("statistic", "columns", "said"),
    [
        (np.mean, (np.zeros(2), np.zeros(3)), r"columns of \[2, 3\] layouts"),
        (np.mean, (np.zeros(0),), r"columns of \[0\] layouts"),
        (np.mean, (np.arange(4.0),), "over the last axis is needed"),
    ],
)
def test_columns_of_one_length_and_statistics_of_the_last_axis_are_needed(statistic, columns, said):
    with pytest.raises(ValueError, match=said):
        over_layouts(statistic, *columns)


def test_an_estimate_is_shown_with_its_interval():
    assert f"{Estimate(0.5, 0.25, 0.75):.0%}" == "50% [25%, 75%]"


def test_the_main_table_is_summed_up_in_a_moment():
    scores = np.random.default_rng(6).normal(size=(2, 120))
    began = time.process_time()
    probability_of_improvement(*scores, LAYOUTS)
    interquartile_mean(scores[0], LAYOUTS)
    performance_profile(scores[0], np.linspace(-1, 1, 50))
    assert time.process_time() - began < 3 * 0.3

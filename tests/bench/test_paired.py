"""The paired ratio and its interval, on times whose law is known; no clock is read here."""

import numpy as np
import pytest

from nmpcrl.bench.paired import BLOCK, LEAST, PLACEMENT, Ratio, paired_ratio, pooled

ROUNDS = 30 * BLOCK


def drawn(seed: int, ratio: float, rounds: int = ROUNDS, noise: float = 0.05):
    """Times of two that take turns: as hard as each other's step, each disturbed on its own."""
    rng = np.random.default_rng(seed)
    hard = np.exp(rng.normal(0.0, 0.5, rounds))
    one, other = np.exp(rng.normal(0.0, noise, (2, rounds)))
    return ratio * hard * one, hard * other


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("ratio", [0.5, 1.0, 3.0])
def test_the_ratio_is_found_through_steps_that_are_differently_hard(seed, ratio):
    mine, theirs = drawn(seed, ratio)
    found = paired_ratio(mine, theirs, mine, theirs)
    assert found.value == pytest.approx(ratio, rel=0.02)
    assert found.low <= ratio <= found.high
    assert found.high / found.low < 1.1
    assert found.waited == 0


def test_a_slower_machine_changes_nothing_and_long_steps_count_by_their_length():
    mine, theirs = drawn(1, 0.6)
    slow = np.where(np.arange(ROUNDS) > ROUNDS / 2, 2.0, 1.0)
    before, after = (
        paired_ratio(a, b, a, b) for a, b in ((mine, theirs), (slow * mine, slow * theirs))
    )
    assert after.value == pytest.approx(before.value, rel=0.005)
    assert before.low < after.value < before.high
    ones = np.ones(ROUNDS)
    long = np.where(np.arange(ROUNDS) % 13 == 0, 14.0, 1.0)
    found = paired_ratio(long, ones, long, ones)
    assert found.value == pytest.approx(long.mean())
    assert found.value > 1.9
    assert np.median(long / ones) == 1  # which is what a median of ratios would say
    rng = np.random.default_rng(0)
    alone = np.exp(rng.normal(0, 0.2, ROUNDS))
    alike = np.exp(np.repeat(rng.normal(0, 0.2, ROUNDS // BLOCK), BLOCK))
    ones = np.ones(ROUNDS)
    widths = [
        np.log(found.high / found.low) - 2 * np.log(1 + PLACEMENT)
        for found in (paired_ratio(one, ones, one, ones) for one in (alone, alike))
    ]
    assert widths[1] > 2 * widths[0]


@pytest.mark.slow
def test_the_interval_of_95_percent_misses_about_as_often_even_without_the_margin():
    missed = 0
    for seed in range(200):
        mine, theirs = drawn(seed, 1.0)
        found = paired_ratio(mine, theirs, mine, theirs)
        missed += not found.low * (1 + PLACEMENT) <= 1 <= found.high / (1 + PLACEMENT)
    assert 1 <= missed <= 24


@pytest.mark.parametrize(("blocks", "known"), [(LEAST - 1, False), (LEAST, True)])
def test_too_few_rounds_have_no_interval(blocks, known):
    mine, theirs = drawn(0, 1.0, blocks * BLOCK + BLOCK - 1)
    found = paired_ratio(mine, theirs, mine, theirs)
    assert np.isfinite([found.low, found.high]).all() == known
    mine, theirs = drawn(0, 0.5)  # the share of waiting is what two clocks disagree by
    assert paired_ratio(mine, theirs, 4 * mine, 4 * theirs).waited == pytest.approx(0.75)
    assert paired_ratio(mine, theirs, mine / 2, theirs / 2).waited == 0  # threads beside each other


def test_processes_that_agree_leave_no_doubt_and_their_mean_is_geometric():
    same = pooled([Ratio(0.5, 0.4, 0.6, 0.1)] * 3)
    assert (same.value, same.waited) == pytest.approx((0.5, 0.1))
    apart = pooled([Ratio(one, np.nan, np.nan, 0.0) for one in (0.5, 2.0)])
    assert apart.value == pytest.approx(1.0)


@pytest.mark.parametrize("processes", [3, 7, 20])
def test_the_interval_over_processes_holds_the_ratio_as_often_as_it_says(processes):
    rng = np.random.default_rng(processes)
    held = 0
    for _ in range(400):
        values = 0.6 * np.exp(rng.normal(0, 0.03, processes))
        found = pooled([Ratio(value, np.nan, np.nan, 0.0) for value in values])
        held += found.low <= 0.6 <= found.high
    assert held / 400 == pytest.approx(0.95, abs=0.04)

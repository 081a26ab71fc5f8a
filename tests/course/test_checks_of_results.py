"""Checks of Chapter 5: of each, two right answers that look different and three wrong ones."""

import numpy as np
import pytest

from nmpcrl.course import Unsolved
from nmpcrl.course.checks import results


def by_running_minimum(costs):
    known = np.where(np.isnan(costs), np.inf, costs)
    return (known - np.minimum.accumulate(known)).max() / known[0]


def by_loop(costs):
    lowest, rise = costs[0], 0.0
    for cost in costs:
        rise = max(rise, (np.inf if np.isnan(cost) else cost) - lowest)
        lowest = min(lowest, np.inf if np.isnan(cost) else cost)
    return rise / costs[0]


def by_merge(runs, frozen):
    both = runs.merge(frozen, on=["layout", "seed"], how="left", suffixes=("", "_frozen"))
    return both.cost / both.cost_frozen


def by_dictionary(runs, frozen):
    arm = {(row.layout, row.seed): row.cost for row in frozen.itertuples()}
    return [row.cost / arm[row.layout, row.seed] for row in runs.itertuples()]


def upside_down(runs, frozen):
    return 1 / by_merge(runs, frozen)


CHECKS = {
    results.enough: ([np.int64(4), "4.0"], [3, 5, "four"]),
    results.missing: ([2.0, "2"], [0, 5, 16]),
    results.mean: ([59 / 20, "2,95"], [1, 2, 40]),
    results.step: ([np.float32(0.831), "0,83 s"], [0.8307 / 60, 2 * 0.8307, 108.0]),
    results.fall: (["C", " c "], ["a", "b", "d"]),
    results.drawdown: (
        [by_running_minimum, by_loop],
        [
            lambda costs: by_loop(costs) * costs[0],
            lambda costs: by_loop(costs[~np.isnan(costs)]),
            lambda costs: costs.max() / costs[0] - 1,
        ],
    ),
    results.pairs: (
        [by_merge, by_dictionary],
        [upside_down, lambda runs, frozen: runs.cost / frozen.cost, lambda runs, frozen: 1.0],
    ),
}


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_right_answers_are_right_and_wrong_ones_are_met_with_a_sentence(check):
    right, wrong = CHECKS[check]
    for _ in range(3):
        for answer in right:
            assert check.__wrapped__(answer).right, answer
        for answer in wrong:
            with pytest.raises(Unsolved, match=r"\w+ .*[.?]"):
                check.__wrapped__(answer)

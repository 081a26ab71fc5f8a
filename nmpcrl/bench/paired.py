"""How many times as long as another's a learner's step takes, on a machine that others use as well.

The constants here were fixed by the reasons below, before anything was measured with them.

What is timed is the processor's work on this process, not the time that passes: a step that has to
wait for its turn is not a longer step. What work others cause is in that clock too, because they
fill the caches and slow the neighbouring core. It meets all who take turns within one round alike,
so that each round gives one ratio, its logarithm is taken, and the median of these is not moved by
the rounds in which only one of the two was disturbed. Rounds are not dropped for having been
interrupted: long steps are interrupted more often than short ones, and dropping them would favour
the short.

The interval is a percentile bootstrap over blocks of consecutive rounds (Künsch 1989), as
neighbours are not independent. Solves start from one another, and as long as the robot meets the
same constraints, a step is as hard as the one before it: some ten steps. A block has `BLOCK` = 13,
a tenth of an episode. From fewer than `LEAST` = 10 blocks no interval is taken, as a bootstrap of
so few is too narrow.

One process cannot see what is the same in all of its rounds: where code and data come to lie in
memory. It moves times by some per cent from one process to the next (Mytkowicz et al. 2009), so
the interval is widened by `PLACEMENT` = 3 % at both ends. Several processes do see it, and `pooled`
takes the interval from how far their ratios are apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from nmpcrl import Vector

BLOCK = 13  # rounds
LEAST = 10  # blocks
PLACEMENT = 0.03
IDLE = 0.05  # share of waiting on a machine with nothing else to do, at most
CONFIDENCE = 0.95
RESAMPLES = 2000
SEED = 0  # of the bootstrap: the same times give the same interval


@dataclass(frozen=True)
class Ratio:
    """A ratio of times; `low` and `high` are nan where too few rounds were timed."""

    value: float
    low: float
    high: float
    waited: float  # share of the time that passed in which the process had to wait for a processor

    def __str__(self) -> str:
        return f"{self.value:.2f} [{self.low:.2f}, {self.high:.2f}]"


def paired_ratio(
    work: Vector, reference: Vector, passed: Vector, reference_passed: Vector
) -> Ratio:
    """The median ratio of two who take turns, with its interval.

    Args:
        work: the processor's time of each round [s], shape (rounds,).
        reference: that of the other one in the same rounds.
        passed: the time that passed meanwhile [s], shape (rounds,).
        reference_passed: that of the other one.
    """
    logs = np.log(work / reference)
    low, high = _interval(logs)
    ran = (work.sum() + reference.sum()) / (passed.sum() + reference_passed.sum())
    return Ratio(
        float(np.exp(np.median(logs))),
        float(np.exp(low)) / (1 + PLACEMENT),
        float(np.exp(high)) * (1 + PLACEMENT),
        max(0.0, 1 - float(ran)),
    )


def pooled(ratios: Sequence[Ratio]) -> Ratio:
    """The ratio that several processes found: geometric mean, with Student's interval of its log.

    Args:
        ratios: one a process, two or more.
    """
    logs = np.log([one.value for one in ratios])
    middle, width = logs.mean(), stats.t.ppf((1 + CONFIDENCE) / 2, len(logs) - 1) * stats.sem(logs)
    value, low, high = np.exp([middle, middle - width, middle + width]).tolist()
    return Ratio(value, low, high, waited=float(np.mean([one.waited for one in ratios])))


def _interval(logs: Vector) -> tuple[float, float]:
    """Of the median, by drawing blocks; a last block that is not whole does not count."""
    blocks = logs[: len(logs) // BLOCK * BLOCK].reshape(-1, BLOCK)
    if len(blocks) < LEAST:
        return np.nan, np.nan
    drawn = np.random.default_rng(SEED).integers(len(blocks), size=(RESAMPLES, len(blocks)))
    medians = np.median(blocks[drawn].reshape(RESAMPLES, -1), axis=1)
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(medians, (tail, 1 - tail))
    return float(low), float(high)

"""How many times as long as another's a learner's step takes, on a machine that others use as well.

The constants here were fixed by the reasons below, before anything was measured with them.

What is timed is the processor's work on this process, not the time that passes: a step that has to
wait for its turn is not a longer step. What work others cause is in that clock too, because they
fill the caches and slow the neighbouring core. It meets all who take turns within one round alike.

The ratio is that of the sums over the same rounds. What a run takes is the sum of its steps, long
ones included, and a table of hours, such as the paper's, compares sums: a median of ratios, or a
ratio of medians, is another number where the steps of one learner scatter more. It is the only
estimator: verdict, table, bar and sentence have this ratio, and times beside it are means, so that
they divide to it. Rounds are not dropped for having been interrupted: long steps are interrupted
more often than short ones, and dropping them would favour the short.

The interval is a percentile bootstrap over blocks of consecutive rounds (Künsch 1989), as
neighbours are not independent. Solves start from one another, and as long as the robot meets the
same constraints, a step is as hard as the one before it: some ten steps. And the machine is as fast
in one step as in the next: those who are compared take `TURN` = 20 steps at a time, so that a slow
moment may fall to one of them. A block has `BLOCK` = two turns. From fewer than `LEAST` = 10 blocks
no interval is taken, as a bootstrap of so few is too narrow.

One process cannot see what is the same in all of its rounds: where code and data come to lie in
memory. It moves times by some per cent from one process to the next (Mytkowicz et al. 2009), so
the interval is widened by `PLACEMENT` = 3 % at both ends. Several processes do see it, and `pooled`
takes the interval from how far their ratios are apart. Nor can processes that are timed within some
minutes see what is the same in all of these: a measurement that is to be published is repeated, and
`pooled` is asked once more, of the repetitions. How many of their own intervals hold what they come
to together is the coverage that was measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from nmpcrl import Vector

TURN = 20  # steps that a learner takes at a time: then the caches hold what its own loop leaves
BLOCK = 2 * TURN  # rounds
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

    def __format__(self, form: str) -> str:
        """The ratio alone in a given form; without one, with its interval."""
        return format(self.value, form) if form else str(self)


def paired_ratio(
    work: Vector, reference: Vector, passed: Vector, reference_passed: Vector
) -> Ratio:
    """The ratio of the times of two who take turns, with its interval.

    Args:
        work: the processor's time of each round [s], shape (rounds,).
        reference: that of the other one in the same rounds.
        passed: the time that passed meanwhile [s], shape (rounds,).
        reference_passed: that of the other one.
    """
    low, high = _interval(work, reference)
    ran = (work.sum() + reference.sum()) / (passed.sum() + reference_passed.sum())
    return Ratio(
        float(work.sum() / reference.sum()),
        low / (1 + PLACEMENT),
        high * (1 + PLACEMENT),
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


def _interval(work: Vector, reference: Vector) -> tuple[float, float]:
    """Of the ratio, by drawing blocks; a last block that is not whole does not count."""
    whole = len(work) // BLOCK * BLOCK
    mine, theirs = (one[:whole].reshape(-1, BLOCK).sum(axis=1) for one in (work, reference))
    if len(mine) < LEAST:
        return np.nan, np.nan
    drawn = np.random.default_rng(SEED).integers(len(mine), size=(RESAMPLES, len(mine)))
    ratios = mine[drawn].sum(axis=1) / theirs[drawn].sum(axis=1)
    tail = (1 - CONFIDENCE) / 2
    low, high = np.quantile(ratios, (tail, 1 - tail))
    return float(low), float(high)

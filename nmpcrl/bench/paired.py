"""The ratio of the times of two learners' steps, on a machine that others use as well.

The constants here were fixed by the reasons below, before anything was measured with them.

- What is timed is the processor's work on this process: a step that waits for its turn is not a
  longer step. Other programs fill the caches and slow the neighbouring core, which meets all who
  take turns within one round alike.
- The ratio is that of the sums over the same rounds, since what a run takes is the sum of its
  steps. Verdict, table, bar and sentence have this ratio, and times beside it are means, so that
  they divide to it. Interrupted rounds are kept: long steps are interrupted more often than short
  ones, and dropping them would favour the short.
- The interval is a percentile bootstrap over blocks of consecutive rounds (Künsch 1989), for
  neighbours are not independent: a step is as hard, and the machine as fast, as in the step before.
- Where code and data come to lie in memory is the same in all rounds of a process, and moves times
  by some per cent from process to process (Mytkowicz et al. 2009): the interval is wider by
  `PLACEMENT` at both ends. `pooled` sees it: its interval is from how far the ratios of several
  processes, or of repetitions at other times, are apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from nmpcrl import Vector

TURN = 20  # steps that a learner takes at a time: then the caches hold what its own loop leaves
BLOCK = 2 * TURN  # rounds
LEAST = 10  # blocks, for a bootstrap of fewer is too narrow
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

    `work` and `reference` are the processor's times of each round [s], shape (rounds,); `passed`
    and `reference_passed` the times that passed meanwhile.
    """
    low, high = _interval(work, reference)
    ran = (work.sum() + reference.sum()) / (passed.sum() + reference_passed.sum())
    value, waited = float(work.sum() / reference.sum()), max(0.0, 1 - float(ran))
    return Ratio(value, low / (1 + PLACEMENT), high * (1 + PLACEMENT), waited)


def pooled(ratios: Sequence[Ratio]) -> Ratio:
    """The geometric mean of ratios, one a process, with Student's interval of its log."""
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

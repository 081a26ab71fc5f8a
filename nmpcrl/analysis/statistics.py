"""Estimates from a sample of runs, with intervals of 95 %.

Scores have the interquartile mean and the probability of improvement of Agarwal et al. (2021), with
a percentile bootstrap that draws within each stratum, here a layout: the interval is one over runs
in these layouts. Rates have Wilson's (1927) interval. A failed rollout has infinite cost; a score
that is nan is refused.
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from nmpcrl import Vector

CONFIDENCE = 0.95
ENDS = ((1 - CONFIDENCE) / 2, 1 - (1 - CONFIDENCE) / 2)  # quantiles at the ends of an interval
RESAMPLES = 2000  # of the bootstrap
SEED = 0  # of the bootstrap: the same runs give the same interval


@dataclass(frozen=True)
class Estimate:
    """A value and its interval; the bounds are nan where there are too few runs."""

    value: float
    low: float
    high: float

    def __format__(self, form: str) -> str:
        low, high = format(self.low, form), format(self.high, form)
        return f"{format(self.value, form)} [{low}, {high}]"


def count(yes: pd.Series) -> tuple[int, int]:
    """The number of answers that are yes, and of all."""
    return int(yes.sum()), len(yes)


@cache
def rate(yes: int, of: int) -> Estimate:
    """The share of independent runs that answer yes, with Wilson's interval.

    For several layouts the interval is too wide rather than too narrow: a fixed number of runs in
    each varies less than as many runs drawn from the mixture (Hoeffding 1956).
    """
    if not 0 <= yes <= of or not of:
        raise ValueError(f"{yes} of {of} runs is not a rate")
    interval = stats.binomtest(yes, of).proportion_ci(CONFIDENCE, method="wilson")
    return Estimate(yes / of, float(interval.low), float(interval.high))


def paired_p(gained: int, lost: int) -> float:
    """McNemar's exact two-sided p of the pairs whose answer changed; 1 if no pair changed.

    `gained` pairs answer yes only with the change, `lost` ones only without it.
    """
    changed = gained + lost
    return float(stats.binomtest(gained, changed).pvalue) if changed else 1.0


def interquartile_mean(scores: Vector, strata: Sequence[Hashable]) -> Estimate:
    """Mean of the middle half of the scores; infinite if more than a quarter of the runs failed."""
    known = _known(scores)

    def middle(*drawn: Vector) -> Any:
        return stats.trim_mean(known[np.concatenate(drawn, axis=-1)], 0.25, axis=-1)

    return _bootstrapped(middle, strata)


def probability_of_improvement(
    first: Vector, second: Vector, strata: Sequence[Hashable]
) -> Estimate:
    """Probability that a run of the first learner costs less than one of the second.

    Within a layout every run of the first is compared with every run of the second; a tie counts
    one half (Mann and Whitney's U). Layouts have equal weights. The arguments have one entry a pair
    of runs of one layout and seed, which have the same noise: the bootstrap draws them together.
    """
    ours, theirs = _known(first), _known(second)
    if len(ours) != len(theirs):
        raise ValueError(f"{len(ours)} runs cannot be paired with {len(theirs)}")

    def better(*drawn: Vector) -> Any:
        wins = []
        for pairs in drawn:
            one, other = ours[pairs][..., :, None], theirs[pairs][..., None, :]
            wins.append(((one < other) + 0.5 * (one == other)).mean(axis=(-2, -1)))
        return np.mean(wins, axis=0)

    return _bootstrapped(better, strata)


def over_layouts(statistic: Callable[..., Any], *columns: Vector) -> Estimate:
    """A statistic over the last axis of columns of shape (layouts,), and its percentile interval.

    Draws in which it is nan or infinite do not count.
    """
    rows = np.stack(columns)
    units, rng = rows.shape[1], np.random.default_rng(SEED)
    drawn = np.asarray(statistic(*rows[:, rng.integers(units, size=(RESAMPLES, units))]))
    if drawn.shape != (RESAMPLES,):
        raise ValueError(f"a statistic of shape {drawn.shape}: one over the last axis is needed")
    known = drawn[np.isfinite(drawn)]
    low, high = np.quantile(known, ENDS) if known.size else (np.nan, np.nan)
    return Estimate(float(statistic(*rows)), float(low), float(high))


def _known(scores: Vector) -> Vector:
    values = np.asarray(scores, float)
    unknown = int(np.isnan(values).sum())
    if unknown or not values.size:
        raise ValueError(f"{unknown} of {values.size} scores are nan; a failed run scores infinity")
    return values


def _bootstrapped(statistic: Callable[..., Any], strata: Sequence[Hashable]) -> Estimate:
    """The statistic of all runs, and its percentile interval under draws within each stratum.

    It is of the indices of the runs of each stratum; with a single run in one the bounds are nan.
    """
    codes, names = pd.factorize(pd.Series(list(strata)))
    members = [np.flatnonzero(codes == code) for code in range(len(names))]
    value = float(statistic(*members))
    if min(map(len, members)) < 2:
        return Estimate(value, np.nan, np.nan)
    with np.errstate(invalid="ignore"):  # SciPy's own quantiles interpolate between infinities
        drawn = stats.bootstrap(
            members,
            lambda *samples, axis: statistic(*samples),
            n_resamples=RESAMPLES,
            method="percentile",
            vectorized=True,
            rng=np.random.default_rng(SEED),
        ).bootstrap_distribution
    low, high = np.quantile(drawn, ENDS, method="inverted_cdf")
    return Estimate(value, float(low), float(high))

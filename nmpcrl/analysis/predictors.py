"""How well a number that is known beforehand tells where learning succeeds.

A predictor is a logistic regression of one measure, fitted on some layouts and scored on others: by
the area under the ROC curve, which asks whether successes rank above failures, and by the Brier
score, which asks for the probabilities themselves. The bootstrap draws layouts, never runs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import optimize, stats

from nmpcrl import Vector
from nmpcrl.analysis.statistics import CONFIDENCE, RESAMPLES, SEED, Estimate


@dataclass(frozen=True)
class Logistic:
    """P(success) = 1 / (1 + exp(-(intercept + slope z))), z being the standardised measure."""

    centre: float
    scale: float
    intercept: float
    slope: float

    def __call__(self, measure: Vector) -> Vector:
        """The probability of success in each layout, shape (layouts,)."""
        z = (np.asarray(measure, float) - self.centre) / self.scale
        result: Vector = 1 / (1 + np.exp(-(self.intercept + self.slope * z)))
        return result


def fit(measure: Vector, success: Vector, ridge: float) -> Logistic:
    """Least log loss with `ridge` times half of the squared slope added, which keeps it finite.

    Args:
        measure: one a layout, finite.
        success: whether learning succeeded there.
        ridge: above 0.

    Raises:
        ValueError: a measure is not finite.
    """
    x, y = np.asarray(measure, float), np.asarray(success, bool)
    if not np.isfinite(x).all():
        raise ValueError(f"{(~np.isfinite(x)).sum()} of {x.size} measures are not finite")
    centre, scale = float(x.mean()), float(x.std()) or 1.0
    z, sign = (x - centre) / scale, np.where(y, 1.0, -1.0)

    def loss(b: Vector) -> float:
        return float(np.logaddexp(0, -sign * (b[0] + b[1] * z)).sum() + ridge * b[1] ** 2 / 2)

    share = (y.sum() + 0.5) / (y.size + 1)  # finite where all succeed, too
    start = np.array([np.log(share / (1 - share)), 0.0])
    if y.all() or not y.any():
        return Logistic(centre, scale, float(start[0]), 0.0)
    found = optimize.minimize(loss, start, method="BFGS").x
    return Logistic(centre, scale, float(found[0]), float(found[1]))


def auc(score: Vector, success: Vector) -> Any:
    """Probability that a success scores above a failure, a tie counting one half.

    nan where all layouts succeed, or none. Layouts are the last axis, as they are of `brier`.
    """
    y = np.asarray(success, bool)
    won, lost = y.sum(axis=-1), (~y).sum(axis=-1)
    ranks = np.where(y, stats.rankdata(score, axis=-1), 0).sum(axis=-1)
    with np.errstate(invalid="ignore"):  # 0 / 0
        return (ranks - won * (won + 1) / 2) / (won * lost)


def brier(probability: Vector, success: Vector) -> Any:
    """Mean squared difference of probability and outcome, over the last axis: 0 is perfect."""
    return np.mean((np.asarray(probability) - np.asarray(success, float)) ** 2, axis=-1)


def over_layouts(
    statistic: Callable[..., Any], *columns: Vector, resamples: int = RESAMPLES
) -> Estimate:
    """A statistic of columns with one row a layout, and its percentile interval.

    A draw in which the statistic is nan, such as one without a failure, does not count.

    Args:
        statistic: of the columns, over their last axis.
        columns: each of shape (layouts,).
        resamples: of the bootstrap.

    Raises:
        ValueError: there is no layout, the columns differ in length, or the statistic is over
            all axes.
    """
    layouts = {len(one) for one in columns}
    if len(layouts) != 1 or not min(layouts):
        raise ValueError(f"columns of {sorted(layouts)} layouts: one length above 0 is needed")
    (count,), rng = layouts, np.random.default_rng(SEED)
    arrays = [np.asarray(one) for one in columns]
    value = statistic(*arrays)
    chosen = rng.integers(count, size=(resamples, count))
    drawn = np.asarray(statistic(*(one[chosen] for one in arrays)))
    if drawn.shape != (resamples,):
        raise ValueError(f"a statistic of shape {drawn.shape}: one over the last axis is needed")
    known = drawn[np.isfinite(drawn)]
    tail = (1 - CONFIDENCE) / 2
    bounds = np.quantile(known, (tail, 1 - tail)) if known.size else (np.nan, np.nan)
    return Estimate(float(value), float(bounds[0]), float(bounds[1]))

"""How well a number that is known before training predicts where learning succeeds.

A predictor is a logistic regression of one measure, fitted on some layouts and scored on others: by
the area under the ROC curve, which asks whether successes rank above failures, and by the Brier
score, which asks for the probabilities themselves. The bootstrap draws layouts, never runs.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from scipy import optimize, stats

from nmpcrl import Vector
from nmpcrl.analysis.statistics import over_layouts
from nmpcrl.studies.difficulty import MEASURES, PILOT

RIDGE = 1.0  # penalty of the logistic regression, of the squared slope of the standardised measure
RESAMPLES = 2000  # of the bootstrap over layouts


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


def fit(measure: Vector, success: Vector, ridge: float = RIDGE) -> Logistic:
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


def predictor_scores(difficulty: pd.DataFrame, tuned: pd.Series, judged: pd.Series) -> pd.DataFrame:
    """Each measure as a predictor of success, fitted on some layouts and scored on others.

    Args:
        difficulty: columns `MEASURES`, a row a layout.
        tuned: whether learning succeeds, by layout, for the fit.
        judged: the same, by layout, for the scores.

    Returns:
        A row a measure: slope (of the standardised measure), auc and brier, each an `Estimate`,
        and ahead, by how much the area of `PILOT` is larger (an `Estimate`; 0 for itself).
    """
    y = judged.to_numpy(bool)
    fits = {
        name: fit(difficulty[name][tuned.index].to_numpy(float), tuned.to_numpy(bool))
        for name in MEASURES
    }
    probability = {name: one(difficulty.loc[judged.index, name]) for name, one in fits.items()}
    drawn = partial(over_layouts, resamples=RESAMPLES)
    return pd.DataFrame(
        {
            name: {
                "slope": fits[name].slope,
                "auc": drawn(auc, probability[name], y),
                "brier": drawn(brier, probability[name], y),
                "ahead": drawn(_ahead, probability[PILOT], probability[name], y),
            }
            for name in MEASURES
        }
    ).T


def _ahead(first: Vector, second: Vector, success: Vector) -> Any:
    return auc(first, success) - auc(second, success)

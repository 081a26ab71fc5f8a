"""How well a number that is known before training predicts where learning succeeds.

A predictor is a logistic regression of one measure, fitted on some layouts and scored on others: by
the area under the ROC curve and by the Brier score. The bootstrap draws layouts.
"""

from typing import Any

import numpy as np
import pandas as pd
from scipy import optimize, stats

from nmpcrl import Vector
from nmpcrl.analysis.statistics import over_layouts
from nmpcrl.studies.difficulty import MEASURES, PILOT

RIDGE = 1.0  # penalty of the logistic regression, of the squared slope of the standardised measure


def predicted(measure: Vector, success: Vector, asked: Vector) -> tuple[float, Vector]:
    """The slope of a logistic regression, and P(success) = 1 / (1 + exp(-(intercept + slope z))).

    It is fitted to `measure` and `success`, one a layout; the probabilities are those where the
    measure is `asked`. z is the measure, standardised. `RIDGE` times half of the squared slope is
    added to the log loss: the slope stays finite where a measure separates the two outcomes.
    """
    x, sign = np.asarray(measure, float), np.where(success, 1.0, -1.0)
    if not np.isfinite(x).all():
        raise ValueError(f"{(~np.isfinite(x)).sum()} of {x.size} measures are not finite")
    centre, scale = x.mean(), x.std() or 1.0
    z = (x - centre) / scale

    def loss(b: Vector) -> float:
        return float(np.logaddexp(0, -sign * (b[0] + b[1] * z)).sum() + RIDGE * b[1] ** 2 / 2)

    share = ((sign > 0).sum() + 0.5) / (x.size + 1)  # finite where all succeed, too
    start = np.array([np.log(share / (1 - share)), 0.0])
    intercept, slope = optimize.minimize(loss, start, method="BFGS").x
    return float(slope), 1 / (1 + np.exp(-(intercept + slope * (asked - centre) / scale)))


def auc(score: Vector, success: Vector) -> Any:
    """Probability that a success scores above a failure, over the last axis; a tie counts one half.

    nan where all layouts succeed, or none.
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
    """Each measure as a predictor of success, fitted on layouts `tuned` and scored on `judged`.

    `difficulty` has the columns `MEASURES` and a row a layout. A row a measure: slope (of the
    standardised measure), auc and brier, each an `Estimate`, and ahead, by how much the area of
    `PILOT` is larger (an `Estimate`; 0 for itself).
    """
    known, asked, y = difficulty.loc[tuned.index], difficulty.loc[judged.index], judged.to_numpy()
    found = {
        name: predicted(known[name].to_numpy(), tuned.to_numpy(), asked[name].to_numpy())
        for name in MEASURES
    }
    rows = {
        name: {
            "slope": slope,
            "auc": over_layouts(auc, p, y),
            "brier": over_layouts(brier, p, y),
            "ahead": over_layouts(
                lambda pilot, p, y: auc(pilot, y) - auc(p, y), found[PILOT][1], p, y
            ),
        }
        for name, (slope, p) in found.items()
    }
    return pd.DataFrame.from_dict(rows, orient="index")

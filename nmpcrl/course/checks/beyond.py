"""The exercises of Chapter 7."""

from typing import Any

import numpy as np

from nmpcrl.course import Outcome, exercise, number
from nmpcrl.learning.updates import OVERSHOOT, curvature_correction


@exercise
def correction(answer: Any) -> Outcome:
    """h for Q = theta^2 x at theta = 2, x = 1, delta = 1 and w = 0.1."""
    phi, hessian, w = 2 * 2.0, 2.0, np.array([0.1])
    h = curvature_correction(1.0, np.array([phi]), w, hessian * w)
    return number(
        answer,
        float(h[0]),
        tolerance=0.01,
        mistakes={
            0.2: "phi w is not small here: delta - phi w stands in the first factor.",
            1.2: "The Hessian is multiplied by w.",
            0.24: "The Hessian of theta^2 x in theta is 2 x, whatever theta is.",
        },
    )


@exercise
def fast(answer: Any) -> Outcome:
    """The largest beta with which beta |phi|^2 does not overshoot, at the largest |phi|^2."""
    largest = 4 * 3.8e6
    return number(
        answer,
        OVERSHOOT / largest,
        tolerance=0.05,
        mistakes={
            OVERSHOOT / 3.8e6: "It has to hold at the end, too, where the norm is larger.",
            1 / largest: "At most 2, not 1: a step of 2 still does not grow.",
            OVERSHOOT / (4 * largest): "The squared norm grows fourfold, not the norm.",
        },
    )


@exercise
def share(answer: Any) -> Outcome:
    """What was gained over what could be gained."""
    initial, best, final = 4000.0, 3600.0, 3700.0
    return number(
        answer,
        (initial - final) / (initial - best),
        tolerance=0.01,
        mistakes={
            (initial - final) / initial: "That is the share of the cost, not of what is possible.",
            (final - best) / (initial - best): "That is what is left to gain.",
        },
    )

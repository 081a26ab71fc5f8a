"""The exercises of Chapter 7."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.learning.updates import (
    auxiliary_step,
    curvature_correction,
    gradient_td_step,
)


def correction(answer: Any) -> Outcome:
    """h for Q = theta^2 x at theta = 2, x = 1 and delta = 1."""
    w = 0.1
    phi, hessian, along = 2 * 2.0, 2.0, np.array([w])
    h = float(curvature_correction(1.0, np.array([phi]), along, hessian * along)[0])
    return number(
        answer,
        h,
        tolerance=0.01,
        mistakes={
            hessian * w: "phi w is not small here: delta - phi w stands in the first factor.",
            h / w: "The Hessian is multiplied by w.",
            2 * h: "The Hessian of theta^2 x in theta is 2 x, whatever theta is.",
            h / 2: "The second derivative of theta^2 x is 2 x, not x.",
        },
    )


def matched(answer: Any) -> Outcome:
    """What a control with the same lengths and other directions rules out."""
    return choice(
        answer,
        "b",
        {
            "a": "The control does not descend that error, and would do as well.",
            "b": "the direction was not needed, since the control lacks it and does as well.",
            "c": "Different directions may end at the same cost.",
            "d": "The control takes shorter steps where GES does, and not everywhere.",
        },
    )


def tdc(answer: Any) -> Outcome:
    """One update of exact TDC with random features and a random symmetric Hessian."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        vectors = dict(zip(("theta", "w", "phi", "phi_next"), rng.normal(size=(4, 3)), strict=True))
        half = rng.normal(size=(3, 3))
        numbers = {"delta": float(rng.normal()), "gamma": float(rng.uniform(0.5, 1))}
        steps = {"alpha": float(rng.uniform(0.1, 1)), "beta": float(rng.uniform(0.1, 1))}
        return {**vectors, **numbers, **steps, "hessian": half + half.T}

    def step(
        theta: Vector,
        w: Vector,
        delta: float,
        phi: Vector,
        phi_next: Vector,
        *,
        hessian: Vector,
        alpha: float,
        beta: float,
        gamma: float,
        sign: float = -1.0,
        early: bool = False,
    ) -> tuple[Vector, Vector]:
        after = auxiliary_step(w, delta, phi, beta)
        used = after if early else w
        h = curvature_correction(delta, phi, used, hessian @ used)
        moved = gradient_td_step(theta, used, delta, phi, phi_next, alpha=alpha, gamma=gamma)
        return moved + sign * alpha * h, after

    return function(
        answer,
        step,
        draw,
        mistakes={
            "h is subtracted, as Eq. (7.2) has it.": lambda **given: step(**given, sign=1.0),
            "That is GES: h is missing.": lambda **given: step(**given, sign=0.0),
            "theta has to move with the old w.": lambda **given: step(**given, early=True),
        },
    )


def product(answer: Any) -> Outcome:
    """Gradients of random quartics, and vectors of any length, zero among them."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        half = rng.normal(size=(4, 4))
        length = rng.choice([0.0, 0.2, 1.0, 5.0])
        return {
            "features": partial(_features, half + half.T, rng.normal(size=4)),
            "theta": rng.normal(size=4),
            "w": length * rng.normal(size=4),
        }

    def right(features: Callable[[Vector], Vector], theta: Vector, w: Vector) -> Any:
        ahead, behind = (features(theta + size * w) for size in (1e-5, -1e-5))
        return (ahead - behind) / 2e-5

    return function(answer, right, draw, tolerance=1e-4)


def _features(matrix: Vector, cubic: Vector, theta: Vector) -> Vector:
    """The gradient of a quartic; it bends differently in each component."""
    return matrix @ theta + cubic * theta**3

"""The exercises of Chapter 9."""

from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.course.checks.precision import to_digits


def factor(answer: Any) -> Outcome:
    """What a difference is multiplied by in each step, from 1e-10 to 1e-3 in 100 steps."""
    grown = 10 ** (7 / 100)
    return number(
        answer,
        grown,
        tolerance=to_digits(grown, 3),
        mistakes={
            7 / 100: "That is the exponent of ten, not the factor.",
            1e5: "The factors of 100 steps are multiplied, not added.",
            10 ** (3 / 100): "From 1e-10 to 1e-3 it is seven powers of ten.",
        },
    )


def single(answer: Any) -> Outcome:
    """What a stored result of a single seed can promise."""
    return choice(
        answer,
        "c",
        {
            "a": "The solver is right to its tolerance, and that is what the seed magnifies.",
            "b": "A tighter tolerance delays the difference by some steps, and no more.",
            "c": "the distribution is what both agree on, within its interval.",
            "d": "The seed is the same in both; the last digits of a solve are not.",
        },
    )


def gain(answer: Any) -> Outcome:
    """One step of Riccati's recursion with random matrices: K, and then P."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        n, m = int(rng.integers(2, 4)), int(rng.integers(1, 3))
        half, last = rng.normal(size=(n, n)), rng.normal(size=(n, n))
        return {
            "A": rng.normal(size=(n, n)),
            "B": rng.normal(size=(n, m)),
            "Q": half @ half.T,
            "R": np.diag(rng.uniform(0.5, 2, m)),
            "P": last @ last.T,
            "gamma": float(rng.uniform(0.5, 0.95)),
        }

    return function(
        answer,
        riccati_step,
        draw,
        mistakes={
            "What comes later is discounted by gamma.": lambda **one: riccati_step(
                **one | {"gamma": 1.0}
            ),
            "u = -K x: the closed loop is A - B K.": lambda **one: riccati_step(**one, sign=1.0),
        },
    )


def riccati_step(
    A: Matrix, B: Matrix, Q: Matrix, R: Matrix, P: Matrix, gamma: float, sign: float = -1.0
) -> tuple[Matrix, Matrix]:
    """K and P of one stage earlier."""
    K: Any = np.linalg.solve(R + gamma * B.T @ P @ B, gamma * B.T @ P @ A)
    closed = A + sign * B @ K
    return K, Q + K.T @ R @ K + gamma * closed.T @ P @ closed


def newton(answer: Any) -> Outcome:
    """A regularised step of Gauss and Newton of a batch, with its mean statistics."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        count = int(rng.integers(2, 9))
        return {
            "theta": rng.normal(size=4),
            "deltas": rng.normal(size=count),
            "phis": rng.normal(size=(count, 4)),
            "alpha": float(rng.uniform(0.01, 0.5)),
            "ridge": float(rng.uniform(1e-3, 0.1)),
        }

    return function(
        answer,
        batch_step,
        draw,
        mistakes={
            "The ridge is added to the mean, not to the sum.": lambda **one: batch_step(
                **one | {"ridge": one["ridge"] / len(one["deltas"])}
            ),
            "theta moves with delta phi: a lower error, not a larger one.": lambda **one: (
                batch_step(**one | {"alpha": -one["alpha"]})
            ),
        },
    )


def batch_step(theta: Vector, deltas: Vector, phis: Matrix, alpha: float, ridge: float) -> Vector:
    """theta + alpha (mean(phi phi') + ridge)^-1 mean(delta phi)."""
    hessian = phis.T @ phis / len(deltas) + ridge * np.eye(theta.size)
    moved: Vector = theta + alpha * np.linalg.solve(hessian, deltas @ phis / len(deltas))
    return moved


def clipped(answer: Any) -> Outcome:
    """A semi-gradient step that removes at most the share kappa of its TD error."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        phi = rng.normal(size=4)
        return {
            "theta": rng.normal(size=4),
            "delta": float(rng.normal()),
            "phi": phi,
            "alpha": float(rng.uniform(0.1, 2) / (phi @ phi)),
            "kappa": float(rng.uniform(0.2, 1)),
        }

    return function(
        answer,
        clipped_step,
        draw,
        mistakes={
            "It is the square of the length of phi that kappa is divided by.": lambda **one: (
                clipped_step(**one | {"kappa": one["kappa"] * np.linalg.norm(one["phi"])})
            ),
            "The step is shortened: the smaller of the two.": lambda **one: clipped_step(
                **one, choose=max
            ),
            "theta moves with delta phi: a lower error, not a larger one.": lambda **one: (
                clipped_step(**one | {"delta": -one["delta"]})
            ),
        },
    )


def clipped_step(
    theta: Vector, delta: float, phi: Vector, alpha: float, kappa: float, choose: Any = min
) -> Vector:
    """theta + min(alpha, kappa / |phi|^2) delta phi."""
    moved: Vector = theta + choose(alpha, kappa / (phi @ phi)) * delta * phi
    return moved

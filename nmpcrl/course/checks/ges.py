"""The exercises of Chapter 4."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.two_state import Chain, expected_matrix
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.learning.learners import semi_gradient
from nmpcrl.learning.updates import auxiliary_step, curvature_correction, gradient_td_step


def factor(answer: Any) -> Outcome:
    """By which one expected semi-gradient step multiplies theta."""
    gamma = 0.4
    chain, step = Chain(gamma=gamma), 0.1
    return number(
        answer,
        float(expected_matrix(chain, semi_gradient(step))[0, 0]),
        tolerance=1e-3,
        mistakes={
            step * (2 * gamma - 1): "That is by how much theta changes; by which factor is it "
            "multiplied?",
            1 - step * (2 * gamma - 1): "Look at the sign of 2 gamma - 1.",
            1 + step * (chain.gamma - 1): "The value of the second state is 2 theta.",
        },
    )


def diagnosis(answer: Any) -> Outcome:
    """What two numbers of a run of ES say of its divergence."""
    return choice(
        answer,
        "b",
        {
            "a": "A step overshoots above 2, and none here was above 0.5.",
            "b": "a step there moves its target farther than its value; the states that follow, "
            "where such a step would be taken back, are not updated.",
            "c": "ES has no w, so there is no term to be dropped.",
            "d": "The baseline meets the same noise, and its theta stays where it is.",
        },
    )


def _transition(rng: np.random.Generator) -> dict[str, Any]:
    d = int(rng.integers(2, 6))
    vectors = {name: rng.normal(size=d) for name in ("theta", "w", "phi", "phi_next")}
    return vectors | {"alpha": float(rng.uniform(0.01, 0.1)), "gamma": float(rng.uniform(0.5, 1))}


def gtd2_step(answer: Any) -> Outcome:
    """GTD2 (Sutton et al. 2009): the first expression of Eq. (4.4), sampled."""
    return function(
        answer,
        lambda theta, w, phi, phi_next, alpha, gamma: (
            theta + alpha * (phi - gamma * phi_next) * (phi @ w)
        ),
        _transition,
        mistakes={
            "It goes up: the direction is phi - gamma phi_next, and not the other way round.": (
                lambda theta, w, phi, phi_next, alpha, gamma: (
                    theta - alpha * (phi - gamma * phi_next) * (phi @ w)
                )
            ),
            "w predicts the TD error from phi, and not from phi - gamma phi_next: which of the "
            "two stands beside w in the first expression of Eq. (4.4)?": (
                lambda theta, w, phi, phi_next, alpha, gamma: (
                    theta + alpha * phi * ((phi - gamma * phi_next) @ w)
                )
            ),
            "That is GES with a TD error of 0: only the correction.": (
                lambda theta, w, phi, phi_next, alpha, gamma: gradient_td_step(
                    theta, w, 0.0, phi, phi_next, alpha=alpha, gamma=gamma
                )
            ),
        },
    )


def direction(answer: Any) -> Outcome:
    """Half the negative gradient of the mean-square projected Bellman error of a batch."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        d = int(rng.integers(2, 5))
        phi, phi_next = rng.normal(size=(2, 30, d))
        return {"phi": phi, "phi_next": phi_next, "delta": rng.normal(3, 2, 30), "gamma": 0.97}

    def of(phi: Matrix, phi_next: Matrix, delta: Vector, gamma: float, *, swap: bool) -> Vector:
        mean = delta @ phi / len(delta)
        w = np.linalg.solve(phi.T @ phi / len(delta), mean)
        cross = phi_next.T @ phi / len(delta)
        result: Vector = mean - gamma * (cross.T if swap else cross) @ w
        return result

    return function(
        answer,
        lambda **case: of(**case, swap=False),
        draw,
        mistakes={
            "The product of phi_next and phi' is still transposed: with one feature that is the "
            "same, with two it is not.": lambda **case: of(**case, swap=True),
            "The correction is gone: that is the direction of ES.": (
                lambda phi, phi_next, delta, gamma: delta @ phi / len(delta)
            ),
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
            "h is subtracted, as Eq. (4.10) has it.": lambda **given: step(**given, sign=1.0),
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

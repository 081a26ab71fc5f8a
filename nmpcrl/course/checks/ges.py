"""The exercises of Chapter 4."""

from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.two_state import Chain, expected_matrix
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.learning.learners import semi_gradient
from nmpcrl.learning.updates import gradient_td_step


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


def ratio(answer: Any) -> Outcome:
    """Where the trace of the matrix changes its sign, for a tiny alpha."""
    gamma = 0.9
    return number(
        answer,
        2 * gamma - 1,
        mistakes={
            1.0: "A ratio of 1 is enough, but it is not the least one.",
            gamma: "The next value is 2 theta: 2 gamma, minus 1 for the present one.",
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
            "d": "The frozen arm meets the same noise, and its theta stays where it is.",
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

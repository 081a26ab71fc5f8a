"""The exercises of Chapter 4."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.two_state import Chain, expected_matrix
from nmpcrl.course import Outcome, choice, exercise, function, number, varied
from nmpcrl.course.checks.precision import to_digits
from nmpcrl.learning.learners import semi_gradient
from nmpcrl.learning.updates import curvature_correction, gradient_td_step
from nmpcrl.study import paper


@varied(gamma=(0.1, 0.35, 0.01))
@exercise
def factor(answer: Any, *, gamma: float = 0.4) -> Outcome:
    """By which one expected semi-gradient step multiplies theta."""
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


@varied(gamma=(0.6, 0.88, 0.02))
@exercise
def ratio(answer: Any, *, gamma: float = 0.9) -> Outcome:
    """Where the trace of the matrix changes its sign, for a tiny alpha."""
    return number(
        answer,
        2 * gamma - 1,
        mistakes={
            1.0: "A ratio of 1 is enough, but it is not the least one.",
            gamma: "The next value is 2 theta: 2 gamma, minus 1 for the present one.",
        },
    )


@varied(kappa=(0.6, 0.88, 0.02))
@exercise
def parallel(answer: Any, *, kappa: float = 0.9) -> Outcome:
    """1 - gamma kappa."""
    return number(
        answer,
        1 - paper.GAMMA * kappa,
        tolerance=to_digits(1 - paper.GAMMA * kappa, 3),
        mistakes={
            1 - kappa: "The correction has a factor of gamma, too.",
            paper.GAMMA * kappa: "That is the length of the correction; what is left of ES?",
            1 / (1 - paper.GAMMA * kappa): "That is how much longer ES is: take the inverse.",
        },
    )


@exercise
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


@exercise
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


@dataclass(frozen=True, eq=False)
class Cubic:
    """The gradient of b'theta + theta'H theta / 2 + (c'theta)^3 / 3."""

    b: Vector
    c: Vector
    H: Matrix  # symmetric

    def __call__(self, theta: Vector) -> Vector:
        result: Vector = self.b + self.H @ theta + (self.c @ theta) ** 2 * self.c
        return result

    def hessian(self, theta: Vector) -> Matrix:
        """The value's second derivative."""
        result: Matrix = self.H + 2 * (self.c @ theta) * np.outer(self.c, self.c)
        return result


@exercise
def correction(answer: Any) -> Outcome:
    """h of Eq. (4.10), with the Hessian's product from two further gradients."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        d = int(rng.integers(2, 6))
        theta, w, b, c = rng.normal(size=(4, d))
        H = rng.normal(size=(d, d))
        case = {"delta": float(rng.normal()), "w": w, "theta": theta}
        return case | {"features": Cubic(b, c, H + H.T), "step": 1e-3}

    def right(delta: float, w: Vector, theta: Vector, features: Cubic, step: float) -> Vector:
        return curvature_correction(delta, features(theta), w, features.hessian(theta) @ w)

    def forward(delta: float, w: Vector, theta: Vector, features: Cubic, step: float) -> Vector:
        moved = (features(theta + step * w) - features(theta)) / step
        return curvature_correction(delta, features(theta), w, moved)

    return function(
        answer,
        right,
        draw,
        tolerance=1e-7,
        mistakes={
            "The difference is between two points that are 2 step apart.": (
                lambda **case: 2 * right(**case)
            ),
            "That is a forward difference, with an error of the order of step: take one point on "
            "either side.": forward,
            "The first factor is delta - phi'w, what w leaves of the TD error.": (
                lambda delta, w, theta, features, step: delta * features.hessian(theta) @ w
            ),
            "That is the Hessian times w; a factor is missing.": (
                lambda delta, w, theta, features, step: features.hessian(theta) @ w
            ),
        },
    )


@exercise
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

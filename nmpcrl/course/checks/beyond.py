"""The exercises of Chapter 7."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.course import Outcome, behaves, choice, exercise, formula, function, number, varied
from nmpcrl.course.checks.precision import to_digits
from nmpcrl.learning.updates import (
    OVERSHOOT,
    auxiliary_step,
    curvature_correction,
    gradient_td_step,
)


@varied(w=(0.02, 0.08, 0.01))
@exercise
def correction(answer: Any, *, w: float = 0.1) -> Outcome:
    """h for Q = theta^2 x at theta = 2, x = 1 and delta = 1."""
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


@varied(millions=(4.4, 9.6, 0.2))
@exercise
def fast(answer: Any, *, millions: float = 3.8) -> Outcome:
    """The largest beta with which beta |phi|^2 does not overshoot, at the largest |phi|^2."""
    largest = 4 * millions * 1e6
    beta = OVERSHOOT / largest
    return number(
        answer,
        beta,
        tolerance=to_digits(beta, 2, least=0.05),
        mistakes={
            OVERSHOOT
            / (millions * 1e6): "It has to hold at the end, too, where the norm is larger.",
            1 / largest: "At most 2, not 1: a step of 2 still does not grow.",
            OVERSHOOT / (4 * largest): "The squared norm grows fourfold, not the norm.",
        },
    )


@varied(final=(3710, 3990, 20))  # at 3800 as much is left to gain as was gained
@exercise
def share(answer: Any, *, final: float = 3700) -> Outcome:
    """What was gained over what could be gained."""
    initial, best = 4000.0, 3600.0
    return number(
        answer,
        (initial - final) / (initial - best),
        tolerance=0.01,
        mistakes={
            (initial - final) / initial: "That is the share of the cost, not of what is possible.",
            (final - best) / (initial - best): "That is what is left to gain.",
        },
    )


@exercise
def kappa(answer: Any) -> Outcome:
    """The concave function of Eq. (7.1) at kappa times its maximiser, over its maximum."""
    return formula(
        answer,
        lambda kappa: 2 * kappa - kappa**2,
        {"kappa": (0, 2)},
        mistakes={
            "The second term has w squared.": lambda kappa: kappa,
            "That is of the first term; the maximum is half as large.": (
                lambda kappa: kappa - kappa**2 / 2
            ),
            "That is the share of the second term alone.": lambda kappa: kappa**2,
            "That is what is lost.": lambda kappa: (1 - kappa) ** 2,
        },
    )


@exercise
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


@exercise
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


@exercise
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


@exercise
def search(answer: Any) -> Outcome:
    """Fresh draws in every round, the same ones for the same seed, and never a worse result."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        start = rng.uniform(2, 3, rng.integers(3, 10))
        return {
            "start": start,
            "rounds": int(rng.integers(5, 15)),
            "seed": int(rng.integers(10**6)),
        }

    def seen(answer: Any, start: Vector, rounds: int, seed: int) -> dict[str, Any]:
        def searched(cost: Callable[[Vector], float], seed: int = seed) -> _Search:
            tried: list[Vector] = []

            def watched(theta: Vector) -> float:
                tried.append(np.array(theta, float))
                return cost(theta)

            return _Search(cost, np.asarray(answer(watched, start, rounds, seed)), tried)

        flat = searched(lambda theta: float(not np.array_equal(theta, start)))
        bowls = [
            searched(lambda theta: float(theta @ theta), one) for one in (seed, seed, seed + 1)
        ]
        slope = searched(lambda theta: float(theta.sum()))
        rugged = searched(lambda theta: float(np.sin(1e4 * theta).sum()))  # no way leads down
        steps = np.array([start, *flat.tried]) - start
        return {
            "Every round draws the same steps.": (
                len(set(map(tuple, flat.tried))) > 8 * (rounds - 1)
            ),
            "The same seed has to give the same result, and another seed another one.": (
                np.array_equal(bowls[0].end, bowls[1].end)
                and not np.array_equal(bowls[0].end, bowls[2].end)
            ),
            "It met something better on its way than what it returns: keep the best.": (
                np.array_equal(flat.end, start) and all(one.best for one in [*bowls, slope, rugged])
            ),
            "What it returns is worse than the start.": all(
                one.cost(one.end) <= one.cost(start) for one in bowls
            ),
            "A step is the same in all components: draw one number for each.": (
                np.ptp(steps, axis=1).max() > 1e-9
            ),
            "All that it draws is near the start: draw around the best so far.": (
                (slope.end - start).sum() < steps.sum(axis=1).min() - 1e-9
            ),
        }

    return behaves(answer, seen, draw)


@dataclass(frozen=True, eq=False)
class _Search:
    """What a search did with a cost."""

    cost: Callable[[Vector], float]
    end: Vector
    tried: list[Vector]

    @property
    def best(self) -> bool:
        """Whether nothing that was tried costs less than what was returned."""
        return self.cost(self.end) <= min(map(self.cost, self.tried), default=np.inf)

"""The exercises of Chapter 6."""

from itertools import cycle, product
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.analysis.trap import STOOD
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.course.checks.precision import to_places
from nmpcrl.studies.population import STANDING


def gap(answer: Any) -> Outcome:
    """The theta_c at which the circles around two centres touch."""
    apart = 2.8
    closes = (apart / 2.5) ** 2 - 1
    return number(
        answer,
        closes,
        tolerance=to_places(closes, 2, least=0.02),
        mistakes={
            (apart / 1.25) ** 2 - 1: f"Each of the two takes its part of the {apart} m.",
            apart / 2.5 - 1: "The square is missing: theta_c stands below a root.",
            (apart / 2.5) ** 2: "That is 1 + theta_c.",
        },
    )


def screen(answer: Any) -> Outcome:
    """A criterion that asks the question of the claim."""
    return choice(
        answer,
        "c",
        {
            "a": "That is geometry, known before anything is trained.",
            "b": "That restricts the claim to layouts with something to gain, and uses the first "
            "rollout only.",
            "c": "it asks the learners the very question of the claim, and keeps the layouts in "
            "which one of them said yes.",
            "d": "That is about solvers at one state; no learner is asked.",
        },
    )


def smallest(answer: Any) -> Outcome:
    """That at least one of many cells has a small p."""
    cells = 120
    small = 0.01
    some = 1 - (1 - small) ** cells
    return number(
        answer,
        some,
        tolerance=to_places(some, 2, least=0.01),
        mistakes={
            cells * small: "That is how many are to be expected; a probability is at most 1.",
            (1 - small) ** cells: "That is the probability that none has.",
            small: "That is the probability for one cell.",
        },
    )


def standing(answer: Any) -> Outcome:
    """The TD error of a robot that stands and pays 54 a step."""
    value = 1500
    cost, gamma = 54.0, 0.97
    return number(
        answer,
        cost - (1 - gamma) * value,
        tolerance=0.01,
        mistakes={
            cost: "V does not cancel: the next value is discounted, so delta = l + gamma V - V.",
            cost / (1 - gamma): "That is what standing for ever costs, not the TD error.",
            (1 - gamma) * value - cost: "The TD error is what is paid and promised, minus V.",
        },
    )


def trapped(answer: Any) -> Outcome:
    """Whether a robot stands where the plan is worth less than standing."""
    near = cycle(product(STANDING * np.array([0.2, 0.9, 1.1, 4.0]), [0.5, 0.98, 1.02]))

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        way, worth = next(near)
        lengths = np.r_[rng.choice([0.0, 1.0]), np.full(STOOD, way / STOOD)]
        turned = np.arange(STOOD + 1) * 2 * np.pi / STOOD  # the last steps lead round a circle
        steps = lengths[:, None] * np.stack([np.cos(turned), np.sin(turned)], axis=1)
        path = rng.normal(size=2) + np.vstack([np.zeros(2), steps]).cumsum(axis=0)
        gamma, cost = float(rng.uniform(0.9, 0.98)), float(rng.uniform(1, 60))
        return {"path": path, "cost": cost, "value": worth * cost / (1 - gamma), "gamma": gamma}

    def ends(path: Matrix, **case: Any) -> bool:
        return in_trap(path[[-STOOD - 1, -1]], **case)

    return function(
        answer,
        in_trap,
        draw,
        mistakes={
            "A robot that turns in a circle moves: add up the steps.": ends,
            "Ten steps have eleven positions, and no more count.": lambda **one: in_trap(
                **one, steps=STOOD + 1
            ),
            "Ten positions have nine steps; ten steps count.": lambda **one: in_trap(
                **one, steps=STOOD - 1
            ),
            "The ten steps together may have up to 0.05 m.": lambda **one: in_trap(
                **one, limit=STANDING / 5
            ),
            "Standing for ever costs l / (1 - gamma).": lambda **one: in_trap(
                **one | {"gamma": 0.0}
            ),
        },
    )


def in_trap(
    path: Matrix,
    cost: float,
    value: float,
    gamma: float,
    steps: int = STOOD,
    limit: float = STANDING,
) -> bool:
    """The last steps are short, and V < l / (1 - gamma)."""
    way = np.linalg.norm(np.diff(path[-steps - 1 :], axis=0), axis=1).sum()
    return bool(way < limit and value < cost / (1 - gamma))


def feedback(answer: Any) -> Outcome:
    """gamma psi'phi / phi'phi by finite differences, of a prediction that is not linear."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        slope = rng.normal(size=4)
        return {
            "predict": lambda theta: float(np.sin(slope @ theta)),
            "theta": rng.normal(size=4),
            "phi": rng.normal(size=4) * rng.uniform(0.2, 5),
            "gamma": float(rng.uniform(0.9, 0.98)),
        }

    return function(
        answer,
        fed_back,
        draw,
        tolerance=1e-5,
        mistakes={
            "The norm of phi is squared: V moves by phi'phi.": lambda **one: (
                fed_back(**one) * np.linalg.norm(one["phi"])
            ),
            "The next value is discounted by gamma.": lambda **one: fed_back(
                **one | {"gamma": 1.0}
            ),
        },
    )


def fed_back(predict: Any, theta: Vector, phi: Vector, gamma: float, probe: float = 1e-5) -> float:
    """Eq. (6.3), by central differences along phi."""
    ahead, behind = predict(theta + probe * phi), predict(theta - probe * phi)
    return float(gamma * (ahead - behind) / (2 * probe * (phi @ phi)))

"""The exercises of the chapter on why learning stops."""

from itertools import cycle, product
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.studies.population import STANDING, STOOD


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


def evidence(answer: Any) -> Outcome:
    """Which record shows the trap."""
    return choice(
        answer,
        "c",
        {
            "a": "In the trap V comes closer to what is paid, so the TD error may fall.",
            "b": "The training cost falls with the noise, whatever becomes of the policy.",
            "c": "the trap is a robot that stands and a TD error above 0 there.",
            "d": "No step in the trap needs to be long.",
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
    """Eq. (10.3), by central differences along phi."""
    ahead, behind = predict(theta + probe * phi), predict(theta - probe * phi)
    return float(gamma * (ahead - behind) / (2 * probe * (phi @ phi)))

"""The exercises of the chapter on why learning stops."""

from itertools import cycle, product
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.course import Outcome, choice, exercise, formula, function, number, varied
from nmpcrl.studies.population import STANDING, STOOD

WAYS = STANDING * np.array([0.1, 0.5, 0.98, 1.02, 1.5, 4.0])  # [m] near the limit, and far from it


@varied(value=(1520, 1760, 20))
@exercise
def standing(answer: Any, *, value: float = 1500) -> Outcome:
    """The TD error of a robot that stands and pays 54 a step."""
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


@exercise
def growth(answer: Any) -> Outcome:
    """By how much theta_c grows in 100 steps of Eq. (12.2)."""
    delta, slope = 12, 120
    step = 1e-7 * delta * slope
    return number(
        answer,
        100 * step,
        tolerance=0.01,
        mistakes={
            step: "That is one step; the robot stands for 100 of them.",
            100 * step / delta: "The TD error is a factor, too.",
            100 * step / slope: "The slope of V in theta_c is a factor, too.",
        },
    )


@exercise
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


@exercise
def left(answer: Any) -> Outcome:
    """The share of a TD error that one step leaves, Eq. (12.3)."""
    return formula(
        answer,
        lambda step, f: 1 - step * (1 - f),
        {"step": (0.1, 3), "f": (0, 2)},
        mistakes={
            "That is without feedback: the target moves, too.": lambda step, f: 1 - step,
            "The target moves in the direction of V: its part comes back.": lambda step, f: (
                1 - step * (1 + f)
            ),
        },
    )


@exercise
def trapped(answer: Any) -> Outcome:
    """Whether a robot stands where the plan is worth less than standing."""
    below, above = product(WAYS, range(3), [0.5, 0.98]), product(WAYS[:1], range(3), [1.02, 1.5])
    cases = cycle(np.random.default_rng().permutation([*below, *above]))

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        way, shape, worth = next(cases)
        equal, first = np.full(STOOD, 1 / STOOD), np.eye(STOOD)[0]
        parts = [equal, first, rng.dirichlet(np.ones(STOOD))][int(shape)]
        lengths = np.r_[rng.choice([0.0, 1.0]), way * parts]
        turned = np.arange(11) * 2 * np.pi / 10  # after ten equal steps it is where it was
        steps = lengths[:, None] * np.stack([np.cos(turned), np.sin(turned)], axis=1)
        path = rng.normal(size=2) + np.vstack([np.zeros(2), steps]).cumsum(axis=0)
        gamma, cost = float(rng.uniform(0.9, 0.98)), float(rng.uniform(1, 60))
        value = float(worth * cost / (1 - gamma))
        return {"path": path, "cost": cost, "value": value, "gamma": gamma}

    return function(
        answer,
        in_trap,
        draw,
        mistakes={
            "A robot that turns in a circle moves: add up the steps.": ends_only,
            "Ten steps have eleven positions, and no more count.": lambda **one: in_trap(
                **one, steps=11
            ),
            "Ten positions have nine steps; ten steps count.": lambda **one: in_trap(
                **one, steps=9
            ),
            "The ten steps together are to be shorter than 0.05 m, not than 0.1 m.": (
                lambda **one: in_trap(**one, limit=0.1)
            ),
            "The ten steps together may have up to 0.05 m, not 0.01 m.": lambda **one: in_trap(
                **one, limit=0.01
            ),
            "A step may be longer than the tenth part of 0.05 m: add up the steps.": each_short,
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


def each_short(path: Matrix, cost: float, value: float, gamma: float) -> bool:
    """What compares each step with its tenth part of the limit."""
    steps = np.linalg.norm(np.diff(path[-STOOD - 1 :], axis=0), axis=1)
    return bool(steps.max() < STANDING / STOOD and value < cost / (1 - gamma))


def ends_only(path: Matrix, cost: float, value: float, gamma: float) -> bool:
    """What takes the distance of the ends for the way."""
    return in_trap(path[[-11, -1]], cost, value, gamma)


@exercise
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
    """Eq. (12.3), by central differences along phi."""
    ahead, behind = predict(theta + probe * phi), predict(theta - probe * phi)
    return float(gamma * (ahead - behind) / (2 * probe * (phi @ phi)))

"""The exercises of Chapter 1."""

from typing import Any

import numpy as np

from nmpcrl.control.task import overlap
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.course.checks.precision import to_places
from nmpcrl.study import paper


def distance(answer: Any) -> Outcome:
    """Where the overlap, Eq. (1.4), is minus theta_c."""
    theta_c = 0.21
    radius = 2.5 / 2
    kept = radius * float(np.sqrt(1 + theta_c))
    return number(
        answer,
        kept,
        tolerance=to_places(kept, 2),
        unit="m",
        mistakes={
            radius
            * (1 + theta_c): "The overlap has the square of the distance: take a square root.",
            radius: f"That is where the overlap is 0; the NMPC wants it to be -{theta_c} or less.",
            radius * np.sqrt(1 - theta_c): f"There the robot is inside: the overlap is +{theta_c}.",
            2.5
            * np.sqrt(1 + theta_c): "Eq. (1.4) has the sum of two diameters, and a factor of 4.",
        },
    )


def scale(answer: Any) -> Outcome:
    """How much larger the value at the start is with twice the weights, from two solves."""
    nmpc, theta = paper.nmpc(), np.array(paper.THETA_INIT)
    doubled = np.append(2 * theta[:8], theta[8])
    values = [nmpc.solve(nmpc.task.start, one).value for one in (theta, doubled)]
    return number(
        answer,
        values[1] / values[0],
        tolerance=2e-3,
        mistakes={
            2.0: "The parameters are square roots: look at how they enter Eq. (1.7).",
            16.0: "You squared once too often: the cost has theta squared, no fourth power.",
            1.0: "The plan stays as it is, and its cost does not.",
        },
    )


def apart(answer: Any) -> Outcome:
    """Why the plan is not the closed loop although the model is exact."""
    return choice(
        answer,
        "c",
        {
            "a": "Model and plant are the same function here, so this cannot be the reason.",
            "b": "Both are computed without noise in this chapter.",
            "c": "the model is exact, but later plans see further, and change what earlier ones "
            "had in mind.",
            "d": "Every solve ends at the same tolerance, about a billion times less than this.",
        },
    )


def penalty(answer: Any) -> Outcome:
    """Eq. (1.5), the part on obstacles, among some that are so close that several are charged."""
    task = paper.task()

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        x, y = rng.normal(0, rng.choice([0.3, 1.1]), (2, 4))
        return {"overlaps": overlap(0.0, 0.0, x, y, task.discs[2])}

    def charge(overlaps: Any, *, margin: float = task.margin) -> Any:
        return task.penalty * np.maximum(0, overlaps + margin).sum()

    return function(
        answer,
        charge,
        draw,
        mistakes={
            "An obstacle that is far away must not lower the penalty: take the larger of 0 and "
            "the rest, for each obstacle.": lambda overlaps: (
                task.penalty * (overlaps + task.margin).sum()
            ),
            "The larger of 0 and the rest is taken for each obstacle, before the sum.": (
                lambda overlaps: task.penalty * max(0, (overlaps + task.margin).sum())
            ),
            "Where the margins of two obstacles are entered, both are charged.": (
                lambda overlaps: task.penalty * max(0, overlaps.max() + task.margin)
            ),
            "Where four margins are entered, all four are charged.": lambda overlaps: charge(
                np.sort(overlaps)[-3:]
            ),
            "The penalty begins before the circles touch: the 0.35 is missing.": (
                lambda overlaps: charge(overlaps, margin=0.0)
            ),
            "The factor of 50 is missing.": lambda overlaps: charge(overlaps) / task.penalty,
        },
    )


def discounted(answer: Any) -> Outcome:
    """The sum of gamma^k times the cost of step k, from k = 0."""

    def total(costs: Any, gamma: float, *, first: int = 0) -> Any:
        return gamma ** (first + np.arange(len(costs))) @ costs

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        return {"costs": rng.uniform(0, 10, rng.integers(2, 9)), "gamma": rng.uniform(0.5, 1)}

    return function(
        answer,
        total,
        draw,
        mistakes={
            "The first cost is paid at once, and is still discounted here: try costs = [1.0].": (
                lambda costs, gamma: total(costs, gamma, first=1)
            ),
            "Nothing is discounted any more.": lambda costs, gamma: costs.sum(),
        },
    )

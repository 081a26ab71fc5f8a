"""The exercises of the chapter on a world that changes."""

from typing import Any

import numpy as np

from nmpcrl import Matrix
from nmpcrl.course import Outcome, choice, function, number

RADIUS = 1.25  # of an obstacle and the robot together [m]


def clocked(answer: Any) -> Outcome:
    """The TD error whose target is of the next time."""
    cost, gamma, value, later, same = 20.0, 0.97, 900.0, 880.0, 910.0
    return number(
        answer,
        cost + gamma * later - value,
        tolerance=0.005,
        mistakes={
            cost + gamma * same - value: "The next state is met at the next time, not at this one.",
            cost + later - value: "The next value is discounted by gamma.",
            cost + gamma * value - value: "That is of a robot that stands among what stands.",
        },
    )


def blind(answer: Any) -> Outcome:
    """What a Q-network of state and action misses among obstacles that move."""
    return choice(
        answer,
        "b",
        {
            "a": "More samples fit the mean over all times better, and that is not the value.",
            "b": "one state is met at several times, and is worth something else each time.",
            "c": "A wider network still gives one number for one state and action.",
            "d": "theta is not what moves; the obstacles are.",
        },
    )


def foretold(before: Matrix, now: Matrix, horizon: int) -> Matrix:
    """Centres of each stage, shape (horizon + 1, M, 2), by the velocity since the step before."""
    steps = np.arange(horizon + 1)[:, None, None]
    centres: Matrix = now + steps * (now - before)
    return centres


def predictor(answer: Any) -> Outcome:
    """Extrapolate the centres of some obstacles over a plan."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        count = rng.integers(1, 5)
        now = rng.uniform(-3, 8, (count, 2))
        moved = rng.uniform(-0.2, 0.2, (count, 2))
        return {"before": now - moved, "now": now, "horizon": int(rng.integers(1, 12))}

    return function(
        answer,
        foretold,
        draw,
        mistakes={
            "A plan of N steps has N + 1 states, the present one first.": lambda **one: foretold(
                **one
            )[1:],
            "The velocity is now minus before.": lambda **one: foretold(
                2 * one["now"] - one["before"], one["now"], one["horizon"]
            ),
            "That is the view in which obstacles stand.": lambda **one: foretold(
                one["now"], one["now"], one["horizon"]
            ),
        },
    )


def met(states: Matrix, centres: Matrix, radius: float = RADIUS) -> int:
    """How many states are in at least one obstacle, each at its own time."""
    away = np.linalg.norm(states[:, None, :2] - centres, axis=2)
    return int((away < radius).any(axis=1).sum())


def met_twice(states: Matrix, centres: Matrix) -> int:
    """What counts a state in two obstacles twice."""
    away = np.linalg.norm(states[:, None, :2] - centres, axis=2)
    return int((away < RADIUS).sum())


def inside(answer: Any) -> Outcome:
    """Count the states of an episode that are in an obstacle."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        steps, count = int(rng.integers(5, 20)), int(rng.integers(1, 4))
        centres = rng.uniform(-1.5, 1.5, (steps, count, 2))
        return {"states": rng.uniform(-1.5, 1.5, (steps, 3)), "centres": centres}

    return function(
        answer,
        met,
        draw,
        mistakes={
            "A state in two obstacles is one state.": met_twice,
            "At step k the obstacles are at their centres of step k, not of the first one.": (
                lambda states, centres: met(states, np.repeat(centres[:1], len(centres), axis=0))
            ),
            "The distance is that to the centre: below the sum of the radii, 1.25 m, not 2.5 m.": (
                lambda states, centres: met(states, centres, 2 * RADIUS)
            ),
        },
    )

"""The exercises of the chapter on what to try first."""

from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.course import Outcome, behaves, choice, function, number
from nmpcrl.course.checks.precision import to_digits


def guarded(answer: Any) -> Outcome:
    """The share of a step that the guard leaves, where alpha ||phi||^2 is `times`."""
    times = 8.0
    return number(
        answer,
        1 / times,
        tolerance=to_digits(1 / times, 2),
        mistakes={
            times: "The guard makes the step shorter, not longer.",
            2 / times: "2 is where an error grows; the guard closes it, which takes 1.",
            1.0: "The step overshoots: alpha ||phi||^2 is above 1.",
        },
    )


def advised(answer: Any) -> Outcome:
    """Which of four entries the rule of advice names first."""
    return choice(
        answer,
        "c",
        {
            "a": "Its mean is the largest, but the lower end decides.",
            "b": "Its lower end with 50 episodes is no greater than that of c; what comes next?",
            "c": "of those that are not open, b and c have the greatest lower end with 50 episodes,"
            " and c has the greater one with 300.",
            "d": "With 300 episodes its interval holds 0, so it is open.",
        },
    )


def tdrc(answer: Any) -> Outcome:
    """One step of TDRC, theta and w from the old values."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        return {
            **{name: rng.normal(size=4) for name in ("theta", "w", "phi", "phi_next")},
            "delta": float(rng.normal()),
            "alpha": float(rng.uniform(0.01, 0.3)),
            "gamma": float(rng.uniform(0.8, 0.99)),
            "kappa": float(rng.uniform(0.5, 3)),
        }

    return function(
        answer,
        tdrc_step,
        draw,
        mistakes={
            "w is drawn to 0 by kappa w, so that is subtracted.": lambda **one: tdrc_step(
                **one | {"kappa": -one["kappa"]}
            ),
            "The step size multiplies the decay, too.": lambda **one: tdrc_step(
                **one | {"kappa": one["kappa"] / one["alpha"]}
            ),
            "The correction of theta is discounted by gamma.": lambda **one: tdrc_step(
                **one | {"gamma": 1.0}
            ),
        },
    )


def tdrc_step(
    theta: Vector,
    w: Vector,
    delta: float,
    phi: Vector,
    phi_next: Vector,
    alpha: float,
    gamma: float,
    kappa: float,
) -> tuple[Vector, Vector]:
    """Theta and w after a step."""
    moved = theta + alpha * (delta * phi - gamma * (phi @ w) * phi_next)
    return moved, w + alpha * ((delta - phi @ w) * phi - kappa * w)


def undone(answer: Any) -> Outcome:
    """Each move that costs more than the least so far is taken back, and the others are kept."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        moves = rng.normal(size=(int(rng.integers(8, 20)), 3))
        return {"theta": rng.uniform(1, 2, 3), "moves": moves}

    def seen(answer: Any, theta: Vector, moves: Any) -> dict[str, bool]:
        def bowl(one: Vector) -> float:
            return float(one @ one)

        end = answer(theta.copy(), moves.copy(), bowl)
        worse = answer(theta.copy(), np.array([theta, theta / 2]), bowl)
        return {
            "Compare a move with what is kept, not with one that was taken back.": bool(
                np.allclose(worse, theta)
            ),
            "It ends at a higher cost than it began with.": bowl(end) <= bowl(theta),
            "Moves that make the cost lower are to be kept, one after the other.": bool(
                np.allclose(end, kept(theta, moves, bowl))
            ),
        }

    return behaves(answer, seen, draw)


def kept(theta: Vector, moves: Any, cost: Any) -> Vector:
    """Where the moves lead if each is taken back that costs more."""
    for move in moves:
        theta = min([theta, theta + move], key=cost)
    return theta

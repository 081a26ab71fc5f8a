"""The exercises of the chapter on what to try first."""

from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.course import Outcome, behaves, choice, number
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

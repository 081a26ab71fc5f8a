"""The exercises of Chapter 2."""

from typing import Any

from nmpcrl import Vector
from nmpcrl.course import Outcome, exercise, number
from nmpcrl.study import paper


@exercise
def multiplier(answer: Any) -> Outcome:
    """Of min x^2 subject to theta - x <= 0 at theta = 3: where the Lagrangian is stationary."""
    x = 3.0
    return number(
        answer,
        2 * x,
        tolerance=1e-3,
        mistakes={
            x: "That is the minimiser: set the Lagrangian's derivative by x to zero there.",
            x**2: "That is the optimal cost; the multiplier is the rate at which it rises.",
            -2 * x: "The multiplier of an inequality is not negative: look at the sign of x.",
            0.0: "The constraint is active: without it x would be 0.",
        },
    )


@exercise
def alpha(answer: Any, features: Vector) -> Outcome:
    """The step size with which the value moves by the TD error, to first order."""
    squared = float(features @ features)
    return number(
        answer,
        1 / squared,
        tolerance=0.01,
        mistakes={
            squared**-0.5: "The step has the length alpha delta times the norm of phi, and the "
            "value moves by that length times the norm once more.",
            paper.ALPHA: "That is the paper's step size, which closes a part of the TD error.",
            squared: "It is the other way round: the larger phi, the smaller the step.",
        },
    )


@exercise
def solves(answer: Any) -> Outcome:
    """Of one episode with central differences: two a component, and those of Expected Sarsa."""
    components = len(paper.THETA_INIT)
    return number(
        answer,
        (2 + 2 * components) * paper.STEPS,
        tolerance=1e-4,
        mistakes={
            2 * paper.STEPS: "That is with the envelope theorem; differences need more solves.",
            2 * components * paper.STEPS: "The values of s and of the next state are needed, too.",
            (2 + components) * paper.STEPS: "Central differences take two solves a component.",
        },
    )

"""The exercises of the appendix on the solver."""

from typing import Any

from nmpcrl.control import Nmpc
from nmpcrl.course import Outcome, exercise, number


@exercise
def price(answer: Any) -> Outcome:
    """Half of W: sigma and s are equal where h = 0."""
    weight = 80.0
    return number(
        answer,
        weight / 2,
        tolerance=1e-3,
        mistakes={
            weight: "That is the price of a violated constraint; here h is 0.",
            0.0: "That is the price of a constraint that is far from active; here h is 0.",
            0.5: "That is mu. Both products of Eq. (8.2) are mu: which multipliers do they have?",
        },
    )


@exercise
def golden(answer: Any) -> Outcome:
    """The fixed point of V = 1 + V - V^2 / (1 + V)."""
    return number(
        answer,
        (1 + 5**0.5) / 2,
        tolerance=1e-3,
        mistakes={
            1.5: "That is after one step from V = 1: go on, or set V equal on both sides.",
            1.6: "That is after two steps from V = 1: go on, or set V equal on both sides.",
            (1 - 5**0.5) / 2: "That solves the equation, too, but a cost is not negative.",
        },
    )


@exercise
def dense(answer: Any, nmpc: Nmpc) -> Outcome:
    """The cube of how many times larger the matrix is with 80 steps than with 40."""
    n, m, discs = nmpc.plant.n, nmpc.plant.m, len(nmpc.task.obstacles)
    per_stage, rest = n + m + discs + n + discs, 2 * n + 2 * discs
    sizes = [per_stage * steps + rest for steps in (40, 80)]
    grows = sizes[1] / sizes[0]
    return number(
        answer,
        grows**3,
        tolerance=0.05,
        mistakes={
            2.0: "That is the factor of the recursion, which does the same work at every stage.",
            4.0: "So much more room the matrix takes; the work grows faster.",
        },
    )

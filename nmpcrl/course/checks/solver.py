"""The exercises of the appendix on the solver and its speed."""

from itertools import cycle
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.course import Outcome, behaves, choice, function, number


def price(answer: Any) -> Outcome:
    """Half of W: sigma and s are equal where h = 0."""
    weight = 80
    return number(
        answer,
        weight / 2,
        tolerance=1e-3,
        mistakes={
            weight: "That is the price of a violated constraint; here h is 0.",
            0.0: "That is the price of a constraint that is far from active; here h is 0.",
            0.5: "That is mu. Both products of Eq. (2) are mu: which multipliers do they have?",
        },
    )


def values(answer: Any) -> Outcome:
    """What two small residuals at two values say."""
    return choice(
        answer,
        "c",
        {
            "a": "Its residual says that it found an optimum; which one, no solver promises.",
            "b": "A convex problem has one optimal value; this one has obstacles.",
            "c": "KKT conditions are local, and an obstacle can be passed on two sides.",
            "d": "It is the lower of two; a third start may find a lower one still.",
        },
    )


def riccati(answer: Any) -> Outcome:
    """The first gain of random problems, beside a dense solve of the whole plan."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        n, m = rng.integers(2, 4), rng.integers(1, 3)
        halves = [rng.normal(size=(size, size)) for size in (n, m, n)]
        Q, R, V = (half @ half.T + np.eye(len(half)) for half in halves)
        A, B = rng.normal(size=(n, n)) / n, rng.normal(size=(n, m))
        return {"A": A, "B": B, "Q": Q, "R": R, "V": V, "stages": int(rng.integers(2, 7))}

    return function(
        answer,
        _first_gain_by_one_solve,
        draw,
        mistakes={
            "That is the gain of the last stage, which the recursion visits first.": (
                lambda **given: _first_gain_by_one_solve(**given | {"stages": 1})
            ),
            "The minus sign is missing.": lambda **given: -_first_gain_by_one_solve(**given),
        },
    )


def _first_gain_by_one_solve(
    A: Vector, B: Vector, Q: Vector, R: Vector, V: Vector, stages: int
) -> Vector:
    """The gain of the first of all inputs, which are solved for at once."""
    n, m = B.shape
    powers = [np.linalg.matrix_power(A, k) for k in range(stages + 1)]
    free = np.vstack(powers[1:])  # states by the first state
    forced = np.zeros((n * stages, m * stages))  # states by the inputs
    for row in range(stages):
        for column in range(row + 1):
            block = powers[row - column] @ B
            forced[row * n : (row + 1) * n, column * m : (column + 1) * m] = block
    weights = np.kron(np.eye(stages), Q)
    weights[-n:, -n:] = V
    hessian = np.kron(np.eye(stages), R) + forced.T @ weights @ forced
    plan: Vector = -np.linalg.solve(hessian, forced.T @ weights @ free)
    return plan[:m]


def residual(answer: Any) -> Outcome:
    """Points that satisfy all KKT conditions, and points that miss one of them.

    They miss each condition in each constraint and each component once, with either sign.
    """
    points = cycle(_missing())

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        broken, row, off = next(points)
        jacobian, size = rng.normal(size=(4, 3)), rng.uniform(0.5, 2, 4)
        active = np.roll([True, True, False, False], row)
        g, multipliers = np.where(active, 0.0, -size), np.where(active, size, 0.0)
        if broken == "complementarity":
            multipliers[row - 1] = rng.uniform(0.5, 2)
        if broken == "sign":
            multipliers[row] *= -1
        if broken == "feasibility":
            g[row], multipliers[row] = size[row], 0.0
        gradient = rng.uniform(0.5, 2) * off - jacobian.T @ multipliers
        return {"gradient": gradient, "jacobian": jacobian, "g": g, "multipliers": multipliers}

    def seen(
        answer: Any, gradient: Vector, jacobian: Vector, g: Vector, multipliers: Vector
    ) -> dict[str, bool]:
        found = float(answer(gradient, jacobian, g, multipliers))
        is_zero = abs(found) < 1e-6
        missed = {
            "It is 0 where the gradients do not balance.": (
                np.abs(gradient + jacobian.T @ multipliers).max() > 1e-9
            ),
            "It is 0 where a constraint is violated.": g.max() > 0,
            "It is 0 where a multiplier is negative.": multipliers.min() < 0,
            "It is 0 where a constraint far from active has a multiplier.": (
                np.abs(multipliers * g).max() > 1e-9
            ),
        }
        said = {why: not (wrong and is_zero) for why, wrong in missed.items()}
        return said | {
            f"At an optimum it gives {found:.3g} instead of 0.": any(missed.values()) or is_zero
        }

    return behaves(answer, seen, draw, times=len(_missing()))


def _missing() -> list[tuple[str, int, Vector]]:
    """What is missed, in which constraint, and the direction in which the gradients are off."""
    units, broken = np.eye(3), ("nothing", "complementarity", "sign", "feasibility")
    off = [*units, *-units, *(units - np.roll(units, 1, 0))]  # the last ones add up to 0
    balanced = [(why, row, np.zeros(3)) for row in range(4) for why in broken]
    return balanced + [("gradient", k % 4, one) for k, one in enumerate(off)]


def faster(answer: Any) -> Outcome:
    """The ratio with solves half as long, from the ratio before."""
    before = 0.7
    fit = 2 * before - 1  # in solves
    return number(
        answer,
        (0.5 + fit) / (2 * 0.5),
        tolerance=0.01,
        mistakes={
            before: "Both solve, but only a part of a step of RDES gets shorter.",
            before / 2: "A step of RDES does not get twice as fast: the fit stays.",
            0.5 + fit / 4: "ES gets faster, and so does RDES: which of the two by more?",
        },
    )

"""The exercises of Chapter 6."""

from typing import Any

import numpy as np
from scipy.stats import fisher_exact

from nmpcrl import Vector
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.course.checks.precision import to_places


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


def paired(answer: Any) -> Outcome:
    """McNemar's exact test of random answers, some of which do not change at all."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        before = rng.random(rng.integers(6, 15)) < 0.5
        return {
            "before": before,
            "after": before ^ (rng.random(before.size) < rng.choice([0, 0.5])),
        }

    def tails(before: Vector, after: Vector, *, sides: int = 2) -> float:
        changed = (before != after).sum()
        gained = int((after > before).sum())
        halves = np.array([1.0])
        for _ in range(changed):
            halves = np.convolve(halves, [0.5, 0.5])
        return min(1.0, sides * float(halves[: min(gained, changed - gained) + 1].sum()))

    def unpaired(before: Vector, after: Vector) -> float:
        counts = [[one.sum(), one.size - one.sum()] for one in (before, after)]
        return float(fisher_exact(counts).pvalue)

    return function(
        answer,
        tails,
        draw,
        mistakes={
            "That is Fisher's, which does not know which runs belong together.": unpaired,
            "That is one side: as many changes the other way would be as extreme.": (
                lambda before, after: tails(before, after, sides=1)
            ),
        },
    )


def best(answer: Any) -> Outcome:
    """The smallest p of several borders, and what the search for it costs."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        apart = rng.choice([0.0, 3.0])
        first, second = rng.normal(size=(2, 12))
        borders = np.sort(rng.uniform(-1, 3, rng.integers(2, 5)))
        return {"first": first, "second": second + apart, "borders": borders}

    def smallest(first: Vector, second: Vector, borders: Vector) -> float:
        yes = [[(one > border).sum() for one in (first, second)] for border in borders]
        tables = [[[a, b], [first.size - a, second.size - b]] for a, b in yes]
        return min(float(fisher_exact(table).pvalue) for table in tables)

    return function(
        answer,
        lambda first, second, borders: min(1.0, len(borders) * smallest(first, second, borders)),
        draw,
        mistakes={
            "Each border that is tried is a chance to be deceived; here they cost nothing.": (
                smallest
            ),
            "A p is a probability, and so at most 1.": (
                lambda first, second, borders: len(borders) * smallest(first, second, borders)
            ),
            "So it gets smaller with every border that is tried.": (
                lambda first, second, borders: smallest(first, second, borders) / len(borders)
            ),
        },
    )

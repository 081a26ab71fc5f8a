"""The exercises of the appendix on times."""

from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.course import Outcome, behaves, choice, number
from nmpcrl.course.checks.precision import to_digits


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


def amdahl(answer: Any) -> Outcome:
    """Of a step of which four fifths become many times as fast."""
    times = 10
    part = 0.8
    faster = 1 / (1 - part + part / times)
    return number(
        answer,
        faster,
        tolerance=to_digits(faster, 2, least=0.02),
        mistakes={
            part * times: "Add times, not speeds: the other fifth takes as long as before.",
            times: "The other fifth takes as long as before.",
            1 / (1 - part): "That would take an infinitely fast solver.",
            1 - part + part / times: "That is how long the step takes now.",
        },
    )


def warm(answer: Any) -> Outcome:
    """What happens to a ratio whose denominator grows."""
    return choice(
        answer,
        "a",
        {
            "a": "ES gets slower, RDES does not, and ES is what RDES is compared with.",
            "b": "RDES stays as it is; which one gets slower?",
            "c": "As many solves, but those of ES take longer from a start that is farther away.",
            "d": "Starts alike are not times alike: RDES still saves a whole solve.",
        },
    )


def speed_up(answer: Any) -> Outcome:
    """A factor that is one over itself with the arguments exchanged."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        size = 2 * int(rng.integers(3, 6)) + 1
        return {"old": np.exp(rng.normal(size=size)), "new": np.exp(rng.normal(size=size))}

    def seen(answer: Any, old: Vector, new: Vector) -> dict[str, Any]:
        forth, back = answer(old, new), answer(new, old)
        times = 1000 ** np.vstack([np.eye(old.size), -np.eye(old.size)])  # one problem in a row
        return {
            "Where the old one takes three times as long everywhere, the answer is 3.": np.isclose(
                answer(3 * new, new), 3
            ),
            "Where the old one takes twice as long as before, the answer is twice as large.": (
                np.isclose(answer(2 * old, new), 2 * forth)
            ),
            "Exchanged, it must give the inverse; here each is faster than the other.": np.isclose(
                forth * back, 1
            ),
            "The order of the problems must not matter.": np.isclose(
                answer(np.roll(old, 1), np.roll(new, 1)), forth
            ),
            "One problem decides alone: all are to count.": [
                forth / 990 < answer(one * old, new) < 990 * forth for one in times
            ],
        }

    return behaves(answer, seen, draw)

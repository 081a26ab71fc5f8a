"""The exercises of the appendix on times."""

from collections.abc import Callable
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.course import Outcome, behaves, choice, exercise, formula, function, number, varied
from nmpcrl.course.checks.precision import to_digits

Clock = Callable[[], float]  # makes one call and returns how long it took [s]


@exercise
def ratio(answer: Any) -> Outcome:
    """The s / f with (s + f) / 2s = r."""
    return formula(
        answer,
        lambda r: 1 / (2 * r - 1),
        {"r": (0.51, 0.95)},
        mistakes={
            "RDES solves once a step, and ES twice: (s + f) / 2s.": lambda r: 1 / r,
            "That is f / s; how many times longer than the fit is the solve?": lambda r: 2 * r - 1,
            "ES solves twice a step: its step takes 2 s.": lambda r: 1 / (r - 1),
        },
    )


@varied(before=(0.75, 0.95, 0.05))
@exercise
def faster(answer: Any, *, before: float = 0.7) -> Outcome:
    """The ratio with solves half as long, from the ratio before."""
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


@varied(times=(2, 8, 1))
@exercise
def amdahl(answer: Any, *, times: float = 10) -> Outcome:
    """Of a step of which four fifths become many times as fast."""
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


@exercise
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


class _Machine:
    """Two programs on a machine on which a third one starts."""

    def __init__(self, rng: np.random.Generator, turns: int) -> None:
        self.longer = rng.uniform(0.5, 2)  # times as long as the first the second takes
        self.noise = np.random.default_rng(rng.integers(2**32))
        self.busy_from = rng.uniform(0.6, 1.4) * turns  # of 2 turns calls
        self.calls = 0

    def first(self) -> float:
        """One call of the first program [s]."""
        self.calls += 1
        load = 3.0 if self.calls > self.busy_from else 1.0
        slow = 20.0 if self.noise.random() < 0.05 else 1.0
        return 1e-3 * load * slow * float(np.exp(self.noise.normal(0, 0.02)))

    def second(self) -> float:
        """One call of the second program [s]."""
        return float(self.longer * self.first())


@exercise
def compare(answer: Any) -> Outcome:
    """How many times longer the second program takes, on machines that get busy."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        machine = _Machine(rng, turns=101)
        return {"first": machine.first, "second": machine.second, "turns": 101}

    def truth(first: Any, second: Any, turns: int) -> Any:
        return first.__self__.longer

    def blocks(first: Clock, second: Clock, turns: int) -> Any:
        before, after = ([one() for _ in range(turns)] for one in (first, second))
        return np.median(after) / np.median(before)

    def by_mean(first: Clock, second: Clock, turns: int) -> Any:
        return np.mean([(1 / first()) * second() for _ in range(turns)])

    def inverse(first: Any, second: Any, turns: int) -> Any:
        return 1 / first.__self__.longer

    return function(
        answer,
        truth,
        draw,
        tolerance=0.05,
        mistakes={
            "What begins while you measure must not slow one of the two only: let them take "
            "turns.": blocks,
            "A call that is twenty times too long must not decide: means follow it.": by_mean,
            "That is the inverse: how many times longer does the second take?": inverse,
        },
    )


@exercise
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

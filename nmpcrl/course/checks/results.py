"""The exercises of Chapter 5."""

from typing import Any

import numpy as np

from nmpcrl.bench import learners
from nmpcrl.claims import rule
from nmpcrl.course import Outcome, exercise, number
from nmpcrl.study import paper


@exercise
def half(answer: Any) -> Outcome:
    """The s / f with (s + f) / 2s = 0.55."""
    return number(
        answer,
        1 / (2 * 0.55 - 1),
        mistakes={
            1 / 0.55: "RDES solves once a step, and ES twice: (s + f) / 2s.",
            0.1: "That is f / s; how many times longer than the fit is the solve?",
        },
    )


@exercise
def enough(answer: Any) -> Outcome:
    """The least number of runs that the rule calls reproduced if all of them agree."""
    return number(
        answer,
        next(n for n in range(1, 100) if rule.read(n, n) == rule.REPRODUCED),
        tolerance=1e-3,
        mistakes={
            3: "With 3 of 3 the lower end is 3 / 6.84, below one half.",
            2: "With 2 of 2 the lower end is 2 / 5.84, far below one half.",
            5: "That is enough, and it is not the least number.",
        },
    )


@exercise
def mean(answer: Any) -> Outcome:
    """Of nineteen ones and one forty."""
    late = np.array([1.0] * 19 + [40.0])
    return number(
        answer,
        float(late.mean()),
        tolerance=2e-3,
        mistakes={
            1.0: "That is the median, which forgives the one episode.",
            2.0: "The other 19 episodes count, too.",
            40.0: "That is the largest of the 20.",
        },
    )


@exercise
def step(answer: Any) -> Outcome:
    """The paper's hours over all steps [s]."""
    seconds = learners.PAPER_HOURS["RDES"] * 3600 / (paper.EPISODES * paper.STEPS)
    return number(
        answer,
        seconds,
        unit="s",
        tolerance=0.01,
        mistakes={
            seconds / 60: "An hour has 3600 seconds.",
            2 * seconds: "Table II gives 18 hours for ES and 9 for RDES.",
            seconds * paper.STEPS: "That is the time of an episode; how long is a step?",
        },
    )

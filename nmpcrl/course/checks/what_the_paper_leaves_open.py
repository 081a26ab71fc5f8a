"""The exercises of Chapter 6."""

from typing import Any

from scipy.stats import fisher_exact

from nmpcrl.claims.rule import read
from nmpcrl.course import Outcome, choice, exercise, number


@exercise
def gap(answer: Any) -> Outcome:
    """The theta_c at which the circles around two centres touch."""
    apart = 2.8
    return number(
        answer,
        (apart / 2.5) ** 2 - 1,
        tolerance=0.02,
        mistakes={
            (apart / 1.25) ** 2 - 1: "Each of the two obstacles takes its part of the 2.8 m.",
            apart / 2.5 - 1: "The square is missing: theta_c stands below a root.",
            (apart / 2.5) ** 2: "That is 1 + theta_c.",
        },
    )


@exercise
def fisher(answer: Any) -> Outcome:
    """Of five runs with and five without, all unlike."""
    p = float(fisher_exact([[5, 0], [0, 5]]).pvalue)
    return number(
        answer,
        p,
        tolerance=0.01,
        mistakes={
            p / 2: "The test has two sides: the opposite table is as extreme as this one.",
            2 / 70: "That is for four runs on each side.",
            2 / 32: "The runs of one row are drawn from all ten: use a binomial coefficient.",
        },
    )


@exercise
def border(answer: Any) -> Outcome:
    """The verdicts on 9 of 10 and on 8 of 10."""
    verdicts = f"{read(9, 10)}, {read(8, 10)}"
    return choice(
        answer,
        "b",
        {
            "a": "With 8 of 10 the lower end of the interval is below one half.",
            "b": f"{verdicts}.",
            "c": "9 of 10 is nine tenths, and its interval lies above one half.",
            "d": "Ten runs suffice for a verdict; with three they would not.",
        },
    )

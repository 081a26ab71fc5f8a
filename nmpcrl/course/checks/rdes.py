"""The exercises of Chapter 3."""

from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.course import Outcome, choice, function, number
from nmpcrl.course.checks.precision import to_digits
from nmpcrl.study import paper


def floor(answer: Any) -> Outcome:
    """The standard deviation of one example at 1000 and three that are higher."""
    high = 1400
    values = np.array([1000.0, high, high, high])
    errors = values - values.mean()
    least = float(np.sqrt(np.mean(errors**2)))
    return number(
        answer,
        least,
        tolerance=to_digits(least, 3),
        mistakes={
            float(np.mean(errors**2)): "That is the mean square: take its root.",
            float(np.abs(errors).mean()): "That is the mean of the absolute errors.",
            (high - 1000) / 2: "The examples are not as many of each kind: the best prediction is "
            f"not {(high + 1000) / 2:g}.",
            0.0: "Both values belong to the same input, and one prediction cannot be both.",
            float(values.mean()): "That is the best prediction; by how much is it wrong?",
        },
    )


def astray(answer: Any) -> Outcome:
    """alpha times gamma times the error times phi_x, once in each step of an episode."""
    error = 20
    phi = 1800.0
    step = paper.ALPHA * paper.GAMMA * error * phi
    whole = paper.STEPS * step
    return number(
        answer,
        whole,
        tolerance=to_digits(whole, 2, least=0.02),
        mistakes={
            whole / paper.GAMMA: "The prediction enters the TD error with a factor of gamma.",
            step: "That is one step; the error keeps its sign for an episode of 130.",
            float(np.sqrt(paper.STEPS)) * step: "So errors add up that scatter about zero; these "
            "all have the same sign.",
            paper.GAMMA * error: "That is how far off a TD error is; the step follows from it.",
        },
    )


def tail(answer: Any) -> Outcome:
    """The TD error with (V - L) / gamma for the next value: V and gamma cancel."""
    cost, first, value, gamma = 22.0, 15.0, 1400.0, paper.GAMMA
    return number(
        answer,
        cost - first,
        mistakes={
            cost + gamma * (value - first) - value: "V counts the plan from now on: what remains "
            "of it after the first stage is discounted once, so divide by gamma.",
            (value - first) / gamma: "That is the next value; put it into the TD error.",
            first - cost: "Look at the sign: the TD error is the target minus the value.",
        },
    )


def split(answer: Any) -> Outcome:
    """Which held-out steps are as far from the examples as those met while learning."""
    return choice(
        answer,
        "c",
        {
            "a": "The steps before and after a held-out one have almost its state, and the same "
            "theta to four digits: the network has seen the answer.",
            "b": "The network has been fitted to the episodes before and after, and only has to "
            "interpolate in theta.",
            "c": "there, as in learning, theta is newer than in every example.",
            "d": "That is the first answer once more, with another choice of steps.",
        },
    )


def examples(answer: Any) -> Outcome:
    """Inputs of the network with the theta that each value was solved with."""

    def draw(rng: np.random.Generator) -> dict[str, Any]:
        steps, first = int(rng.integers(3, 9)), rng.uniform(0.5, 1.5, 2)
        thetas = first + rng.normal(0, 0.01, (steps, 2)).cumsum(axis=0)
        pairs, values = rng.normal(size=(steps, 3)), rng.uniform(900, 1100, steps)
        return {"pairs": pairs, "values": values, "thetas": thetas, "first": first}

    def joined(pairs: Matrix, values: Vector, theta: Matrix) -> tuple[Matrix, Vector]:
        return np.hstack([pairs, theta]), values

    def right(pairs: Matrix, values: Vector, thetas: Matrix, first: Vector) -> Any:
        return joined(pairs, values, np.vstack([first, thetas[:-1]]))

    return function(
        answer,
        right,
        draw,
        mistakes={
            "The theta in a row is the one that its step moved; the value was solved before "
            "that.": lambda pairs, values, thetas, first: joined(pairs, values, thetas),
            "The first value was solved with `first`, and not with the last theta.": (
                lambda pairs, values, thetas, first: joined(pairs, values, np.roll(thetas, 1, 0))
            ),
            "That is one step further in the wrong direction.": (
                lambda pairs, values, thetas, first: joined(pairs, values, np.roll(thetas, -1, 0))
            ),
            "The pairs are right, and an example was lost: the first one has `first`.": (
                lambda pairs, values, thetas, first: joined(pairs[1:], values[1:], thetas[:-1])
            ),
        },
    )

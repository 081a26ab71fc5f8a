"""The exercises of Chapter 3."""

from typing import Any

from nmpcrl.course import Outcome, exercise, number
from nmpcrl.study import paper


@exercise
def weights(answer: Any) -> Outcome:
    """How many more the first layer has with theta as an input."""
    neurons, more = 64, len(paper.THETA_INIT)
    return number(
        answer,
        more * neurons,
        tolerance=1e-4,
        mistakes={
            more: "Each of these inputs is connected to every neuron of the first layer.",
            (more + 1) * neurons: "The biases belong to the neurons, and those are as many.",
            (more + 5) * neurons: "Those are all weights of the inputs: how many are new?",
        },
    )


@exercise
def astray(answer: Any) -> Outcome:
    """alpha times gamma times the error times phi_x."""
    error, phi = 20.0, 1800.0
    step = paper.ALPHA * paper.GAMMA * error * phi
    return number(
        answer,
        step,
        tolerance=0.02,
        mistakes={
            step / paper.GAMMA: "The prediction enters the TD error with a factor of gamma.",
            paper.GAMMA * error: "That is how far off the TD error is; the step follows from it.",
        },
    )


@exercise
def share(answer: Any) -> Outcome:
    """The share r with (1 + r) / 2 = 0.6."""
    return number(
        answer,
        2 * 0.6 - 1,
        mistakes={
            1.2: "A step of RDES has a solve as well: one solve and a fit, against two solves.",
            0.1: "A step of ES takes two solves, so 0.6 of it is 1.2 solves.",
        },
    )

"""The exercises of Chapter 4."""

from typing import Any

from nmpcrl.analysis.two_state import Chain, expected_matrix
from nmpcrl.course import Outcome, exercise, number
from nmpcrl.learning.learners import semi_gradient
from nmpcrl.study import paper


@exercise
def factor(answer: Any) -> Outcome:
    """By which one expected semi-gradient step multiplies theta."""
    chain, step = Chain(gamma=0.4), 0.1
    return number(
        answer,
        float(expected_matrix(chain, semi_gradient(step))[0, 0]),
        tolerance=1e-3,
        mistakes={
            -0.02: "That is by how much theta changes; by which factor is it multiplied?",
            1.02: "Look at the sign of 2 gamma - 1.",
            1 + step * (chain.gamma - 1): "The value of the second state is 2 theta.",
        },
    )


@exercise
def ratio(answer: Any) -> Outcome:
    """Where the trace of the matrix changes its sign, for a tiny alpha."""
    gamma = 0.9
    return number(
        answer,
        2 * gamma - 1,
        mistakes={
            1.0: "A ratio of 1 is enough, but it is not the least one.",
            gamma: "The next value is 2 theta: 2 gamma, minus 1 for the present one.",
        },
    )


@exercise
def parallel(answer: Any) -> Outcome:
    """1 - gamma kappa."""
    kappa = 0.9
    return number(
        answer,
        1 - paper.GAMMA * kappa,
        mistakes={
            1 - kappa: "The correction has a factor of gamma, too.",
            paper.GAMMA * kappa: "That is the length of the correction; what is left of ES?",
            1 / (1 - paper.GAMMA * kappa): "That is how much longer ES is: take the inverse.",
        },
    )

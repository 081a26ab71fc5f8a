"""Control arms: what a learner is compared with, under the same noise.

| control | theta moves by                                                 |
|---------|----------------------------------------------------------------|
| frozen  | nothing                                                        |
| matched | the direction of ES, as far as GES would move                  |
| random  | a direction drawn uniformly, as far as ES would move           |
"""

from functools import partial

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Solution
from nmpcrl.learning.bootstrap import Controller, NextValue, SecondSolve, Transition
from nmpcrl.learning.learners import (
    Learner,
    UpdateRule,
    Weights,
    gradient_td,
    semi_gradient,
    theta_bounds,
)
from nmpcrl.learning.updates import of_length


def frozen(nmpc: Controller) -> Learner:
    """The same exploration and the same noise, and theta never moves."""
    return Learner("frozen", nothing, lambda weights, *_: weights, nmpc.gamma)


def nothing(transition: Transition, theta: Vector) -> None:
    """A bootstrap that values no state, so that nothing is learned."""


def step_matched(nmpc: Controller, alpha: float, beta: float) -> Learner:
    """ES with steps as long as those of GES: it separates direction and length."""
    rule = as_far_as(gradient_td(alpha, beta, nmpc.gamma), semi_gradient(alpha))
    return Learner("matched", SecondSolve(nmpc), rule, nmpc.gamma, theta_bounds(nmpc))


def random_direction(nmpc: Controller, alpha: float, rng: np.random.Generator) -> Learner:
    """Steps as long as those of ES, in random directions.

    Args:
        nmpc: the controller.
        alpha: step size of ES.
        rng: draws the directions.
    """
    rule = as_far_as(semi_gradient(alpha), partial(_anywhere, rng))
    return Learner("random", SecondSolve(nmpc), rule, nmpc.gamma, theta_bounds(nmpc))


def as_far_as(length: UpdateRule, direction: UpdateRule) -> UpdateRule:
    """Move theta where one rule would, as far as the other would, which also moves w."""
    return partial(_as_far_as, length, direction)  # a copy of a closure shares what it draws from


def _as_far_as(
    length: UpdateRule,
    direction: UpdateRule,
    weights: Weights,
    delta: float,
    solution: Solution,
    successor: NextValue,
) -> Weights:
    moved = length(weights, delta, solution, successor)
    turned = direction(weights, delta, solution, successor)
    step = of_length(
        turned.theta - weights.theta, float(np.linalg.norm(moved.theta - weights.theta))
    )
    return Weights(weights.theta + step, moved.w)


def _anywhere(rng: np.random.Generator, weights: Weights, *_: object) -> Weights:
    return Weights(weights.theta + rng.normal(size=weights.theta.size), weights.w)

"""Control arms: what a learner is compared with, under the same noise.

| control | theta moves by                                                 |
|---------|----------------------------------------------------------------|
| frozen  | nothing                                                        |
| matched | the direction of ES, as far as GES would move                  |
| random  | a direction drawn uniformly, as far as ES would move           |
"""

from functools import partial
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.learning.bootstrap import Controller, NextValue, Transition
from nmpcrl.learning.learners import (
    Learner,
    UpdateRule,
    gradient_td,
    semi_gradient,
    two_solves,
)
from nmpcrl.learning.updates import of_length


def frozen(nmpc: Controller) -> Learner:
    """The same exploration and the same noise, and theta never moves."""
    return Learner("frozen", nothing, semi_gradient(0.0), nmpc.gamma)


def nothing(transition: Transition, theta: Vector) -> None:
    """A bootstrap that values no state, so that nothing is learned."""


def step_matched(nmpc: Controller, alpha: float, beta: float) -> Learner:
    """ES with steps as long as those of GES: it separates direction and length."""
    rule = as_far_as(gradient_td(alpha, beta, nmpc.gamma), semi_gradient(alpha))
    return two_solves("matched", nmpc, rule)


def random_direction(nmpc: Controller, alpha: float, rng: np.random.Generator) -> Learner:
    """Steps as long as those of ES, in random directions.

    Args:
        nmpc: the controller.
        alpha: step size of ES.
        rng: draws the directions.
    """
    rule = as_far_as(semi_gradient(alpha), UpdateRule(partial(_anywhere, rng)))
    return two_solves("random", nmpc, rule)


def as_far_as(length: UpdateRule, direction: UpdateRule) -> UpdateRule:
    """Move theta as far as `length` does, which has the memory, in the direction of another rule.

    That one has no memory.
    """
    step = partial(_as_far_as, length, direction)  # copies its rules; a closure would share a `rng`
    return UpdateRule(step, length.init, length.interrupted)


def _as_far_as(
    length: UpdateRule, direction: UpdateRule,
    theta: Vector, memory: Any, transition: Transition, delta: float, successor: NextValue,
) -> tuple[Vector, Any]:  # fmt: skip
    moved, after = length.step(theta, memory, transition, delta, successor)
    turned, _ = direction.step(theta, None, transition, delta, successor)
    return theta + of_length(turned - theta, float(np.linalg.norm(moved - theta))), after


def _anywhere(rng: np.random.Generator, theta: Vector, *_: Any) -> tuple[Vector, None]:
    return theta + rng.normal(size=theta.size), None

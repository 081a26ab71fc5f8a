"""Baselines that a learner is compared with, under the same noise.

| name    | theta moves by                                                 |
|---------|----------------------------------------------------------------|
| frozen  | nothing                                                        |
| matched | the direction of ES, as far as GES would move                  |
| random  | a direction drawn uniformly, as far as ES would move           |
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.learning.bootstrap import Transition
from nmpcrl.learning.learners import Learner, Move, UpdateRule, gradient_td, semi_gradient
from nmpcrl.learning.updates import of_length


def frozen(nmpc: Nmpc) -> Learner:
    """No learning: theta stays, under the same noise."""
    return Learner("frozen", nothing, semi_gradient(0.0), nmpc.gamma)


def nothing(transition: Transition, theta: Vector) -> None:
    """A bootstrap without a value, which skips every learning step."""


def step_matched(nmpc: Nmpc, alpha: float, beta: float) -> Learner:
    """ES with steps as long as those of GES: it separates direction and length."""
    rule = as_far_as(gradient_td(alpha, beta, nmpc.gamma), semi_gradient(alpha))
    return Learner.of("matched", nmpc, rule)


def random_direction(nmpc: Nmpc, alpha: float, rng: np.random.Generator) -> Learner:
    """Steps as long as those of ES, in directions that `rng` draws."""
    rule = as_far_as(semi_gradient(alpha), UpdateRule(partial(_anywhere, rng)))
    return Learner.of("random", nmpc, rule)


def as_far_as(length: UpdateRule, direction: UpdateRule) -> UpdateRule:
    """Move theta as far as `length` does, in the direction of a rule without memory."""
    # copies the steps with the rule; a closure would share a generator among copies
    return replace(length, step=partial(_as_far_as, length.step, direction.step))


def _as_far_as(
    length: Move, direction: Move, theta: Vector, memory: Any, *given: Any
) -> tuple[Vector, Any]:
    moved, after = length(theta, memory, *given)
    turned, _ = direction(theta, None, *given)
    return theta + of_length(turned - theta, float(np.linalg.norm(moved - theta))), after


def _anywhere(rng: np.random.Generator, theta: Vector, *_: Any) -> tuple[Vector, None]:
    return theta + rng.normal(size=theta.size), None

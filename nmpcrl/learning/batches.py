"""Rules that move theta by the mean of several steps: k of them, or those of an episode.

A step adds its statistics to sums in the memory. When a batch is full, an estimate is made of their
means, and an optimiser moves theta.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from nmpcrl import Vector
from nmpcrl.learning.bootstrap import Controller, NextValue, Transition
from nmpcrl.learning.learners import Learner, Weights, theta_bounds, two_solves, unchanged
from nmpcrl.learning.optimisers import Bounds, GaussNewton, Optimiser

Statistics = tuple[Any, ...]  # arrays


class Batch(NamedTuple):
    """The memory of a `Batched` rule."""

    steps: int  # since theta was moved
    sums: Statistics  # of their statistics; empty before the first
    optimiser: Any


def means_themselves(*means: Any) -> Statistics:
    """The estimate of a batch whose statistics are gradients."""
    return means


@dataclass(frozen=True, eq=False)
class Batched:
    """An `UpdateRule` that moves theta by the mean statistics of a batch."""

    sample: Callable[[Transition, float], Statistics]  # of a step and its TD error
    optimiser: Optimiser
    every: int | None = None  # steps of a batch; those of an episode if None
    estimate: Callable[..., Statistics] = means_themselves  # of means: gradient[, curvature]

    interrupted = staticmethod(unchanged)

    def __post_init__(self) -> None:
        if self.every is not None and self.every < 1:
            raise ValueError(f"every = {self.every} must be at least 1, or None for an episode")

    def init(self, weights: Weights) -> Batch:
        """An empty batch."""
        return Batch(0, (), self.optimiser.init(weights.theta))

    def step(
        self, theta: Vector, memory: Batch, transition: Transition, delta: float, _: NextValue
    ) -> tuple[Vector, Batch]:
        """Add to the sums; move theta and begin anew where the batch is full."""
        found, count = self.sample(transition, delta), memory.steps + 1
        sums = tuple(map(np.add, memory.sums, found)) if memory.sums else found
        if not (transition.last if self.every is None else count == self.every):
            return theta, Batch(count, sums, memory.optimiser)
        estimate = self.estimate(*(one / count for one in sums))
        theta, optimiser = self.optimiser.step(theta, memory.optimiser, *estimate)
        return theta, Batch(0, (), optimiser)


def batch_semi_gradient(optimiser: Optimiser, every: int | None = None) -> Batched:
    """The mean of the semi-gradients, -delta phi, is what the optimiser descends.

    Args:
        optimiser: `Descent`, with momentum or without, or `Adam`.
        every: steps of a batch; those of an episode if absent.
    """
    return Batched(lambda one, delta: (-delta * one.solution.features,), optimiser, every)


def lstd_q(
    nmpc: Controller,
    alpha: float = 1.0,
    *,
    every: int | None = None,
    regularisation: float = 1e-3,
    curvature: bool = False,
    bounds: Bounds | None = None,
    optimiser: Optimiser | None = None,
) -> Learner:
    """LSTD-Q: a Gauss-Newton step on the squared TD errors of a batch, targets held.

    g = -mean(delta phi), H = mean(phi phi' [- delta d^2 Q / dtheta^2]), and `GaussNewton` moves
    theta, within its bounds. For a value that is linear in theta, a step with alpha = 1 is the
    least-squares fit of the batch. Q is the action value proper: `train` solves for it.

    Source: Gros and Zanon (2020); Esfahani et al. (2021).

    Args:
        nmpc: the controller.
        alpha: the part of the step that is gone.
        every: steps of a batch; those of an episode if absent.
        regularisation: added to the diagonal of H.
        curvature: whether H has the Hessian of Q, which dense algebra makes at every step.
        bounds: the least and the largest theta; those of a `Problem` if absent.
        optimiser: of g and H, such as `TrustRegion`; `GaussNewton` with the arguments above if
            absent.
    """

    def sample(transition: Transition, delta: float) -> Statistics:
        phi = transition.solution.features
        hessian = np.outer(phi, phi)
        if curvature:
            hessian = hessian - delta * nmpc.value_hessian(transition.solution)
        return -delta * phi, hessian

    bounds = bounds or theta_bounds(nmpc)
    rule = Batched(sample, optimiser or GaussNewton(alpha, regularisation, bounds), every)
    return two_solves("LSTD-Q", nmpc, rule, bounds, values_actions=True)

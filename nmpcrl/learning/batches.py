"""Rules that move theta by the mean of several steps: k of them, or those of an episode.

A step adds its statistics to sums in the memory. When a batch is full, an estimate is made of their
means, and an optimiser moves theta.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from nmpcrl import Vector
from nmpcrl.learning.bootstrap import Controller, NextValue, Transition
from nmpcrl.learning.learners import Learner, UpdateRule, Weights, theta_bounds, two_solves
from nmpcrl.learning.optimisers import Bounds, GaussNewton, Optimiser

Statistics = tuple[Any, ...]  # arrays


class Batch(NamedTuple):
    """The memory of a `batched` rule."""

    steps: int  # since theta was moved
    sums: Statistics  # of their statistics; empty before the first
    optimiser: Any


def means_themselves(*means: Any) -> Statistics:
    """The estimate of a batch whose statistics are gradients."""
    return means


def batched(
    sample: Callable[[Transition, float], Statistics],
    optimiser: Optimiser,
    every: int | None = None,
    estimate: Callable[..., Statistics] = means_themselves,
) -> UpdateRule:
    """A rule that moves theta by the mean statistics of a batch.

    Args:
        sample: the statistics of a transition with its TD error.
        optimiser: moves theta.
        every: steps of a batch; those of an episode if absent.
        estimate: a gradient, and a curvature if the optimiser takes one, from the means.
    """
    if every is not None and every < 1:
        raise ValueError(f"every = {every} must be at least 1, or None for an episode")
    step = partial(_batched, sample, optimiser, every, estimate)
    return UpdateRule(step, partial(_empty, optimiser))


def _empty(optimiser: Optimiser, weights: Weights) -> Batch:
    return Batch(0, (), optimiser.init(weights.theta))


def _batched(
    sample: Any, optimiser: Optimiser, every: int | None, estimate: Any,
    theta: Vector, memory: Batch, transition: Transition, delta: float, _: NextValue,
) -> tuple[Vector, Batch]:  # fmt: skip
    """Add to the sums; move theta and begin anew where the batch is full."""
    found, count = sample(transition, delta), memory.steps + 1
    sums = tuple(map(np.add, memory.sums, found)) if memory.sums else found
    if not (transition.last if every is None else count == every):
        return theta, Batch(count, sums, memory.optimiser)
    theta, after = optimiser.step(theta, memory.optimiser, *estimate(*(s / count for s in sums)))
    return theta, Batch(0, (), after)


def td_gradient(transition: Transition, delta: float) -> Statistics:
    """-delta phi, the semi-gradient of the squared TD error, halved."""
    return (-delta * transition.solution.features,)


def td_curvature(curved: Controller | None, transition: Transition, delta: float) -> Statistics:
    """-delta phi and phi phi', less delta d^2 Q / dtheta^2 where a controller knows the Hessian."""
    phi = transition.solution.features
    hessian = np.outer(phi, phi)
    if curved is not None:
        hessian = hessian - delta * curved.value_hessian(transition.solution)
    return -delta * phi, hessian


def batch_semi_gradient(optimiser: Optimiser, every: int | None = None) -> UpdateRule:
    """The mean of the semi-gradients, -delta phi, is what the optimiser descends.

    Args:
        optimiser: `Descent`, with momentum or without, or `Adam`.
        every: steps of a batch; those of an episode if absent.
    """
    return batched(td_gradient, optimiser, every)


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
    bounds = bounds or theta_bounds(nmpc)
    sample = partial(td_curvature, nmpc if curvature else None)
    rule = batched(sample, optimiser or GaussNewton(alpha, regularisation, bounds), every)
    return two_solves("LSTD-Q", nmpc, rule, bounds, values_actions=True)

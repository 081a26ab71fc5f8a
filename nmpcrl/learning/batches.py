"""Rules that move theta by the mean of several steps: k of them, or those of an episode.

A step adds its statistics to sums in the memory. When a batch is full, an estimate is made of their
means, and an optimiser moves theta.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from nmpcrl import Vector
from nmpcrl.learning.bootstrap import NextValue, Transition
from nmpcrl.learning.learners import Learner, UpdateRule, Weights, theta_bounds
from nmpcrl.learning.optimisers import Bounds, GaussNewton, Optimiser

Statistics = tuple[Any, ...]  # arrays


class Batch(NamedTuple):
    """The memory of a `batched` rule."""

    steps: int = 0  #: since theta was moved
    sums: Statistics = ()  #: of their statistics; empty before the first


def batched(
    sample: Callable[[Transition, float], Statistics],
    optimiser: Optimiser,
    every: int | None = None,
    estimate: Callable[..., Statistics] | None = None,
) -> UpdateRule:
    """A rule that moves theta by the mean statistics of a batch.

    Args:
        sample: the statistics of a transition with its TD error.
        optimiser: moves theta.
        every: steps of a batch; those of an episode if absent.
        estimate: the gradient and the curvature from the means, which are just these if absent.
    """
    if every is not None and every < 1:
        raise ValueError(f"every = {every} must be at least 1, or None for an episode")
    return UpdateRule(partial(_batched, sample, optimiser, every, estimate), _empty)


def _empty(weights: Weights) -> Batch:
    return Batch()


def _batched(
    sample: Any, optimiser: Optimiser, every: int | None, estimate: Any,
    theta: Vector, memory: Batch, transition: Transition, delta: float, _: NextValue,
) -> tuple[Vector, Batch]:  # fmt: skip
    """Add to the sums; move theta and begin anew where the batch is full."""
    found, count = sample(transition, delta), memory.steps + 1
    sums = tuple(map(np.add, memory.sums, found)) if memory.sums else found
    if not (transition.last if every is None else count == every):
        return theta, Batch(count, sums)
    means = tuple(total / count for total in sums)
    return optimiser(theta, *(estimate(*means) if estimate else means)), Batch()


def td_statistics(transition: Transition, delta: float) -> Statistics:
    """-delta phi and phi phi': gradient and curvature of the squared TD error, halved."""
    phi = transition.solution.features
    return -delta * phi, np.outer(phi, phi)


def lstd_q(
    nmpc: Any,
    alpha: float = 1.0,
    *,
    every: int | None = None,
    regularisation: float = 1e-3,
    bounds: Bounds | None = None,
    stride: float = np.inf,
    optimiser: Optimiser | None = None,
) -> Learner:
    """LSTD-Q: a Gauss-Newton step on the squared TD errors of a batch, targets held.

    g = -mean(delta phi), H = mean(phi phi'), and `GaussNewton` moves theta, within its bounds. For
    a value that is linear in theta, a step with alpha = 1 is the least-squares fit of the batch. Q
    is the action value proper: `train` solves for it.

    Source: Gros and Zanon (2020); Esfahani et al. (2021).

    Args:
        nmpc: the controller.
        alpha: the part of the step that is gone.
        every: steps of a batch; those of an episode if absent.
        regularisation: added to the diagonal of H.
        bounds: the least and the largest theta; those of a `Problem` if absent.
        stride: of `GaussNewton`, with the start of an entry for its scale, or 1 if that is 0; an
            entry that is no part of the plan, as V0, goes freely.
        optimiser: of g and H, such as `TrustRegion`; `GaussNewton` with the arguments above if
            absent.
    """
    bounds = bounds or theta_bounds(nmpc)
    scale = nmpc.problem.theta_sizes if stride < np.inf else 1.0
    own = optimiser or GaussNewton(alpha, regularisation, bounds, stride, scale)
    rule = batched(td_statistics, own, every)
    return Learner.of("LSTD-Q", nmpc, rule, bounds=bounds, values_actions=True)

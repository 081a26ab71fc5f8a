"""Optimisers: how far theta goes, given the gradient and the curvature of what it goes down."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from nmpcrl import Matrix, Vector
from nmpcrl.control.vectors import step_size

Bounds = tuple[Vector | float, Vector | float]  # the least and the largest theta
Optimiser = Callable[[Vector, Vector, Matrix], Vector]  # theta, gradient, curvature -> theta
ROUNDING = 1e-12  # of a matrix that is added to it before it is factorised
HALVINGS = 60  # of the interval in which the multiplier of a trust region lies
LEAST = 1e-12  # curvature in a trust region, in parts of the largest


@dataclass(frozen=True)
class Descent:
    """theta - alpha g: gradient descent, whatever the curvature is."""

    alpha: float

    def __post_init__(self) -> None:
        step_size("alpha", self.alpha)

    def __call__(self, theta: Vector, gradient: Vector, curvature: Matrix) -> Vector:
        return theta - self.alpha * gradient


@dataclass(frozen=True, eq=False)
class GaussNewton:
    """theta + p, where p is least in alpha g'p + p'H p / 2 and theta + p within the bounds.

    H is the curvature, shape (d, d), plus `regularisation` on its diagonal, and as much more as
    makes it positive definite. Without bounds p = -alpha H^-1 g. A projection of that p would be no
    minimum. A curvature that is not finite gives an infinite theta, which `train` calls diverged.
    With a `stride`, an entry moves by no more than this part of the larger of itself and `scale`.
    """

    alpha: float = 1.0
    regularisation: float = 1e-3  #: in the unit of the curvature
    bounds: Bounds | None = None
    stride: float = np.inf
    scale: Vector | float = 1.0  # a typical size of each entry

    def __call__(self, theta: Vector, gradient: Vector, curvature: Matrix) -> Vector:
        if not np.isfinite(curvature).all():
            return np.full_like(theta, np.inf)
        least = float(np.linalg.eigvalsh(curvature)[0])
        L = _factor(curvature, self.regularisation + max(0.0, -least))
        slope = np.linalg.solve(L, -self.alpha * gradient)
        p: Vector = np.linalg.solve(L.T, slope)
        if self.bounds or self.stride < np.inf:
            most = self.stride * np.maximum(np.abs(theta), self.scale)
            low, high = self.bounds or (-np.inf, np.inf)
            p = _within(p, L, slope, np.maximum(low - theta, -most), np.minimum(high - theta, most))
        return theta + p


@dataclass(frozen=True, eq=False)
class TrustRegion:
    """theta + p, where p is least in g'p + p'H p / 2 and ||p / scale|| at most `radius`.

    Where the region binds, (H + mu S^-2) p = -g with the mu > 0 that puts p on its edge; H may be
    indefinite. Where it is not finite, theta is infinite.  Source: Moré and Sorensen (1983).
    """

    radius: float
    scale: Vector  #: a typical change of each component of theta, shape (d,)

    def __call__(self, theta: Vector, gradient: Vector, curvature: Matrix) -> Vector:
        if not np.isfinite(curvature).all():
            return np.full_like(theta, np.inf)
        values, basis = np.linalg.eigh(curvature * np.outer(self.scale, self.scale))
        slope = basis.T @ (self.scale * gradient)
        return theta - self.scale * (basis @ self._within(values, slope))

    def _within(self, values: Vector, slope: Vector) -> Vector:
        """slope / (values + mu) with the least mu >= 0 that makes it convex and short enough."""
        floor = LEAST * max(1.0, float(np.abs(values).max()))
        low = max(0.0, floor - float(values[0]))
        if np.linalg.norm(slope / (values + low)) <= self.radius:
            return np.asarray(slope / (values + low))
        high = low + float(np.linalg.norm(slope)) / self.radius
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            short = np.linalg.norm(slope / (values + middle)) <= self.radius
            low, high = (low, middle) if short else (middle, high)
        return np.asarray(slope / (values + high))


def _factor(H: Matrix, more: float) -> Any:
    """The Cholesky factor of H with `more` on its diagonal, or with what rounding takes of H."""
    I: Matrix = np.eye(len(H))
    try:
        return np.linalg.cholesky(H + more * I)
    except np.linalg.LinAlgError:  # `more` is lost beside the largest number of H
        return np.linalg.cholesky(H + (more + ROUNDING * np.abs(H).sum()) * I)


def _within(p: Vector, L: Matrix, slope: Vector, lower: Vector, upper: Vector) -> Vector:
    """The p in [lower, upper] with the least ||L'p - slope||; `p` is the least of all."""
    if ((lower <= p) & (p <= upper)).all():
        return p
    free = lower < upper  # a bound that holds theta in place leaves nothing to choose
    fixed = np.where(free, 0.0, lower)
    found: Vector = fixed.copy()
    if free.any():
        rest = slope - L.T @ fixed
        found[free] = lsq_linear(L.T[:, free], rest, (lower[free], upper[free]), "bvls").x
    return found

"""Optimisers: how far a step of theta goes, given a gradient and perhaps a curvature."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.optimize import lsq_linear

from nmpcrl import Matrix, Vector

Bounds = tuple[Vector, Vector]  # the least and the largest theta
ROUNDING = 1e-12  # of a matrix that is added to it before it is factorised
HALVINGS = 60  # of the interval in which the multiplier of a trust region lies
LEAST = 1e-12  # curvature in a trust region, in parts of the largest


class Optimiser(Protocol):
    """Moves theta downhill; its memory is an argument and a result of each step."""

    def init(self, theta: Vector) -> Any:
        """The memory before the first step."""

    def step(
        self, theta: Vector, memory: Any, gradient: Vector, curvature: Matrix | None = None
    ) -> tuple[Vector, Any]:
        """The next theta and memory; the curvature, shape (d, d), is for those of second order."""


@dataclass(frozen=True)
class Descent:
    """Gradient descent, with the momentum of a heavy ball where that is not 0.

    v <- momentum v - alpha g, theta <- theta + v.  Source: Polyak (1964).
    """

    alpha: float
    momentum: float = 0.0

    def init(self, theta: Vector) -> Vector:
        """v = 0."""
        return np.zeros_like(theta)

    def step(
        self, theta: Vector, memory: Vector, gradient: Vector, curvature: Matrix | None = None
    ) -> tuple[Vector, Vector]:
        """The two equations above."""
        velocity = self.momentum * memory - self.alpha * gradient
        return theta + velocity, velocity


class Moments(NamedTuple):
    """The memory of `Adam`."""

    mean: Vector  # m, of the gradients
    square: Vector  # v, of their squares
    steps: int = 0  # t


@dataclass(frozen=True)
class Adam:
    """Steps of about `alpha` in each component, whatever the size of the gradient.

    m <- b1 m + (1 - b1) g, v <- b2 v + (1 - b2) g^2,
    theta <- theta - alpha (m / (1 - b1^t)) / (sqrt(v / (1 - b2^t)) + epsilon).

    Source: Kingma and Ba (2014).
    """

    alpha: float
    b1: float = 0.9
    b2: float = 0.999
    epsilon: float = 1e-8

    def init(self, theta: Vector) -> Moments:
        """m = v = 0."""
        return Moments(np.zeros_like(theta), np.zeros_like(theta))

    def step(
        self, theta: Vector, memory: Moments, gradient: Vector, curvature: Matrix | None = None
    ) -> tuple[Vector, Moments]:
        """The three equations above."""
        t = memory.steps + 1
        m = self.b1 * memory.mean + (1 - self.b1) * gradient
        v = self.b2 * memory.square + (1 - self.b2) * gradient**2
        size = np.sqrt(v / (1 - self.b2**t)) + self.epsilon
        return theta - self.alpha * (m / (1 - self.b1**t)) / size, Moments(m, v, t)


class SecondOrder:
    """An optimiser without memory that minimises a model with the curvature H, shape (d, d)."""

    def init(self, theta: Vector) -> None:
        """No memory."""

    def step(
        self, theta: Vector, memory: None, gradient: Vector, curvature: Matrix | None = None
    ) -> tuple[Vector, None]:
        """theta + p with the p of the class.

        Raises:
            ValueError: there is no curvature.
        """
        if curvature is None:
            name = type(self).__name__
            raise ValueError(f"{name} needs a curvature, and this rule estimates none")
        if not np.isfinite(curvature).all():
            return np.full_like(theta, np.inf), None  # which `train` calls diverged
        return theta + self._change(theta, gradient, curvature), None

    def _change(self, theta: Vector, gradient: Vector, curvature: Matrix) -> Vector:
        """p."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class GaussNewton(SecondOrder):
    """theta + p, where p is least in alpha g'p + p'H p / 2 and theta + p within the bounds.

    H is the curvature plus `regularisation` on its diagonal, and as much more as makes it positive
    definite. Without bounds p = -alpha H^-1 g. A projection of that p would be no minimum.
    """

    alpha: float = 1.0
    regularisation: float = 1e-3  # in the unit of the curvature
    bounds: Bounds | None = None

    def _change(self, theta: Vector, gradient: Vector, curvature: Matrix) -> Vector:
        least = float(np.linalg.eigvalsh(curvature)[0])
        L = _factor(curvature, self.regularisation + max(0.0, -least))
        slope = np.linalg.solve(L, -self.alpha * gradient)
        p = np.asarray(np.linalg.solve(L.T, slope))
        if self.bounds is None:
            return p
        return _within(p, L, slope, self.bounds[0] - theta, self.bounds[1] - theta)


@dataclass(frozen=True, eq=False)
class TrustRegion(SecondOrder):
    """theta + p, where p is least in g'p + p'H p / 2 and ||p / scale|| at most `radius`.

    Where the region binds, (H + mu S^-2) p = -g with the mu > 0 that puts p on its edge; H may be
    indefinite.  Source: Moré and Sorensen (1983).
    """

    radius: float
    scale: Vector  # a typical change of each component of theta, shape (d,)

    def _change(self, theta: Vector, gradient: Vector, curvature: Matrix) -> Vector:
        values, basis = np.linalg.eigh(curvature * np.outer(self.scale, self.scale))
        slope = basis.T @ (self.scale * gradient)
        return -self.scale * (basis @ self._within(values, slope))

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

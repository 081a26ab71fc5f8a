"""How far a step goes, given a gradient: what rules with a memory hand their estimates to."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.optimize import lsq_linear

from nmpcrl import Matrix, Vector

Bounds = tuple[Vector, Vector]  # the least and the largest theta
ROUNDING = 1e-12  # of a matrix that is added to it before it is factorised


class Optimiser(Protocol):
    """Moves theta downhill; what it remembers goes in and comes out."""

    def init(self, theta: Vector) -> Any:
        """The memory before the first step."""

    def step(
        self, memory: Any, theta: Vector, gradient: Vector, curvature: Matrix | None = None
    ) -> tuple[Vector, Any]:
        """The next theta and memory; only `GaussNewton` asks for the curvature, shape (d, d)."""


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
        self, memory: Vector, theta: Vector, gradient: Vector, curvature: Matrix | None = None
    ) -> tuple[Vector, Vector]:
        """The two equations above."""
        velocity = self.momentum * memory - self.alpha * gradient
        return theta + velocity, velocity


class Moments(NamedTuple):
    """What `Adam` remembers."""

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
        self, memory: Moments, theta: Vector, gradient: Vector, curvature: Matrix | None = None
    ) -> tuple[Vector, Moments]:
        """The three equations above."""
        t = memory.steps + 1
        m = self.b1 * memory.mean + (1 - self.b1) * gradient
        v = self.b2 * memory.square + (1 - self.b2) * gradient**2
        size = np.sqrt(v / (1 - self.b2**t)) + self.epsilon
        return theta - self.alpha * (m / (1 - self.b1**t)) / size, Moments(m, v, t)


@dataclass(frozen=True, eq=False)
class GaussNewton:
    """theta + p, where p is least in alpha g'p + p'H p / 2 and theta + p within the bounds.

    H is the curvature plus `regularisation` on its diagonal, and as much more as makes it positive
    definite. Without bounds p = -alpha H^-1 g. A projection of that p would be no minimum.
    """

    alpha: float = 1.0
    regularisation: float = 1e-3  # in the unit of the curvature
    bounds: Bounds | None = None

    def init(self, theta: Vector) -> None:
        """It remembers nothing."""

    def step(
        self, memory: None, theta: Vector, gradient: Vector, curvature: Matrix | None = None
    ) -> tuple[Vector, None]:
        """The minimiser.

        Raises:
            ValueError: there is no curvature.
        """
        if curvature is None:
            raise ValueError("GaussNewton needs a curvature, and this rule estimates none")
        if not np.isfinite(curvature).all():
            return np.full_like(theta, np.inf), None  # which `train` calls diverged
        least = float(np.linalg.eigvalsh(curvature)[0])
        L = _factor(curvature, self.regularisation + max(0.0, -least))
        slope = np.linalg.solve(L, -self.alpha * gradient)
        p: Any = np.linalg.solve(L.T, slope)
        if self.bounds is not None:
            p = _within(p, L, slope, self.bounds[0] - theta, self.bounds[1] - theta)
        return theta + p, None


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

"""How obstacles move within an episode, and what a controller foretells of it.

A motion is a function of the time in seconds, defined before the start, too. A predictor says
where the obstacles of a plan's stages will be, by what can be known at its first.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nmpcrl import Vector
from nmpcrl.control.nmpc import HORIZON
from nmpcrl.study.parameters import refused

PERIOD = 0.2  # [s] of a step
Point = tuple[float, float]
Motion = Callable[[Vector], Vector]  # times [s], shape (k,) -> centres [m], shape (k, 2)
Predictor = Callable[[Sequence[Motion], int, int], Vector]


@dataclass(frozen=True)
class Straight:
    """Constant velocity; standing still where that is 0."""

    centre: Point  # at the start [m]
    velocity: Point = (0.0, 0.0)  # [m/s]

    def __call__(self, seconds: Vector) -> Vector:
        """Its centre at these times."""
        return _row(self.centre) + np.multiply.outer(seconds, self.velocity)


@dataclass(frozen=True)
class Sinusoidal:
    """To and fro: centre + reach sin(2 pi t / period + phase)."""

    centre: Point  # of the motion [m]
    reach: Point  # from the centre to a turning point [m]
    period: float  # [s]
    phase: float = 0.0  # at the start [rad]

    def __call__(self, seconds: Vector) -> Vector:
        """Its centre at these times."""
        swing = np.sin(2 * np.pi * np.asarray(seconds) / self.period + self.phase)
        return _row(self.centre) + np.multiply.outer(swing, self.reach)


@dataclass(frozen=True)
class Polynomial:
    """To and fro on the graph of a polynomial p over an axis: DynaBARN's kind.

    centre + along s + across p(s), |s| <= 1, where s runs at constant speed and turns at the ends.
    Source: Nair et al. (2022), from the description.
    """

    centre: Point  # [m]
    along: Point  # half of the axis [m]; p is in units of its length, across it
    coefficients: tuple[float, ...]  # of p, that of 1 first
    speed: float  # on the axis [m/s]
    phase: float = 0.0  # s at the start, on the way up

    def __call__(self, seconds: Vector) -> Vector:
        """Its centre at these times."""
        way = np.asarray(seconds) * self.speed / np.hypot(*self.along) + self.phase
        s = 1 - np.abs((way + 1) % 4 - 2)  # up to 1, down to -1, and up again
        height = np.polynomial.polynomial.polyval(s, self.coefficients)
        across = (-self.along[1], self.along[0])
        turned = np.multiply.outer(s, self.along) + np.multiply.outer(height, across)
        moved: Vector = _row(self.centre) + turned
        return moved


KINDS: dict[str, Callable[..., Motion]] = {
    "straight": Straight, "sinusoidal": Sinusoidal, "polynomial": Polynomial,
}  # fmt: skip


def centres(motions: Sequence[Motion], times: ArrayLike) -> Vector:
    """Where the obstacles are at some steps of an episode, shape (k, M, 2)."""
    seconds = PERIOD * np.atleast_1d(np.asarray(times, float))
    return np.stack([motion(seconds) for motion in motions], axis=1)


def still(layout: Sequence[Point]) -> tuple[Motion, ...]:
    """Obstacles that stay where they are."""
    return tuple(Straight((float(x), float(y))) for x, y in layout)


def known(motions: Sequence[Motion], t: int, horizon: int = HORIZON) -> Vector:
    """The motion itself, over the horizon, shape (N + 1, M, 2)."""
    return centres(motions, np.arange(t, t + horizon + 1))


def extrapolated(motions: Sequence[Motion], t: int, horizon: int = HORIZON) -> Vector:
    """The velocity since the step before, kept: exact where it is constant."""
    before, now = centres(motions, [t - 1, t])
    ahead: Vector = now + np.multiply.outer(np.arange(horizon + 1), now - before)
    return ahead


def frozen(motions: Sequence[Motion], t: int, horizon: int = HORIZON) -> Vector:
    """The obstacles stay where they are now."""
    return np.repeat(centres(motions, [t]), horizon + 1, axis=0)


PREDICTORS: dict[str, Predictor] = {
    "known": known, "extrapolated": extrapolated, "frozen": frozen,
}  # fmt: skip

TURN = 20.0  # [s]: an episode has 26
ORDER = 3  # of the drawn polynomials, at most
STEEPEST = 0.5  # of the drawn coefficients


def draw(
    rng: np.random.Generator, kind: str, place: Point, *, speed: float, spread: float
) -> Motion:
    """A motion about a place.

    Args:
        rng: draws speed, direction, and the rest.
        kind: of `KINDS`.
        place: where a straight motion is halfway through an episode, and the centre of others [m].
        speed: mean of its normal law [m/s]; a negative draw counts by its size.
        spread: standard deviation of that law [m/s].

    Raises:
        ParameterError: there is no such kind.
    """
    v, angle = abs(rng.normal(speed, spread)), rng.uniform(0, 2 * np.pi)
    direction = np.array([np.cos(angle), np.sin(angle)])
    phase = rng.uniform(-1, 1)
    if kind == "straight":
        at_start = np.asarray(place) - TURN / 2 * v * direction
        return Straight(_rounded(at_start), _rounded(v * direction))
    if kind == "sinusoidal":
        reach = v * TURN / 4 * direction  # so that v is the mean speed
        return Sinusoidal(place, _rounded(reach), TURN, round(np.pi * phase, 3))
    if kind == "polynomial":
        p = rng.uniform(-STEEPEST, STEEPEST, rng.integers(1, ORDER + 1) + 1)
        axis = max(v * TURN / 4, 0.5) * direction
        return Polynomial(place, _rounded(axis), _rounded(p), round(v, 3), round(phase, 3))
    raise refused("kind", kind, f"one of {', '.join(KINDS)}")


def _row(point: Point) -> Vector:
    return np.asarray(point, float)


def _rounded(values: Any) -> Any:
    """Plain numbers with three digits behind the point, so that what is kept is what moves."""
    return tuple(round(float(one), 3) for one in values)

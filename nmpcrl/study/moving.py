"""The robot's task among moving obstacles as a `Problem`, and the environment that has them.

    min   sum_i gamma^i (||theta_x (x_i - s_ref)||^2 + ||theta_u u_i||^2 + omega' sigma_i) + ...
    s.t.  Xi(x_i, o_i) + theta_c <= sigma_i

This is Eq. (2) with centres o_i that are data of each stage, and a soft box; in the paper's layouts
it has the value of the paper's controller to seven digits. The value becomes V_theta(s, t): the TD
error is the one of the Markov chain with the time in its state if a second solve with the data of
t + 1 bootstraps it, and if the predictor is exact.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc, Problem
from nmpcrl.control.problem import Soft
from nmpcrl.control.task import Task, overlap
from nmpcrl.study import paper
from nmpcrl.study.faults import NONE, Fault, robot

TARGET, LOWER, UPPER = map(np.array, (paper.TARGET, paper.LOWER, paper.UPPER))
TASK: Task = replace(paper.task(), obstacles=())  # start, target, box and `charge` of the robot
CLEARANCE = 2.5  # d_rob + d_obs [m]
PERIOD = 0.2  # [s] of a step
STAGES = np.arange(paper.HORIZON + 1)  # of a plan
Point = tuple[float, float]
Motion = Callable[[Vector], Vector]  # times [s], shape (k,) -> centres [m], shape (k, 2)
Predictor = Callable[[Sequence[Motion], int], Vector]  # (motions, t) -> shape (N + 1, M, 2)


@dataclass(frozen=True)
class Straight:
    """Motion at constant velocity; standing still at velocity 0."""

    centre: Point  #: at the start [m]
    velocity: Point = (0.0, 0.0)  #: [m/s]

    def __call__(self, seconds: Vector) -> Vector:
        return np.asarray(self.centre, float) + np.multiply.outer(seconds, self.velocity)


@dataclass(frozen=True)
class Sinusoidal:
    """Oscillation: centre + reach sin(2 pi t / period + phase)."""

    centre: Point  #: of the motion [m]
    reach: Point  #: from the centre to a turning point [m]
    period: float  #: [s]
    phase: float = 0.0  #: at the start [rad]

    def __call__(self, seconds: Vector) -> Vector:
        swing = np.sin(2 * np.pi * np.asarray(seconds) / self.period + self.phase)
        return np.asarray(self.centre, float) + np.multiply.outer(swing, self.reach)


@dataclass(frozen=True)
class Polynomial:
    """Motion to and fro on the graph of a polynomial p over an axis: Nair et al. (2022), DynaBARN.

    centre + along s + across p(s), |s| <= 1, where s runs at constant speed and turns at the ends.
    """

    centre: Point  #: [m]
    along: Point  #: half of the axis [m]; p is across it, in units of its length
    coefficients: tuple[float, ...]  #: of p, the constant first
    speed: float  #: on the axis [m/s]
    phase: float = 0.0  #: s at the start, on the way up

    def __call__(self, seconds: Vector) -> Vector:
        way = np.asarray(seconds) * self.speed / np.hypot(*self.along) + self.phase
        s = 1 - np.abs((way + 1) % 4 - 2)  # up to 1, down to -1, and up again
        height = np.polynomial.polynomial.polyval(s, self.coefficients)
        across = (-self.along[1], self.along[0])
        turned: Vector = np.multiply.outer(s, self.along) + np.multiply.outer(height, across)
        return np.asarray(self.centre, float) + turned


KINDS: dict[str, Callable[..., Motion]] = {
    "straight": Straight, "sinusoidal": Sinusoidal, "polynomial": Polynomial,
}  # fmt: skip


def centres(motions: Sequence[Motion], times: ArrayLike) -> Vector:
    """The centres of the obstacles at some steps of an episode, shape (k, M, 2)."""
    seconds = PERIOD * np.atleast_1d(np.asarray(times, float))
    return np.stack([motion(seconds) for motion in motions], axis=1)


def still(layout: Sequence[Point]) -> tuple[Motion, ...]:
    """The obstacles of a layout, standing still."""
    return tuple(Straight((float(x), float(y))) for x, y in layout)


def known(motions: Sequence[Motion], t: int) -> Vector:
    """The true centres at the stages of the plan of step t, shape (N + 1, M, 2)."""
    return centres(motions, t + STAGES)


def extrapolated(motions: Sequence[Motion], t: int) -> Vector:
    """The velocity of the last step, continued; exact where the velocity is constant."""
    before, now = centres(motions, [t - 1, t])
    ahead: Vector = now + np.multiply.outer(STAGES, now - before)
    return ahead


def frozen(motions: Sequence[Motion], t: int) -> Vector:
    """The present centres, at all stages."""
    return np.repeat(centres(motions, [t]), len(STAGES), axis=0)


PREDICTORS: dict[str, Predictor] = {"known": known, "extrapolated": extrapolated, "frozen": frozen}


def square(terms: Any, size: int) -> Any:
    """The squared norm of `size` expressions."""
    return sum(terms[i] ** 2 for i in range(size))


def transition(x: Any, u: Any, *_: Any) -> Any:
    """The robot's model."""
    return robot().transition(x, u)


def diagonal(x: Any, th: Any, *_: Any) -> Any:
    """The paper's terminal cost."""
    return square(th["f"] * (x - TARGET), 3)


def problem(
    obstacles: int = 4,
    *,
    model: Callable[..., Any] = transition,
    terminal: Callable[..., Any] = diagonal,
    further: Mapping[str, Any] = MappingProxyType({}),
) -> Problem:
    """Eq. (2) among obstacles whose centres are data; `further` parameters end theta."""
    first = np.array(paper.THETA_INIT)
    theta: dict[str, Any] = {"x": first[:3], "u": first[3:5], "f": first[5:8], "c": first[8]}

    def discs(x: Any, _: Any, th: Any, d: Any) -> Any:
        at = d["centres"]
        return [overlap(x[0], x[1], at[j, 0], at[j, 1], CLEARANCE) + th["c"]
                for j in range(obstacles)]  # fmt: skip

    def walls(x: Any, *_: Any) -> Any:
        return [side for i in (0, 1) for side in (x[i] - UPPER[i], LOWER[i] - x[i])]

    return Problem(
        states=3, inputs=2, horizon=paper.HORIZON, gamma=paper.GAMMA, theta=theta | dict(further),
        model=model, terminal=terminal,
        stage=lambda x, u, th, _: square(th["x"] * (x - TARGET), 3) + square(th["u"] * u, 2),
        soft=[Soft(discs, paper.SLACK_WEIGHT), Soft(walls, paper.SLACK_WEIGHT, slice(1, None))],
        lower=robot().lower, upper=robot().upper, data={"centres": np.zeros((obstacles, 2))},
    )  # fmt: skip


@cache
def controller(obstacles: int = 4) -> Nmpc:
    """The NMPC of `problem`, compiled once."""
    return Nmpc(problem(obstacles))


def charge(state: Vector, action: Vector, at: Matrix) -> float:
    """Eq. (20) among obstacles at some centres, shape (M, 2), to the last bit of `stage_cost`."""
    cost = TASK.stage_cost(state, action)
    if TASK.distance(state) < TASK.near:
        return cost
    x, y = state[:2].tolist()
    entered = (overlap(x, y, cx, cy, CLEARANCE) + TASK.margin for cx, cy in at.tolist())
    return cost + float(TASK.penalty * sum(max(0.0, one) for one in entered))


def inside(states: Matrix, motions: Sequence[Motion]) -> NDArray[np.bool_]:
    """Whether the robot is in each obstacle at each step, Xi > 0, shape (K + 1, M)."""
    at = centres(motions, np.arange(len(states)))
    away = states[:, None, :2] - at
    found: NDArray[np.bool_] = (away**2).sum(axis=2) < (CLEARANCE / 2) ** 2
    return found


@dataclass(eq=False)
class World:
    """Plant, start and data of `train` and `evaluate`, with a clock, for one run at a time."""

    motions: Sequence[Motion]  #: of the obstacles
    predict: Predictor = known  #: one of `PREDICTORS`
    _: KW_ONLY
    fault: Fault = NONE  #: the difference between plant and model
    seen: Sequence[Motion] = ()  #: motions that the controller predicts, by default `motions`

    def __post_init__(self) -> None:
        self.states: list[Vector] = []  # of the episode so far, without noise
        self._at = centres(self.motions, np.arange(paper.STEPS + 1))
        self._data: dict[int, dict[str, Matrix]] = {}
        self.environment: dict[str, Any] = {  # keyword arguments of `train` and `evaluate`
            "plant": self.step, "start": self.begin, "data": self.data,
        }  # fmt: skip

    def begin(self, rng: np.random.Generator) -> Vector:
        """Set the clock to 0, draw the fault of the episode, and return the measured start."""
        self._gain, self._inputs = self.fault.gain(rng), np.zeros(2)
        self.states = [np.array(paper.START)]
        return self.fault.measure(self.states[0], rng)

    def step(
        self, _: Vector, action: Vector, rng: np.random.Generator
    ) -> tuple[Vector, float, bool]:
        """The next state as measured, and the charge of the true state."""
        state, at = self.states[-1], self._at[len(self.states) - 1]
        self._inputs = self.fault.follow(self._inputs, action)
        self.states.append(self.fault.step(state, self._gain @ self._inputs))
        return self.fault.measure(self.states[-1], rng), charge(state, action, at), False

    def data(self, t: int) -> dict[str, Matrix]:
        """The predicted centres at the stages of a plan that begins at t."""
        if t not in self._data:
            self._data[t] = {"centres": self.predict(self.seen or self.motions, t)}
        return self._data[t]

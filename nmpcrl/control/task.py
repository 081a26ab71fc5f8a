"""The task: where to go, what to avoid, and the cost that reinforcement learning minimises."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from nmpcrl import Vector
from nmpcrl.control.codegen.jit import callable_of
from nmpcrl.control.content import Described
from nmpcrl.control.plant import Plant
from nmpcrl.control.problem import Problem, Soft
from nmpcrl.control.vectors import box, spread

NO_DATA = np.zeros(0)


class Theta(NamedTuple):
    """The blocks of theta, in the paper's order: (stage, inputs, terminal, constraint)."""

    x: Any  #: vartheta_x, square roots of the state weights, shape (n,)
    u: Any  #: vartheta_u, square roots of the input weights, shape (m,)
    f: Any  #: vartheta_f, square roots of the terminal weights, shape (n,)
    c: Any  #: theta_c, tightens the obstacle constraint, shape (1,)

    @classmethod
    def split(cls, theta: Any, n: int, m: int) -> "Theta":
        """Cut a vector of 2n + m + 1 numbers or symbols into its blocks."""
        return cls(theta[:n], theta[n : n + m], theta[n + m : 2 * n + m], theta[2 * n + m :])


def stage_cost(state: ca.SX, action: ca.SX, theta: Theta, target: Vector | ca.SX) -> ca.SX:
    """L(s, u, theta) of Eq. (2a): ||s - s_ref||^2 and ||u||^2, weighted by theta squared."""
    result: ca.SX = ca.sumsqr(theta.x * (state - target)) + ca.sumsqr(theta.u * action)
    return result


def terminal_cost(state: ca.SX, theta: Theta, target: Vector | ca.SX) -> ca.SX:
    """Gamma(s, theta) of Eq. (2a): ||s - s_ref||^2, weighted by theta squared."""
    result: ca.SX = ca.sumsqr(theta.f * (state - target))
    return result


@dataclass(frozen=True)
class Obstacle:
    """A disc that the robot keeps away from: Eq. (19)."""

    x: float  #: centre [m]
    y: float  #: centre [m]
    diameter: float = 2.0  #: d_obs [m]

    def __post_init__(self) -> None:
        if not np.isfinite([self.x, self.y]).all():
            raise ValueError(f"obstacle centre ({self.x}, {self.y}) must be finite")
        if not 0 < self.diameter < np.inf:
            raise ValueError(f"obstacle diameter {self.diameter} must be a positive length")


@dataclass(frozen=True, eq=False)
class Task(Described):
    """Go from `start` to `target` within a box and around the obstacles, at the cost of Eq. (20).

    A heading is not wrapped: 3.1 and -3.1 rad count as 6.2 rad apart. Give start and target
    headings less than half a turn apart; a `Problem` can weigh 2 (1 - cos(e)) in place of e^2.
    """

    start: Vector  #: s_0, shape (n,)
    target: Vector  #: s_ref, shape (n,); the reference input is 0
    lower: Vector  #: box on the state, shape (n,); -inf where free
    upper: Vector  #: shape (n,)
    obstacles: tuple[Obstacle, ...] = ()
    weights: Vector = field(default_factory=lambda: np.array([1.0, 1.0, 0.1]))  #: diagonal of Q
    robot_diameter: float = 0.5  #: d_rob [m]
    near: float = 1.5  #: d_t, closer than this the input is charged instead of the obstacles
    margin: float = 0.35  # d_o: the penalty begins this much before Xi = 0  # departure N
    penalty: float = 50.0  #: c of Upsilon
    soft_box: bool = False  # leaving the box is priced as obstacles are  # departure M
    target_may_lie_outside: bool = False  #: only to show what the paper's printed box does

    def __post_init__(self) -> None:
        shape = np.shape(self.start)
        for name in ("start", "target", "lower", "upper", "weights"):
            value = spread(f"task.{name}", getattr(self, name), shape, "a state")
            object.__setattr__(self, name, value)
        box("task.", self.lower, self.upper, self.start.size, "a state")
        for name in ("robot_diameter", "near", "margin", "penalty"):
            if not 0 <= getattr(self, name) < np.inf:
                raise ValueError(f"task.{name} = {getattr(self, name)} must be 0 or more")
        self._refuse_outside("start")
        if not self.target_may_lie_outside:
            self._refuse_outside("target")
        object.__setattr__(self, "obstacles", tuple(self.obstacles))
        if self.obstacles and self.start.size < 2:
            raise ValueError("obstacles stand in a plane: a task with one state has none")

    def _refuse_outside(self, name: str) -> None:
        point = getattr(self, name)
        if not np.isfinite(point).all():
            raise ValueError(f"task.{name} = {point} must be finite")
        for i in np.flatnonzero((point < self.lower) | (point > self.upper)):
            sides = f"[{self.lower[i]:g}, {self.upper[i]:g}]"
            raise ValueError(f"{name} {np.round(point, 2)} is outside the box {sides} in state {i}")

    def problem(self, plant: Plant, horizon: int, gamma: float, slack_weight: float) -> Problem:
        """Eq. (2): theta holds x, u and f, the square roots of the weights, and c of Eq. (2f).

        One compilation serves all targets, boxes, layouts and horizons of a plant.
        """
        soft: list[Soft] = []
        hard: dict[str, Any] = {}
        data = {"target": self.target}
        sides = [
            (k, sign, float(limit[k]))
            for sign, limit in ((-1, self.lower), (1, self.upper))
            for k in np.flatnonzero(np.isfinite(limit)).tolist()
        ]
        if not self.soft_box:
            hard = {"state_lower": self.lower, "state_upper": self.upper}
        elif sides:
            soft.append(Soft(lambda x, *_: [s * (x[k] - at) for k, s, at in sides], slack_weight,
                             slice(1, None)))  # fmt: skip
        if plant.n > 1:
            data["discs"] = np.reshape(np.transpose(self.discs), (-1, 3))
            soft.append(
                Soft(
                    lambda x, u, th, d: overlap(x[0], x[1], *ca.vertsplit(d["discs"])) + th["c"],
                    slack_weight,
                    each="discs",
                )
            )
        return Problem(
            states=plant.n,
            inputs=plant.m,
            horizon=horizon,
            gamma=gamma,
            theta={"x": np.ones(plant.n), "u": np.ones(plant.m), "f": np.ones(plant.n), "c": 0.0},
            model=lambda x, u, *_: plant.transition(x, u),
            stage=lambda x, u, th, d: stage_cost(x, u, Theta(**th), d["target"]),
            terminal=lambda x, th, d: terminal_cost(x, Theta(**th), d["target"]),
            soft=soft,
            lower=plant.lower,
            upper=plant.upper,
            data=data,
            **hard,
        )

    def overlap(self, state: Any) -> Any:
        """Xi of Eq. (19), one value an obstacle: positive inside, 1 at the centre.

        Takes a state of shape (n,) and returns shape (M,), or states (..., n) and (..., M).
        """
        if not self.obstacles:
            return np.zeros((*np.shape(state)[:-1], 0))
        state = np.asarray(state)[..., None]
        return overlap(state[..., 0, :], state[..., 1, :], *self.discs)

    @property
    def discs(self) -> tuple[Vector, Vector, Vector]:
        """Centres x and y, and d_rob + d_obs, of the obstacles; shape (M,) each."""
        x, y, d = (
            np.array([getattr(o, k) for o in self.obstacles]) for k in ("x", "y", "diameter")
        )
        return x, y, d + self.robot_diameter

    def distance(self, state: Vector) -> float:
        """Euclidean distance to the target over all states, ||s - s_ref||_2."""
        return float(np.linalg.norm(state - self.target))

    def collision_penalty(self, state: Vector) -> float:
        """Upsilon of Eq. (20): c times how far each obstacle's margin is entered."""
        return float(self.penalty * np.maximum(0, self.overlap(state) + self.margin).sum())

    def stage_cost(self, state: Vector, action: Vector) -> float:
        """The RL stage cost l(s, a), Eq. (20)."""
        inputs = len(action)
        if inputs not in self._charges:
            self._charges[inputs] = callable_of(self.charge(inputs), scalar=True)
        return self._charges[inputs](state, action, NO_DATA)

    @cached_property
    def _charges(self) -> dict[int, Callable[..., float]]:
        """The same as machine code, by the number of inputs."""
        return {}

    def charge(self, inputs: int) -> ca.Function:
        """Eq. (20) in symbols, as a CasADi function of the state and so many inputs."""
        state, action = ca.SX.sym("state", self.start.size), ca.SX.sym("action", inputs)
        total = ca.sum1(self.entered(state, *map(ca.DM, self.discs)))
        cost = self.cost_of(state, action, self.target, total)
        given = [state, action, ca.SX.sym("data", 0)]
        return ca.Function("charge", given, [cost], ["state", "action", "data"], ["cost"])

    def entered(self, state: ca.SX, x: Any, y: Any, clearance: Any) -> ca.SX:
        """How far the margins of discs are entered, in Xi."""
        plane = state if state.numel() > 1 else ca.vertcat(state, 0)  # where no obstacle stands
        found: ca.SX = ca.fmax(0, overlap(plane[0], plane[1], x, y, clearance) + self.margin)
        return found

    def cost_of(self, state: ca.SX, action: ca.SX, target: Any, total: Any) -> ca.SX:
        """Eq. (20) in symbols, for any target and a total of what is `entered`."""
        away = state - target
        near = ca.norm_2(away) < self.near
        far: ca.SX = self.penalty * total
        cost: ca.SX = ca.dot(self.weights, away**2) + ca.if_else(near, ca.norm_2(action), far)
        return cost


def overlap(x: Any, y: Any, centre_x: Any, centre_y: Any, clearance: Any) -> Any:
    """Xi of Eq. (19) for numbers, arrays and CasADi expressions alike; dimensionless."""
    return 1 - 4 * ((x - centre_x) ** 2 + (y - centre_y) ** 2) / clearance**2

"""The plant: continuous dynamics, discretised by Runge-Kutta 4, with bounds on its inputs."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Vector
from nmpcrl.control.codegen.jit import callable_of
from nmpcrl.control.content import Described
from nmpcrl.control.expression import expression
from nmpcrl.control.vectors import box, integer

Dynamics = Callable[[ca.SX, ca.SX], ca.SX]


def unicycle(state: ca.SX, action: ca.SX) -> ca.SX:
    """Time derivative of (x, y, heading) under (speed, turn rate): Eq. (17)."""
    heading, speed, turn_rate = state[2], action[0], action[1]
    return ca.vertcat(speed * ca.cos(heading), speed * ca.sin(heading), turn_rate)


def rk4(dynamics: Dynamics, state: ca.SX, action: ca.SX, period: float, substeps: int = 1) -> ca.SX:
    """One Runge-Kutta 4 step of length `period` [s] with the action held, Eq. (18); or several."""
    if substeps > 1:
        for _ in range(substeps):
            state = rk4(dynamics, state, action, period / substeps)
        return state
    k1 = dynamics(state, action)
    k2 = dynamics(state + period / 2 * k1, action)
    k3 = dynamics(state + period / 2 * k2, action)
    k4 = dynamics(state + period * k3, action)
    return state + period / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


@dataclass(frozen=True, eq=False)
class Plant(Described):
    """A plant that is sampled every `period` seconds.

    Where a task has obstacles, the first two states are its position. A mass that is pushed::

        Plant(
            lambda state, push: ca.vertcat(state[2:], push),
            ("x [m]", "y [m]", "v_x [m/s]", "v_y [m/s]"),
            ("a_x [m/s2]", "a_y [m/s2]"),
            lower=-np.ones(2),
            upper=np.ones(2),
        )
    """

    dynamics: Dynamics  #: d state / dt as a CasADi expression of (state, action)
    state_names: tuple[str, ...]  #: with units, as an axis shows them, ("x [m]", ...)
    action_names: tuple[str, ...]  #: with units
    lower: Vector  #: smallest action, shape (m,)
    upper: Vector  #: largest action, shape (m,)
    period: float = 0.2  #: [s]
    substeps: int = 1  #: Runge-Kutta steps a period, more where the dynamics are faster than it

    def __post_init__(self) -> None:
        lower, upper = box("plant.", self.lower, self.upper, self.m, "an input")
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)
        if not self.n:
            raise ValueError("a plant needs a state: state_names is empty")
        if not 0 < self.period < np.inf:
            raise ValueError(f"plant.period = {self.period} must be a positive number of seconds")
        integer("plant.substeps", self.substeps)
        _ = self._derivative  # refused here, and not where it is first used

    def __getstate__(self) -> dict[str, Any]:
        """The fields, with the dynamics as an expression: a function need not have a name."""
        return super().__getstate__() | {"dynamics": self._derivative}

    @property
    def n(self) -> int:
        """Number of states."""
        return len(self.state_names)

    @property
    def m(self) -> int:
        """Number of inputs."""
        return len(self.action_names)

    @cached_property
    def _symbols(self) -> dict[str, ca.SX]:
        return {"state": ca.SX.sym("state", self.n), "action": ca.SX.sym("action", self.m)}

    @cached_property
    def _derivative(self) -> ca.Function:
        """The dynamics, which may have been written as a list."""
        given = (*self._symbols.values(),)
        written = expression("dynamics", self.dynamics, given, self._symbols, self.n, "state")
        return ca.Function("dynamics", given, [written])

    @cached_property
    def transition(self) -> ca.Function:
        """The discrete dynamics f(state, action) of Eq. (18), as a CasADi function."""
        state, action = self._symbols.values()
        later = rk4(self._derivative, state, action, self.period, self.substeps)
        return ca.Function("f", [state, action], [later], ["state", "action"], ["later"])

    @cached_property
    def step(self) -> Callable[[Vector, Vector], Vector]:
        """(state, action) -> the state one period later, shape (n,): Eq. (18)."""
        return callable_of(self.transition)

    def clip(self, action: Vector) -> Vector:
        """The nearest action within the bounds, shape (m,)."""
        return np.minimum(np.maximum(action, self.lower), self.upper)


def differential_drive(period: float = 0.2) -> Plant:
    """The paper's robot: `unicycle` with |speed| <= 0.6 m/s and |turn rate| <= pi/2 rad/s."""
    bound = np.array([0.6, np.pi / 2])
    return Plant(
        dynamics=unicycle,
        state_names=("x [m]", "y [m]", "heading [rad]"),
        action_names=("speed [m/s]", "turn rate [rad/s]"),
        lower=-bound,
        upper=bound,
        period=period,
    )

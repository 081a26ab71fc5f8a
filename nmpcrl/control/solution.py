"""The result of a solve: a `Solution`, or a `SolverError`."""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.ocp import Ocp


class SolverError(RuntimeError):
    """No optimum was found; carries the solver's status, the state and theta."""

    def __init__(self, status: str, state: Vector, theta: Vector) -> None:
        super().__init__(f"{status}, in state {short(state)} with theta {short(theta)}")
        self.status = status
        self.state = state
        self.theta = theta

    def __reduce__(self) -> tuple[type, tuple[str, Vector, Vector]]:
        return type(self), (self.status, self.state, self.theta)


class DerivativeError(SolverError):
    """The optimum has no derivative in theta, though its value has a gradient."""


class Status(StrEnum):
    """How an optimum was found."""

    SOLVED = "solved"
    RESTARTED = "restarted"  #: from another start, since the first one failed
    TAKEN_OVER = "taken over"  #: by another solver, since the chosen one found no optimum


@dataclass(frozen=True, eq=False)
class Multipliers:
    """The multipliers of Eq. (2), with CasADi's signs."""

    initial: Vector  #: of (2b), shape (n,)
    dynamics: Matrix  #: of (2c), shape (N, n)
    states: Matrix  #: of the box (2d), shape (N + 1, n); negative at a lower bound
    inputs: Matrix  #: of the input bounds (2e), shape (N, m); negative at a lower bound
    obstacles: Matrix  #: of (2f), shape (N + 1, M); between 0 and omega gamma^i
    slacks: Matrix  #: of sigma >= 0, shape (N + 1, M); never positive
    action: Vector  #: of u_0 = a, shape (m,); shape (0,) when u_0 is free


@dataclass(frozen=True, eq=False)
class Solution:
    """An optimum of Eq. (2) for one state and one theta.

    Where no plan can keep to the box, riccati returns the one that leaves it least: `violation`
    says by how much, `value` is Eq. (2a) along it, and `features` is the gradient of that value
    together with W times how far the box is left, at a fixed W. So outside of a hard box the two
    belong to two functions, and W, the larger of 10^4 max(1, theta^2) and 100 omega, depends on
    theta itself. The price of a `soft_box` is part of `value`, and `features` is its gradient.
    """

    state: Vector  #: s, shape (n,)
    theta: Vector  #: shape (2n + m + 1,)
    value: float  #: V_theta(s), or Q_theta(s, a) when u_0 was fixed; without a hard box's charge
    features: Vector  #: phi, the value's gradient in theta, shape (2n + m + 1,)
    iterations: int  #: of the solver
    seconds: float  #: wall time of the solve and the gradient [s]
    point: Vector  #: z, lam and nu, one after the other, each in the order of `ocp`
    ocp: Ocp  #: says where each part lies
    solver: str  #: the name of the solver that found it
    data: Matrix  #: d_0, ..., d_N, shape (N + 1, size)
    restarts: int = 0  #: how often the solver had to begin again
    violation: float = 0.0  #: how far the plan leaves the box, in the unit of the state
    took_over: bool = False  #: whether `solver` is another than the chosen one

    @property
    def status(self) -> Status:
        """Whether the requested solver and start succeeded."""
        if self.took_over:
            return Status.TAKEN_OVER
        return Status.RESTARTED if self.restarts else Status.SOLVED

    @property
    def parameters(self) -> Vector:
        """p of `ocp`."""
        action = self.action[: self.ocp.fixed_action.size]
        return np.concatenate([self.state, self.theta, action, self.data.ravel()])

    @property
    def primal(self) -> Vector:
        """The variables z."""
        return self.point[: self.ocp.lower.size]

    @property
    def constraint_duals(self) -> Vector:
        """The multipliers lam of the constraints."""
        return self.point[self.ocp.lower.size : -self.ocp.lower.size]

    @property
    def bound_duals(self) -> Vector:
        """The multipliers nu of the bounds on z."""
        return self.point[-self.ocp.lower.size :]

    @cached_property
    def states(self) -> Matrix:
        """Predicted x_0, ..., x_N, shape (N + 1, n)."""
        return self.primal[self.ocp.states]

    @cached_property
    def inputs(self) -> Matrix:
        """Planned u_0, ..., u_{N-1}, shape (N, m)."""
        return self.primal[self.ocp.inputs]

    @cached_property
    def slacks(self) -> Matrix:
        """sigma_0, ..., sigma_N, one column an obstacle, shape (N + 1, M)."""
        return self.primal[self.ocp.slacks]

    @property
    def action(self) -> Vector:
        """The policy of Eq. (4), u_0, or the action that was fixed; shape (m,)."""
        result: Vector = self.point.take(self.ocp.inputs[0])
        return result

    @property
    def next_action(self) -> Vector:
        """What the plan does next, u_1, or u_0 when the horizon is 1; shape (m,)."""
        result: Vector = self.point.take(self.ocp.inputs[min(1, len(self.ocp.inputs) - 1)])
        return result

    @cached_property
    def multipliers(self) -> Multipliers:
        """The multipliers, sorted by constraint."""
        ocp, lam, nu = self.ocp, self.constraint_duals, self.bound_duals
        return Multipliers(
            initial=lam[ocp.initial],
            dynamics=lam[ocp.dynamics],
            states=nu[ocp.states],
            inputs=nu[ocp.inputs],
            obstacles=lam[ocp.obstacles],
            slacks=nu[ocp.slacks],
            action=lam[ocp.fixed_action],
        )


def short(vector: Vector) -> str:
    """A vector as a message shows it, on one line with four digits."""
    return np.array2string(np.asarray(vector), precision=4, max_line_width=1000)


def check_shape(warm_start: Solution, ocp: Ocp) -> None:
    """Refuse a warm start from a problem with another horizon, plant or number of obstacles."""
    old = warm_start.ocp
    if old.states.shape != ocp.states.shape or old.slacks.shape != ocp.slacks.shape:
        raise ValueError(
            f"the warm start has states of shape {old.states.shape} and slacks of shape"
            f" {old.slacks.shape}; this problem's are {ocp.states.shape} and {ocp.slacks.shape}"
        )

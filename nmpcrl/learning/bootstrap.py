"""Where the value of the next state comes from: a second solve, or a network that imitates one."""

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Solution

if TYPE_CHECKING:
    from nmpcrl.learning.network import QNetwork


@dataclass(frozen=True, eq=False)
class Transition:
    """One step of the plant, and the NMPC's solution that led to it."""

    state: Vector  # s, shape (n,)
    action: Vector  # a, the action applied, noise included, shape (m,)  # departure Q
    cost: float  # l(s, a)
    next_state: Vector  # s+, shape (n,)
    solution: Solution  # of the NMPC in s: its value is Q_theta(s, a)  # departure F


@dataclass(frozen=True, eq=False)
class Successor:
    """What is known of the next state."""

    value: float  # Q(s+, a+)
    features: Vector | None = None  # phi+, shape (d,); None from a network
    solution: Solution | None = None  # of the second solve, a warm start for the next first one
    loss: float = np.nan  # of the network's last fit in this step
    seconds: float = 0.0  # spent on fit and prediction [s]; a solve keeps its own time


class Controller(Protocol):
    """All that learning asks of control: `nmpcrl.control.Nmpc`, or anything that acts like it."""

    @property
    def gamma(self) -> float:
        """The discount factor of the value."""

    def solve(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None = None,
        action: Vector | None = None,
    ) -> Solution:
        """See `nmpcrl.control.Nmpc.solve`."""

    def value_hessian_times(self, solution: Solution, vector: Vector) -> Vector:
        """See `nmpcrl.control.Nmpc.value_hessian_times`; only exact TDC asks for it."""


class Bootstrap(Protocol):
    """Anything that values the next state of a transition."""

    def __call__(self, transition: Transition, theta: Vector) -> Successor | None:
        """Value `transition.next_state` under `theta`; None if there is nothing to go by yet."""


@dataclass(frozen=True)
class SecondSolve:
    """Solve the NMPC again in the next state, Eq. (7): ES and GES."""

    nmpc: Controller

    def __call__(self, transition: Transition, theta: Vector) -> Successor:
        """Start from the first solution, shifted by a stage.

        Raises:
            SolverError: no optimum was found.
        """
        solution = self.nmpc.solve(transition.next_state, theta, transition.solution)
        return Successor(solution.value, solution.features, solution)


@dataclass(frozen=True)
class Imitation:
    """A network learns the NMPC's value, Eq. (10), and predicts the next one, Eq. (11).

    It is that of DES, and of RDES if theta is an input.
    """

    network: "QNetwork"  # learns in place
    with_theta: bool  # whether theta is an input
    gated: bool = True  # wait for the first fit; Algorithm 1 read literally does not  # departure G
    fits: int = 1  # mini-batches a step  # departure H

    def __call__(self, transition: Transition, theta: Vector) -> Successor | None:
        """Remember (s, a[, theta]) -> Q, fit, and predict Q(s+, a+) with a+ = u_1 of the plan."""
        began = time.perf_counter()
        solution = transition.solution
        self.network.remember(  # departure R
            self.inputs(transition.state, transition.action, solution.theta), solution.value
        )
        if self.gated and not self.network.ready:
            return None
        loss = np.nan
        if self.network.ready:
            for _ in range(self.fits):
                loss = self.network.fit()
        inputs = self.inputs(transition.next_state, solution.next_action, theta)
        value = float(self.network.predict(inputs))
        return Successor(value, loss=loss, seconds=time.perf_counter() - began)

    def inputs(self, state: Vector, action: Vector, theta: Vector) -> Vector:
        """The network's inputs: (s, a, theta) for RDES, (s, a) for DES.  # departure I"""
        return np.concatenate([state, action, theta] if self.with_theta else [state, action])

"""Where the value of the next state comes from: a second solve, or a network that imitates one."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc, Solution

if TYPE_CHECKING:
    from nmpcrl.learning.network import Predictor, QNetwork, Target

FIRST, NEXT = 15, 5  # points a side of the grids of `minimiser`
ROUNDS = 4  # of the grids after the first; the last has a spacing of 1/112 of the box's half width


@dataclass(frozen=True, eq=False)
class Transition:
    """One step of the plant, and the NMPC's solution that led to it."""

    state: Vector  #: s, shape (n,)
    action: Vector  # a, the action applied, noise included, shape (m,)  # departure Q
    cost: float  #: l(s, a)
    next_state: Vector  #: s+, shape (n,)
    solution: Solution  # of the NMPC in s: its value is Q_theta(s, a)  # departure F
    end: bool = False  #: whether s+ is terminal, and worth 0
    last: bool = False  #: whether it is the last of its episode, for whatever reason
    next_data: Mapping[str, Any] | None = None  #: data of a `Problem` for a solve in s+
    first: bool = False  #: whether it is the first of its episode


@dataclass(frozen=True, eq=False)
class NextValue:
    """The value that a bootstrap gives to the next state."""

    value: float  #: Q(s+, a+)
    features: Vector | None = None  #: phi+, shape (d,); None from a network
    solution: Solution | None = None  #: of the second solve, a warm start for the next first one
    loss: float = np.nan  #: of the network's last fit in this step
    seconds: float = 0.0  #: spent on fit and prediction [s]; a solve keeps its own time


#: values `transition.next_state` under theta; None skips the learning step
Bootstrap = Callable[[Transition, Vector], NextValue | None]


@dataclass(frozen=True)
class SecondSolve:
    """Solve the NMPC again in the next state, Eq. (7): ES and GES."""

    nmpc: Nmpc

    def __call__(self, transition: Transition, theta: Vector) -> NextValue:
        """Start from the first solution, shifted by a stage."""
        if transition.end:
            return NextValue(0.0, np.zeros(theta.size))
        known: Any = {} if transition.next_data is None else {"data": transition.next_data}
        solution = self.nmpc.solve(transition.next_state, theta, transition.solution, **known)
        return NextValue(solution.value, solution.features, solution)


@dataclass(frozen=True)
class Imitation:
    """A network learns the NMPC's value, Eq. (10), and predicts the next one, Eq. (11): (R)DES.

    RDES has theta among the network's inputs. A gated bootstrap gives no value before the first
    fit of the network that predicts: `network`, or `target` where there is one.
    """

    network: "QNetwork"  #: learns in place
    with_theta: bool  #: whether theta is an input
    gated: bool = True  # wait for the first fit; Algorithm 1 read literally does not  # departure G
    fits: int = 1  # mini-batches a step  # departure H
    target: "Target | None" = None  # predicts in the network's place  # departure I
    late: bool = False  # predict before the fits, as if they ran in parallel  # departure I
    actions: tuple[Vector, Vector] | None = None  # bounds within which a+ is best  # departure I

    def __call__(self, transition: Transition, theta: Vector) -> NextValue | None:
        """Remember (s, a[, theta]) -> Q, fit, and predict Q(s+, a+); a+ = u_1 of the plan."""
        began, solution, loss = time.perf_counter(), transition.solution, np.nan
        example = self.inputs(transition.state, transition.action, solution.theta)
        self.network.remember(example, solution.value)  # departure R
        value = self._predict(transition, theta) if self.late else None
        if self.network.ready:
            for _ in range(self.fits):
                loss = self.network.fit()
            if self.target:
                self.target.follow()
        if not self.late:
            value = self._predict(transition, theta)
        if value is None:
            return None
        value = 0.0 if transition.end else value
        return NextValue(value, loss=loss, seconds=time.perf_counter() - began)

    def _predict(self, transition: Transition, theta: Vector) -> float | None:
        """Q(s+, a+); None while a gated bootstrap waits for the first fit."""
        predictor = self.target or self.network
        if self.gated and not predictor.fitted:
            return None
        state, action = transition.next_state, transition.solution.next_action
        if self.actions:
            action = self._best(predictor, state, theta)
        return float(predictor.predict(self.inputs(state, action, theta)))

    def _best(self, predictor: "Predictor", state: Vector, theta: Vector) -> Vector:
        """The action whose predicted value is least."""
        assert self.actions
        lower, upper = self.actions
        inputs = self.inputs(state, lower, theta)
        where = slice(state.size, state.size + lower.size)

        def values(actions: Matrix) -> Vector:
            rows = np.tile(inputs, (len(actions), 1))
            rows[:, where] = actions
            return predictor.predict(rows)

        return minimiser(values, lower, upper)

    def inputs(self, state: Vector, action: Vector, theta: Vector) -> Vector:
        """The network's inputs: (s, a, theta) for RDES, (s, a) for DES.  # departure I"""
        return np.concatenate([state, action, theta] if self.with_theta else [state, action])


def minimiser(values: Callable[[Matrix], Vector], lower: Vector, upper: Vector) -> Vector:
    """The point of a box in which a function of many points, (points, m), is least.

    A grid covers the box; each further one covers the cells around the best point so far.
    """
    best, half = (lower + upper) / 2, (upper - lower) / 2
    for side in (FIRST, *[NEXT] * ROUNDS):
        points = np.minimum(np.maximum(best + half * _grid(side, len(best)), lower), upper)
        best = points[values(points).argmin()]
        half = half * (2 / (side - 1))  # the spacing of this grid
    return best


@cache
def _grid(side: int, m: int) -> Matrix:
    """The points of a grid of [-1, 1]^m, shape (side^m, m)."""
    return np.array([*product(np.linspace(-1, 1, side), repeat=m)])

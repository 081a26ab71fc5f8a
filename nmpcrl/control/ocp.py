"""The optimal control problem, Eq. (2), in symbols: `transcribe` turns a task into an NLP.

The decision variables are ordered by stage, z = (x_0, u_0, sigma_0, ..., x_N, sigma_N), and so are
the constraints. That order is the block structure which a structure-exploiting solver needs.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from nmpcrl import Vector
from nmpcrl.control.plant import Plant
from nmpcrl.control.problem import SMALL, Problem
from nmpcrl.control.task import Task, overlap

Indices = NDArray[np.int_]

TIE = 1e-6  # a start this close to an obstacle's boundary is on it, not in it  # departure L


class Theta(NamedTuple):
    """The blocks of theta, in the paper's order: (stage, inputs, terminal, constraint)."""

    stage: Any  # vartheta_x, square roots of the state weights, shape (n,)
    inputs: Any  # vartheta_u, square roots of the input weights, shape (m,)
    terminal: Any  # vartheta_f, square roots of the terminal weights, shape (n,)
    constraint: Any  # theta_c, tightens the obstacle constraint, shape (1,)

    @classmethod
    def split(cls, theta: Any, n: int, m: int) -> "Theta":
        """Cut a vector of 2n + m + 1 numbers or symbols into its blocks."""
        return cls(theta[:n], theta[n : n + m], theta[n + m : 2 * n + m], theta[2 * n + m :])


def stage_cost(state: ca.SX, action: ca.SX, theta: Theta, target: Vector | ca.SX) -> ca.SX:
    """L(s, u, theta) of Eq. (2a): ||s - s_ref||^2 and ||u||^2, weighted by theta squared."""
    result: ca.SX = ca.sumsqr(theta.stage * (state - target)) + ca.sumsqr(theta.inputs * action)
    return result


def terminal_cost(state: ca.SX, theta: Theta, target: Vector | ca.SX) -> ca.SX:
    """Gamma(s, theta) of Eq. (2a): ||s - s_ref||^2, weighted by theta squared."""
    result: ca.SX = ca.sumsqr(theta.terminal * (state - target))
    return result


@dataclass(frozen=True, eq=False)
class Ocp(ABC):
    """An optimal control problem as an NLP: min f(z; p), lower <= z <= upper, g(z; p) = 0 or <= 0.

    The constraints g(z; p) are equalities where `equality` is true, and g <= 0 elsewhere.
    The parameter is p = (s, theta), then a where the first input is fixed, then data if there are.
    The index arrays say where in z and in g each part of the problem lies. M rows h <= sigma, the
    paper's obstacles, have a slack each.
    """

    gamma: float
    ties_active: bool  # whether a start on a row's boundary counts as beyond it  # departure L
    variables: ca.SX  # z
    parameters: ca.SX  # p
    theta: ca.SX  # the part of p that is learned
    objective: ca.SX  # Eq. (2a)
    constraints: ca.SX  # g
    equality: NDArray[np.bool_]
    lower: Vector
    upper: Vector
    states: Indices  # x_i in z, shape (N + 1, n)
    inputs: Indices  # u_i in z, shape (N, m)
    slacks: Indices  # sigma_i in z, shape (N + 1, M)
    initial: Indices  # Eq. (2b) in g, shape (n,)
    fixed_action: Indices  # u_0 = a in g, shape (m,), or (0,) when u_0 is free
    dynamics: Indices  # Eq. (2c) in g, shape (N, n)
    obstacles: Indices  # Eq. (2f) in g, shape (N + 1, M)

    @property
    def tie(self) -> float:
        """A start whose Xi + theta_c exceeds this is in the obstacle, not on its boundary.

        Of a `Problem`, in parts of a row's own size.
        """
        return -TIE if self.ties_active else TIE

    @cached_property
    def sizes(self) -> tuple[Vector, Vector]:
        """The units of z and of g, which are 1 where rows have none of their own."""
        return np.ones(self.lower.size), np.ones(self.equality.size)

    @property
    def cost_size(self) -> float:
        """The unit of the objective, and with it of the multipliers."""
        return 1.0

    @property
    def bound_prices(self) -> Vector:
        """What a unit beyond each bound on z costs, the most that its multiplier can be."""
        return np.full(self.lower.size, np.inf)

    @property
    @abstractmethod
    def slack_weights(self) -> Any:
        """The cost of a unit of each slack of stage 0, a number or shape (M,)."""

    @abstractmethod
    def settled(self, p: Vector) -> tuple[Any, Vector, Any]:
        """The rows of stage 0 that no plan can change: which of the M, h and the tie of those."""


@dataclass(frozen=True, eq=False)
class TaskOcp(Ocp):
    """Eq. (2) of the paper."""

    plant: Plant
    task: Task
    slack_weight: float

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as what it is transcribed from."""
        again = partial(transcribe, fix_action=self.fixed_action.size > 0,
                        ties_active=self.ties_active)  # fmt: skip
        return again, (self.plant, self.task, len(self.inputs), self.gamma, self.slack_weight)

    @property
    def slack_weights(self) -> float:
        """omega."""
        return self.slack_weight

    @property
    def bound_prices(self) -> Vector:
        """omega gamma^i of a box that may be left."""
        prices = super().bound_prices
        if self.task.soft_box:
            stages = np.arange(len(self.states))[:, None]
            prices[self.states] = self.slack_weight * self.gamma**stages
        return prices

    def settled(self, p: Vector) -> tuple[Any, Vector, Any]:
        """All of them: Xi(s) + theta_c."""
        n, last = self.plant.n, self.plant.n + self.theta.numel()
        return slice(None), self.task.overlap(p[:n]) + p[last - 1], self.tie


@dataclass(frozen=True, eq=False)
class ProblemOcp(Ocp):
    """A `Problem`."""

    problem: Problem

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as what it is transcribed from."""
        again = partial(transcribe_problem, fix_action=self.fixed_action.size > 0,
                        ties_active=self.ties_active)  # fmt: skip
        return again, (self.problem,)

    @property
    def slack_weights(self) -> Vector:
        """W, shape (M,)."""
        return self.problem.weights

    @cached_property
    def sizes(self) -> tuple[Vector, Vector]:
        """Slacks and rows in their `Problem.typical_row_sizes`."""
        z, g = np.ones(self.lower.size), np.ones(self.equality.size)
        z[self.slacks] = g[self.obstacles] = self.problem.typical_row_sizes
        return z, g

    @property
    def cost_size(self) -> float:
        """`Problem.cost_scale` where that is small."""
        size = self.problem.cost_scale
        return size if size < SMALL else 1.0

    def settled(self, p: Vector) -> tuple[Any, Vector, Any]:
        """Those without u; all where u_0 is fixed. One that does not hold there is at -1."""
        (which,) = np.nonzero(self.settled_rows)
        rows, sizes = (one.full().ravel()[which] for one in self._start_rows(p))
        return which, rows, self.tie * sizes

    @property
    def settled_rows(self) -> NDArray[np.bool_]:
        """Which rows of stage 0 no plan can change, shape (M,)."""
        fixed = self.fixed_action.size > 0
        return np.full(self.problem.weights.size, True) if fixed else ~self.problem.on_inputs

    @cached_property
    def _start_rows(self) -> ca.Function:
        of, fixed = self.problem, self.fixed_action.size
        ends = np.cumsum([0, of.states, of.names.size, fixed, of.data_names.size]).tolist()
        s, theta, a, d = (self.parameters[i:j] for i, j in pairwise(ends))
        e, given = of.expressions, a if fixed else ca.SX.zeros(of.inputs)
        rows = ca.Function("rows", [e.x, e.u, e.theta, e.d], [e.rows, of.row_sizes])
        h, sizes = rows(s, given, theta, d)
        held = ca.vertcat(ca.SX(0, 1), *(h[j] if on else -1 for j, on in enumerate(of.active[0])))
        return ca.Function("start_rows", [self.parameters], [ca.densify(held), sizes])


def transcribe(
    plant: Plant,
    task: Task,
    horizon: int,
    gamma: float,
    slack_weight: float,
    *,
    fix_action: bool,
    ties_active: bool = False,
) -> TaskOcp:
    """Write Eq. (2) by multiple shooting; with `fix_action`, add u_0 = a as a constraint.

    The box holds for the predicted states x_1, ..., x_N only: x_0 is given, and noise may have
    pushed it out.  # departure M
    Eq. (2f) of stage 0 is written in s rather than in x_0, its equal, so that the multipliers of
    the slacks that no plan can change stay out of the others.
    A fixed u_0 has no bounds of its own, or a = 0.6 m/s would leave the problem without interior.
    """
    n, m, count = plant.n, plant.m, len(task.obstacles)
    x = [ca.SX.sym(f"x_{i}", n) for i in range(horizon + 1)]
    u = [ca.SX.sym(f"u_{i}", m) for i in range(horizon)]
    sigma = [ca.SX.sym(f"sigma_{i}", count) for i in range(horizon + 1)]
    state, action = ca.SX.sym("s", n), ca.SX.sym("a", m if fix_action else 0)
    theta = ca.SX.sym("theta", 2 * n + m + 1)
    weights = Theta.split(theta, n, m)

    variables, constraints = _Stack(), _Stack()
    objective = ca.SX(0)
    for i in range(horizon + 1):
        last = i == horizon
        box = (task.lower, task.upper) if i > 0 else (-np.inf, np.inf)
        variables.add("states", x[i], *box)
        if not last:
            free = fix_action and i == 0
            bounds = (-np.inf, np.inf) if free else (plant.lower, plant.upper)
            variables.add("inputs", u[i], *bounds)
            constraints.add(
                "dynamics", x[i + 1] - plant.transition(x[i], u[i]), 0, 0
            )  # departure O
            objective += gamma**i * stage_cost(x[i], u[i], weights, task.target)
        else:
            objective += gamma**i * terminal_cost(x[i], weights, task.target)
        variables.add("slacks", sigma[i], 0, np.inf)
        objective += gamma**i * slack_weight * ca.sum1(sigma[i])
        if i == 0:
            constraints.add("initial", x[0] - state, 0, 0)
            constraints.add("fixed_action", (u[0] - action) if fix_action else ca.SX(0, 1), 0, 0)
        where = state if i == 0 else x[i]
        xi = [overlap(where[0], where[1], *disc) for disc in zip(*task.discs, strict=True)]
        tightened = ca.vertcat(ca.SX(0, 1), *xi) + weights.constraint
        constraints.add("obstacles", tightened - sigma[i], -np.inf, 0)

    return TaskOcp(
        plant=plant,
        task=task,
        slack_weight=slack_weight,
        parameters=ca.vertcat(state, theta, action),
        theta=theta,
        **_parts(variables, constraints, objective, gamma, ties_active),
    )


def transcribe_problem(
    problem: Problem, *, fix_action: bool, ties_active: bool = False
) -> ProblemOcp:
    """Write a `Problem` by multiple shooting; with `fix_action`, add u_0 = a as a constraint.

    As in `transcribe`, what concerns stage 0 alone is written in s, and in a where it is given. A
    row that does not hold at a stage is -1 <= sigma there.
    """
    e, N = problem.expressions, problem.horizon
    x = [ca.SX.sym(f"x_{i}", problem.states) for i in range(N + 1)]
    u = [ca.SX.sym(f"u_{i}", problem.inputs) for i in range(N)]
    sigma = [ca.SX.sym(f"sigma_{i}", problem.weights.size) for i in range(N + 1)]
    state = ca.SX.sym("s", problem.states)
    action = ca.SX.sym("a", problem.inputs if fix_action else 0)
    theta = ca.SX.sym("theta", problem.names.size)
    data = ca.SX.sym("d", problem.data_names.size, N + 1)

    path = ca.Function("path", [e.x, e.u, e.theta, e.d], [e.next_x, e.stage, e.rows])
    start = ca.Function("start", [e.x, e.theta, e.d], [e.initial])
    final = ca.Function("final", [e.x, e.theta, e.d], [e.terminal])
    variables, constraints = _Stack(), _Stack()
    objective = start(state, theta, data[:, 0])
    for i in range(N + 1):
        d, last, free = data[:, i], i == N, fix_action and i == 0
        variables.add("states", x[i], -np.inf, np.inf)
        where = state if i == 0 else x[i]
        given = ca.SX.zeros(problem.inputs) if last else action if free else u[i]
        _, _, rows = path(where, given, theta, d)
        if last:
            objective += problem.gamma**i * final(x[i], theta, d)
        else:
            bounds = (-np.inf, np.inf) if free else (problem.lower, problem.upper)
            variables.add("inputs", u[i], *bounds)
            next_x, cost, _ = path(x[i], u[i], theta, d)
            constraints.add("dynamics", x[i + 1] - next_x, 0, 0)
            objective += problem.gamma**i * cost
        variables.add("slacks", sigma[i], 0, np.inf)
        objective += problem.gamma**i * ca.dot(problem.weights, sigma[i])
        if i == 0:
            constraints.add("initial", x[0] - state, 0, 0)
            constraints.add("fixed_action", (u[0] - action) if fix_action else ca.SX(0, 1), 0, 0)
        held = ca.vertcat(
            ca.SX(0, 1), *(rows[j] if on else -1 for j, on in enumerate(problem.active[i]))
        )
        constraints.add("obstacles", held - sigma[i], -np.inf, 0)

    return ProblemOcp(
        problem=problem,
        parameters=ca.vertcat(state, theta, action, ca.vec(data)),
        theta=theta,
        **_parts(variables, constraints, objective, problem.gamma, ties_active),
    )


def _parts(
    variables: "_Stack", constraints: "_Stack", objective: ca.SX, gamma: float, ties_active: bool
) -> dict[str, Any]:
    """The fields of `Ocp` that follow from its stacks."""
    return {
        "gamma": gamma,
        "ties_active": ties_active,
        "variables": variables.expression,
        "objective": objective,
        "constraints": constraints.expression,
        "equality": constraints.lower == constraints.upper,
        "lower": variables.lower,
        "upper": variables.upper,
        "states": variables.where("states"),
        "inputs": variables.where("inputs"),
        "slacks": variables.where("slacks"),
        "initial": constraints.where("initial")[0],
        "fixed_action": constraints.where("fixed_action")[0],
        "dynamics": constraints.where("dynamics"),
        "obstacles": constraints.where("obstacles"),
    }


class _Stack:
    """Expressions put on top of each other, with their bounds and where each kind ended up."""

    def __init__(self) -> None:
        self._parts: list[ca.SX] = []
        self._bounds: list[tuple[Vector, Vector]] = []
        self._rows: dict[str, list[Indices]] = {}
        self._size = 0

    def add(self, kind: str, part: ca.SX, lower: Any, upper: Any) -> None:
        size = part.numel()
        self._parts.append(part)
        self._bounds.append((np.broadcast_to(lower, size), np.broadcast_to(upper, size)))
        self._rows.setdefault(kind, []).append(np.arange(self._size, self._size + size))
        self._size += size

    def where(self, kind: str) -> Indices:
        return np.array(self._rows[kind], dtype=int)

    @property
    def expression(self) -> ca.SX:
        return ca.vertcat(*self._parts)

    @property
    def lower(self) -> Vector:
        return np.concatenate([lower for lower, _ in self._bounds]).astype(float)

    @property
    def upper(self) -> Vector:
        return np.concatenate([upper for _, upper in self._bounds]).astype(float)

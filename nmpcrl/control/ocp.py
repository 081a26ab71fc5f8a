"""The optimal control problem in symbols: `transcribe` turns a `Problem` into an NLP.

The decision variables are ordered by stage, z = (x_0, u_0, sigma_0, ..., x_N, sigma_N), and so are
the constraints. That order is the block structure which a structure-exploiting solver needs.
"""

from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from nmpcrl import Vector
from nmpcrl.control.problem import SMALL, Problem

Indices = NDArray[np.int_]

TIE = 1e-6  # a start this close to an obstacle's boundary is on it, not in it  # departure L


@dataclass(frozen=True, eq=False)
class Ocp:
    """An optimal control problem as an NLP: min f(z; p), lower <= z <= upper, g(z; p) = 0 or <= 0.

    The constraints g(z; p) are equalities where `equality` is true, and g <= 0 elsewhere.
    The parameter is p = (s, theta), then a where the first input is fixed, then the data.
    The index arrays say where in z and in g each part of the problem lies. M rows h <= sigma, the
    paper's obstacles, have a slack each.
    """

    problem: Problem
    ties_active: bool  # whether a start on a row's boundary counts as beyond it  # departure L
    variables: ca.SX  #: z
    parameters: ca.SX  #: p
    theta: ca.SX  #: the part of p that is learned
    objective: ca.SX  #: Eq. (2a)
    constraints: ca.SX  #: g
    equality: NDArray[np.bool_]
    lower: Vector
    upper: Vector
    states: Indices  #: x_i in z, shape (N + 1, n)
    inputs: Indices  #: u_i in z, shape (N, m)
    slacks: Indices  #: sigma_i in z, shape (N + 1, M)
    initial: Indices  #: Eq. (2b) in g, shape (n,)
    fixed_action: Indices  #: u_0 = a in g, shape (m,), or (0,) when u_0 is free
    dynamics: Indices  #: Eq. (2c) in g, shape (N, n)
    obstacles: Indices  #: Eq. (2f) in g, shape (N + 1, M)
    hard: Indices  #: hard rows in g, shape (N + 1, H)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the problem, to be transcribed again."""
        again = partial(transcribe, fix_action=self.fixed_action.size > 0,
                        ties_active=self.ties_active)  # fmt: skip
        return again, (self.problem,)

    @property
    def tie(self) -> float:
        """A row of stage 0 counts as violated above this share of its size."""
        return -TIE if self.ties_active else TIE

    @cached_property
    def sizes(self) -> tuple[Vector, Vector]:
        """The units of z and g, which are `Problem.typical_row_sizes` for slacks and rows."""
        z, g = np.ones(self.lower.size), np.ones(self.equality.size)
        soft, sizes = self.problem.soft, self.problem.typical_row_sizes
        z[self.slacks] = g[self.obstacles] = sizes[soft]
        g[self.hard] = sizes[~soft]
        return z, g

    @property
    def cost_size(self) -> float:
        """The unit of the objective, `Problem.cost_scale` where that is small, else 1."""
        size = self.problem.cost_scale
        return size if size < SMALL else 1.0

    @property
    def slack_weights(self) -> Vector:
        """W, shape (M,)."""
        return self.problem.weights[self.problem.soft]

    def settled(self, p: Vector) -> tuple[Any, Vector, Any]:
        """The soft rows of stage 0 that no plan can change: their indices, h and ties."""
        soft = self.problem.soft
        (which,) = np.nonzero(self.settled_rows[soft])
        rows, sizes = (one.full().ravel()[soft][which] for one in self._start_rows(p))
        return which, rows, self.tie * sizes

    @property
    def settled_rows(self) -> NDArray[np.bool_]:
        """Whether no plan can change a row of stage 0."""
        fixed = self.fixed_action.size > 0
        return np.full(self.problem.weights.size, True) if fixed else ~self.problem.on_inputs

    @cached_property
    def _start_rows(self) -> ca.Function:
        of, fixed = self.problem, self.fixed_action.size
        ends = np.cumsum([0, of.states, of.names.size, fixed, of.data_names.size]).tolist()
        s, theta, a, d = (self.parameters[i:j] for i, j in pairwise(ends))
        given = a if fixed else ca.SX.zeros(of.inputs)
        h, sizes = of.rows(s, given, theta, d), of.all_row_sizes(s, given, theta, d)
        held = ca.vertcat(ca.SX(0, 1), *(h[j] if on else -1 for j, on in enumerate(of.active[0])))
        return ca.Function("start_rows", [self.parameters], [ca.densify(held), sizes])


def transcribe(problem: Problem, *, fix_action: bool, ties_active: bool = False) -> Ocp:
    """Write a problem by multiple shooting; with `fix_action`, add u_0 = a as a constraint.

    Bounds of states and hard rows hold where a plan can change them: x_0 is given, and noise may
    have pushed it out.  # departure M
    Rows and costs of stage 0 alone are written in s rather than in x_0, its equal, and in a where
    it is given, so that multipliers of slacks that no plan can change stay out of the others. A row
    that does not hold at a stage is -1 <= sigma there.
    A fixed u_0 has no bounds, or one at a bound would leave no interior.
    """
    e, N, soft = problem.expressions, problem.horizon, problem.soft
    x = [ca.SX.sym(f"x_{i}", problem.states) for i in range(N + 1)]
    u = [ca.SX.sym(f"u_{i}", problem.inputs) for i in range(N)]
    sigma = [ca.SX.sym(f"sigma_{i}", int(soft.sum())) for i in range(N + 1)]
    state = ca.SX.sym("s", problem.states)
    action = ca.SX.sym("a", problem.inputs if fix_action else 0)
    theta = ca.SX.sym("theta", problem.names.size)
    data = ca.SX.sym("d", problem.data_names.size, N + 1)

    path = ca.Function("path", [e.x, e.u, e.theta, e.d], [e.next_x, e.stage])
    start = ca.Function("start", [e.x, e.theta, e.d], [e.initial])
    final = ca.Function("final", [e.x, e.theta, e.d], [e.terminal])
    slack_of = np.cumsum(soft) - 1
    variables: list[tuple[str, ca.SX]] = []
    constraints: list[tuple[str, ca.SX]] = []
    objective = start(state, theta, data[: problem.own_names.size, 0])
    for i in range(N + 1):
        own, discount = data[: problem.own_names.size, i], problem.gamma**i
        variables.append(("states", x[i]))
        if i < N:
            variables.append(("inputs", u[i]))
            next_x, cost = path(x[i], u[i], theta, own)
            constraints.append(("dynamics", x[i + 1] - next_x))  # departure O
            given = action if fix_action and i == 0 else u[i]
        else:
            cost, given = final(x[i], theta, own), ca.SX.zeros(problem.inputs)
        variables.append(("slacks", sigma[i]))
        objective += discount * cost
        objective += discount * ca.dot(problem.weights[soft], sigma[i])
        if i == 0:
            constraints.append(("initial", x[0] - state))
            constraints.append(("fixed_action", u[0] - action if fix_action else ca.SX(0, 1)))
        h = problem.rows(state if i == 0 else x[i], given, theta, data[:, i])
        on = problem.active[i] & (soft | (i > 0) | (problem.on_inputs & (not fix_action)))
        held = [
            (h[j] if on[j] else -1) - (sigma[i][slack_of[j]] if soft[j] else 0)
            for j in range(soft.size)
        ]
        constraints.append(("rows", ca.vertcat(ca.SX(0, 1), *held)))
    z, of_z = _stacked(variables)
    g, of_g = _stacked(constraints)
    lower, upper = np.full(z.numel(), -np.inf), np.full(z.numel(), np.inf)
    states, inputs = of_z["states"][1:], of_z["inputs"][int(fix_action) :]
    lower[states], upper[states] = problem.state_lower, problem.state_upper
    lower[inputs], upper[inputs] = problem.lower, problem.upper
    lower[of_z["slacks"]] = 0
    equality = np.full(g.numel(), True)
    equality[of_g["rows"]] = False
    return Ocp(
        problem=problem,
        parameters=ca.vertcat(state, theta, action, ca.vec(data)),
        theta=theta,
        ties_active=ties_active,
        variables=z,
        objective=objective,
        constraints=g,
        equality=equality,
        lower=lower,
        upper=upper,
        **of_z,
        initial=of_g["initial"][0],
        fixed_action=of_g["fixed_action"][0],
        dynamics=of_g["dynamics"],
        obstacles=of_g["rows"][:, soft],
        hard=of_g["rows"][:, ~soft],
    )


def _stacked(parts: list[tuple[str, ca.SX]]) -> tuple[ca.SX, dict[str, Indices]]:
    """Expressions on top of each other, and their places by kind, a row an expression."""
    where: dict[str, list[Indices]] = {}
    size = 0
    for kind, part in parts:
        where.setdefault(kind, []).append(np.arange(size, size + part.numel()))
        size += part.numel()
    return ca.vertcat(*(part for _, part in parts)), {
        kind: np.array(rows, dtype=int) for kind, rows in where.items()
    }

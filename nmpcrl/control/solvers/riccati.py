"""The solver of `kernel`, compiled for a plant and called for one OCP."""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.resources import files
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control.codegen.jit import load
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.problem import Problem
from nmpcrl.control.solution import Solution, SolverError
from nmpcrl.control.solvers import stages
from nmpcrl.control.solvers.codes import End, Start
from nmpcrl.control.solvers.nlpsol import Fatrop, Ipopt, Program, reorder
from nmpcrl.control.solvers.solver import LED_ASTRAY, Asked, Prepared, Solver
from nmpcrl.control.solvers.starts import LAST, MOST, cold_inputs, random_inputs
from nmpcrl.control.vectors import integer

SEVERAL = 5  # cold starts besides the one that feedback holds
NOTICE = "Compiling the NMPC solver for this plant (once on this machine, about half a minute) ..."
PLAN_NOTICE = "Compiling the derivatives of the plan (once on this machine) ..."
COLD, SHIFTED, SAME = map(int, (Start.COLD, Start.SHIFTED, Start.SAME))  # for machine code
SOLVED = float(End.SOLVED)  # from machine code
ENDS = {
    End.SOLVED: LED_ASTRAY,
    End.STALLED: "found no descent",
    End.LIMIT: "ran out of iterations",
    End.BROKEN: "met numbers that are not finite",
    End.SADDLE: "stopped at a plan that is no minimum",
}
TEXTS = {  # compiled beside `model`; read with the other modules, so that an edit mixes nothing
    name: files(__package__).joinpath(f"{name}.py").read_text("utf-8")
    for name in ("codes", "kernel", "find", "slopes")
}
ABSURD = 1e24  # no value is larger
UNBOUNDED = 1e20  # stands for an input without a bound


class Arguments(NamedTuple):
    """The first arguments of `kernel.solve`, by name; u_0 is free or fixed."""

    data: Matrix  #: d_0, ..., d_N
    lower: Vector  #: of the inputs, (m,)
    upper: Vector
    sides: Matrix  #: of the states' box, which state, its sign and its limit, (sides, 3)
    kind: NDArray[np.int64]  #: of rows and sides at each stage, (N + 1, rows), see `kernel`
    discount: Vector  #: gamma^0, ..., gamma^N
    weights: Vector  #: W of the rows, infinite where hard
    tie: float


def machine_code(problem: Problem, entry: str = "find") -> Any:
    """The function `find.find` or `slopes.slopes`, compiled for a problem once.

    `slopes` takes `kernel` and `model` from the package of the solver, whose functions may have
    been compiled in this process.

    Raises:
        CannotCompile: the problem holds an operation that is not known.
    """
    if entry not in problem.machine_code:
        if entry == "find":
            texts = {name: TEXTS[name] for name in ("codes", "kernel", "find")}
            texts["model"], notice = stages.write(problem), NOTICE
        else:
            solver = next(iter(problem.machine_code.values()), None) or machine_code(problem)
            package, _, _ = solver.__module__.partition(".")
            texts = {name: f"from {package}.{name} import *\n" for name in ("kernel", "model")}
            texts["slopes"], notice = TEXTS["slopes"], PLAN_NOTICE
        texts["__init__"] = f"from .{entry} import {entry}\n"
        problem.machine_code[entry] = getattr(load("riccati", texts, notice), entry)
    return problem.machine_code[entry]


@dataclass(frozen=True)
class Riccati(Solver):
    """The interior point of `kernel`, compiled for a plant at its first solve."""

    name: ClassVar[str] = "riccati"
    code: Callable[[Problem], Any] = field(default=machine_code, repr=False)
    starts: int = SEVERAL  #: cold starts; of 2 or more, and one held by feedback, the best counts

    def __post_init__(self) -> None:
        super().__post_init__()
        if integer("starts", self.starts) > MOST:
            raise ValueError(f"starts = {self.starts} must be at most {MOST}")

    def prepare(self, ocp: Ocp) -> Prepared:
        """The compiled solver; fatrop, with a warning, where it cannot be compiled."""
        try:
            return Compiled(ocp, self.code(ocp.problem), self)
        except CannotCompile as error:
            warnings.warn(f"{error}: fatrop solves instead of riccati", stacklevel=2)
            return Fatrop(self.tolerance).prepare(ocp)


DEFAULT = Riccati()


class Compiled:
    """The machine code of a problem, called for one OCP; where no start succeeds, Ipopt solves."""

    def __init__(self, ocp: Ocp, solve: Any, solver: Riccati = DEFAULT) -> None:
        problem = self._problem = ocp.problem
        self._ocp, self.code = ocp, solve
        self._fixed = int(ocp.fixed_action.size > 0)
        self._standing = np.zeros(2 * ocp.lower.size + ocp.equality.size)
        self._split = self._standing.size  # where a solution's gradient begins
        self._size = self._split + ocp.theta.numel()
        self._no_action = np.zeros(problem.inputs)
        self.tolerance = solver.tolerance
        N, others = problem.horizon, cold_inputs(problem, problem.horizon, solver.starts - 1)
        self.others = np.reshape(np.array(others), (-1, N, problem.inputs))
        self.drawn = np.array([random_inputs(problem, k, N) for k in range(LAST)])
        sides = [
            (state, sign, limit[state])
            for sign, limit in ((-1.0, problem.state_lower), (1.0, problem.state_upper))
            for state in np.flatnonzero(np.isfinite(limit))
        ]
        kind = problem.active.astype(np.int64)  # 1 where a plan can change a row
        kind[0, ocp.settled_rows] *= np.where(problem.soft[ocp.settled_rows], 2, 0)
        later = np.repeat(np.minimum(np.arange(N + 1), 1)[:, None], len(sides), axis=1)
        self.arguments = Arguments(
            problem.data.copy(),  # which may be written to, as compiled code wants it
            np.maximum(problem.lower, -UNBOUNDED),
            np.minimum(problem.upper, UNBOUNDED),
            np.reshape(np.array(sides, float), (-1, 3)),
            np.hstack([kind, later]),
            problem.gamma ** np.arange(N + 1, dtype=float),
            problem.weights.copy(),
            ocp.tie,
        )
        self._rest = self.arguments[1:]

    def solve(self, asked: Asked) -> Solution:
        """See `Prepared.solve`."""
        state, theta, warm_start, action, data, began = asked
        given = action if self._fixed else self._no_action
        start, point = COLD, self._standing
        if warm_start is not None:
            same = warm_start.state.tolist() == state.tolist()  # faster than np.array_equal
            start, point = SAME if same else SHIFTED, self.point_of(warm_start)
        out = np.empty(self._size)
        value, iterations, end, violation, error, failed = self.code(
            data, *self._rest, state, theta, given, self._fixed, self.others, self.drawn,
            start, self.tolerance, point, out,
        )  # fmt: skip
        if end == SOLVED and value < ABSURD:
            return Solution(
                state, theta, value, out[self._split :], int(iterations),
                time.perf_counter() - began, out[: self._split], self._ocp, Riccati.name, data,
                int(failed), violation,
            )  # fmt: skip
        try:
            found = self._last_resort.solve(asked._replace(warm_start=None))
        except SolverError:
            raise SolverError(
                f"{Riccati.name} found no optimum from {failed:.0f} starts (the last"
                f" {ENDS[End(int(end))]} after {iterations:.0f} iterations with a relative error of"
                f" {error:.1e})",
                state,
                theta,
            ) from None
        return replace(found, took_over=True)

    @cached_property
    def _last_resort(self) -> Program:  # not fatrop, which may never return
        return Program(self._ocp, Ipopt(self.tolerance))

    def hessian_times(self, solution: Solution, vector: Vector) -> Vector | None:
        """The value's Hessian in theta times a vector (d,); None where dense algebra must do it."""
        return self._slopes(solution, vector, self._no_action)

    def policy(self, solution: Solution) -> Matrix | None:
        """du_0 / dtheta, shape (m, d), a sweep an input; None as above."""
        still, weights = np.zeros(solution.theta.size), np.eye(self._problem.inputs)
        found = [self._slopes(solution, still, one) for one in weights]
        return None if any(one is None for one in found) else np.array(found)

    def feedback(self, solution: Solution) -> Matrix | None:
        """du_0 / ds, shape (m, n), the gain of stage 0; None as above."""
        d, shape = solution.theta.size, (self._problem.inputs, self._problem.states)
        found = self._slopes(solution, np.zeros(d), self._no_action, d + shape[0] * shape[1])
        return None if found is None else found[d:].reshape(shape)

    def adjoint(self, solution: Solution, weights: Vector) -> Vector | None:
        """The step of z and lam, K step + w = 0, for weights w of z; None as above."""
        size = self._ocp.lower.size + self._ocp.equality.size
        return self._slopes(solution, np.zeros(solution.theta.size), weights, size)

    def _slopes(
        self, solution: Solution, along: Vector, of_plan: Vector, size: int | None = None
    ) -> Vector | None:
        """`slopes.slopes` along a direction of theta, of a sum of the plan with these weights."""
        if solution.took_over:  # whose states are not rolled out
            return None
        action = solution.action if self._fixed else self._no_action
        given = (solution.state, solution.theta, action, self._fixed, solution.point)
        out = np.zeros(solution.theta.size if size is None else size)
        formed = self.slopes(solution.data, *self._rest, *given, along, of_plan, out)
        return out if formed else None

    @cached_property
    def slopes(self) -> Any:
        """`slopes.slopes`, compiled."""
        return machine_code(self._problem, "slopes")

    @property
    def place(self) -> int:
        """Where the multipliers of a fixed u_0 begin in a solution's numbers."""
        return int(self._ocp.lower.size + self._ocp.fixed_action[0])

    def point_of(self, warm_start: Solution) -> Vector:
        """The warm start's z, lam and nu in the order of this OCP."""
        if warm_start.ocp is self._ocp:
            return warm_start.point
        return np.concatenate(reorder(warm_start, self._ocp))

"""The solver of `kernel` compiled for a plant and called for one OCP: starts and second tries."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.resources import files
from itertools import chain
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control.codegen import jit
from nmpcrl.control.codegen.jit import load
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.problem import Problem
from nmpcrl.control.remembered import remembered
from nmpcrl.control.solution import NoStartLeft, Solution, SolverError, check_shape
from nmpcrl.control.solvers import stages
from nmpcrl.control.solvers.codes import End, Start
from nmpcrl.control.solvers.nlpsol import Fatrop, Program
from nmpcrl.control.solvers.solver import LED_ASTRAY, Solver
from nmpcrl.control.solvers.starts import MOST, Regulator, cold_inputs, random_inputs
from nmpcrl.control.vectors import whole

WARM_LIMIT = 40  # iterations from a warm start
COLD_LIMIT = 200  # iterations from standing still
PERTURBED = 4  # starts from random inputs, after everything else
SEVERAL, FEW = 9, 2  # cold starts of a `Problem` with rows, and without
CLEARLY = 1e-6  # a plan is better if its value is less by this share
LEAVES = 1e-9  # and it leaves the box by no more than this
NOTICE = "Compiling the NMPC solver for this plant (once on this machine, about half a minute) ..."
PLAN_NOTICE = "Compiling the derivatives of the plan (once on this machine) ..."
COLD, SHIFTED, NEAR, SAME = map(int, Start)  # plain numbers, as machine code takes them
SOLVED = float(End.SOLVED)  # as it returns them
ENDS = {
    End.SOLVED: LED_ASTRAY,
    End.STALLED: "found no descent",
    End.LIMIT: "ran out of iterations",
    End.BROKEN: "met numbers that are not finite",
    End.SADDLE: "stopped at a plan that is no minimum",
}
TEXTS = {  # compiled beside `model`; read with the other modules, so that an edit mixes nothing
    name: files(__package__).joinpath(f"{name}.py").read_text("utf-8")
    for name in ("codes", "kernel", "solve", "slopes")
}
NAME = "riccati"
ABSURD = 1e24  # no value is larger
UNBOUNDED = 1e20  # stands for an input without a bound


class Arguments(NamedTuple):
    """The first arguments of `solve.solve`, by name; u_0 is free or fixed."""

    data: Matrix  # d_0, ..., d_N
    lower: Vector  # of the inputs, (m,)
    upper: Vector
    sides: Matrix  # of the states' box: which state, its sign and its limit, (sides, 3)
    kind: NDArray[np.int64]  # of rows and sides at each stage, (N + 1, rows), see `kernel`
    discount: Vector  # gamma^0, ..., gamma^N
    weights: Vector  # W of the rows, infinite where hard
    tie: float


Attempt = tuple[int, Vector, int]  # which `Start`, with which (z, lam, nu), iterations allowed


class Found(NamedTuple):
    """What one start led to."""

    value: float
    iterations: float
    violation: float
    point: Vector  # z, lam and nu, and then the gradient


@remembered
def machine_code(problem: Problem) -> Any:
    """`solve.solve` compiled for a problem.

    Raises:
        CannotCompile: numba is missing, or the problem holds an operation that is not known.
    """
    return _loaded("solve", problem, NOTICE)


@remembered
def slopes_code(problem: Problem) -> Any:
    """`slopes.slopes` compiled for a problem."""
    return _loaded("slopes", problem, PLAN_NOTICE)


def _loaded(entry: str, problem: Problem, notice: str) -> Any:
    """The function of a module that has its name, compiled with a model."""
    texts = {
        "__init__": f"from .{entry} import {entry}\n",
        "model": stages.write(problem),
        **{name: TEXTS[name] for name in ("codes", "kernel", entry)},
    }
    return getattr(load("riccati", texts, notice), entry)


@dataclass(frozen=True)
class Riccati(Solver):
    """The interior point of `kernel`, compiled for a plant at its first solve."""

    name: ClassVar[str] = NAME
    code: Callable[[Problem], Any] = field(default=machine_code, repr=False)
    starts: int | None = None  # cold ones, of which the best plan counts; see `starts_of`

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.starts is not None and whole("starts", self.starts) > MOST:
            raise ValueError(f"starts = {self.starts} must be at most {MOST}")

    @property
    def available(self) -> bool:
        """Whether numba is installed."""
        return jit.numba_version() is not None

    def starts_of(self, problem: Problem) -> int:
        """How many cold starts are compared: 9 where there are rows, else 2.

        A problem whose model grows has one more, that of a `Regulator`.
        """
        return self.starts or (SEVERAL if problem.weights.size else FEW)

    def prepare(self, ocp: Ocp) -> "Compiled":
        """Load the machine code, or compile it.

        Raises:
            CannotCompile: numba is missing, or the problem holds an operation that is not known.
        """
        return Compiled(ocp, self.code(ocp.problem), self)


DEFAULT = Riccati()


class Compiled:
    """Calls the machine code of a problem: starts, second tries, and fatrop where all fail."""

    def __init__(self, ocp: Ocp, solve: Any, solver: Riccati = DEFAULT) -> None:
        problem = self._problem = ocp.problem
        self._ocp, self._solver = ocp, solver
        self._code = solve
        self._fixed = int(ocp.fixed_action.size > 0)
        self._standing = np.zeros(2 * ocp.lower.size + ocp.equality.size)
        self._split = self._standing.size  # where a solution's gradient begins
        self._size = self._split + ocp.theta.numel()
        self._no_action = np.zeros(problem.inputs)
        self._tolerance = solver.tolerance
        count = solver.starts_of(problem) - 1
        self._others = cold_inputs(problem, problem.horizon, count)
        sides = [
            (state, sign, limit[state])
            for sign, limit in ((-1.0, problem.state_lower), (1.0, problem.state_upper))
            for state in np.flatnonzero(np.isfinite(limit))
        ]
        kind = problem.active.astype(np.int64)  # 1 where a plan can change a row
        kind[0, ocp.settled_rows] *= np.where(problem.soft[ocp.settled_rows], 2, 0)
        stages = np.arange(problem.horizon + 1)[:, None]
        self.arguments = Arguments(
            problem.data.copy(),  # which may be written to, as compiled code wants it
            np.maximum(problem.lower, -UNBOUNDED),
            np.minimum(problem.upper, UNBOUNDED),
            np.reshape(np.array(sides, float), (-1, 3)),
            np.hstack([kind, np.repeat(np.minimum(stages, 1), len(sides), axis=1)]),
            ocp.gamma ** np.arange(problem.horizon + 1, dtype=float),
            problem.weights.copy(),
            ocp.tie,
        )

    def solve(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None,
        *action: Vector,
        began: float,
        data: Matrix,
    ) -> Solution:
        """Solve for (state, theta[, action]); arguments as in `Nmpc.solve`, already checked."""
        given = action[0] if action else self._no_action
        problem = (data, *self.arguments[1:])
        code, fixed, tolerance, split = self._code, self._fixed, self._tolerance, self._split
        for restarts, (start, point, limit) in enumerate(
            self._starts(warm_start, problem, state, theta, given)
        ):
            out = np.empty(self._size)
            value, iterations, end, violation, error = code(
                *problem, state, theta, given, fixed, start, limit, tolerance, point, out
            )
            if end == SOLVED and value < ABSURD:
                if start == COLD:
                    first = Found(value, iterations, violation, out)
                    others = self._others if warm_start is None else []
                    value, iterations, violation, out = self._best(
                        first, others, problem, state, theta, given
                    )
                return Solution(
                    state,
                    theta,
                    value,
                    out[split:],
                    int(iterations),
                    time.perf_counter() - began,
                    out[:split],
                    self._ocp,
                    NAME,
                    restarts,
                    violation,
                    data,
                )
        try:
            found = self._fatrop.solve(state, theta, None, *action, began=began, data=data)
        except SolverError:
            raise NoStartLeft(
                f"{Riccati.name} found no optimum from {restarts + 1} starts (the last"
                f" {ENDS[End(int(end))]} after {iterations:.0f} iterations with a relative error of"
                f" {error:.1e})",
                state,
                theta,
            ) from None
        return replace(found, took_over=True)

    @cached_property
    def _fatrop(self) -> Program:
        return Program(self._ocp, Fatrop(self._tolerance))

    @cached_property
    def _regulator(self) -> Regulator:
        return Regulator(self._problem)

    def _best(
        self, first: Found, others: list[Matrix], problem: tuple[Any, ...], *given: Vector
    ) -> Found:
        """The best plan of the cold starts; the earlier one where they are as good."""
        best = first
        for inputs in chain(others, self._regulated(problem, *given)):
            out, point = np.empty(self._size), self._standing.copy()
            point[self._ocp.inputs] = inputs
            value, iterations, end, violation, _ = self._code(
                *problem, *given, self._fixed, COLD, COLD_LIMIT, self._tolerance, point, out
            )
            less = value < best.value - CLEARLY * abs(best.value)
            if end == SOLVED and less and violation <= best.violation + LEAVES:
                best = Found(value, iterations, violation, out)
        return best

    def _regulated(self, problem: tuple[Any, ...], *given: Vector) -> list[Matrix]:
        """The inputs of a start that is held by feedback, if there is one."""
        if self._solver.starts is not None:
            return []
        state, theta, action = given
        fixed = (action,) if self._fixed else ()
        inputs = self._regulator.inputs(state, theta, problem[0], *fixed)
        return [] if inputs is None else [inputs]

    def hessian_times(self, solution: Solution, vector: Vector) -> Vector | None:
        """The Hessian of the value in theta, times a vector (d,); None where dense algebra must."""
        ocp = self._ocp
        return self._slopes(
            solution, vector, np.zeros(ocp.states.shape), np.zeros(ocp.inputs.shape)
        )

    def plan_gradient(self, solution: Solution, states: Matrix, inputs: Matrix) -> Vector | None:
        """The gradient in theta of a weighted sum of the plan; None likewise."""
        return self._slopes(solution, np.zeros(solution.theta.size), states, inputs)

    def _slopes(self, solution: Solution, *directions: Matrix) -> Vector | None:
        if solution.took_over:  # whose states are not rolled out
            return None
        action = solution.action if self._fixed else self._no_action
        data = self.arguments.data if solution.data is None else solution.data
        given = (solution.state, solution.theta, action, self._fixed, solution.point)
        out = np.empty(solution.theta.size)
        formed = slopes_code(self._problem)(data, *self.arguments[1:], *given, *directions, out)
        return out if formed else None

    def _starts(
        self, warm_start: Solution | None, problem: tuple[Any, ...], *given: Vector
    ) -> Iterator[Attempt]:
        """The warm start, standing still, held by feedback, and random inputs."""
        if warm_start is not None:
            point = self._from(warm_start)
            if (
                warm_start.state.tolist() == given[0].tolist()
            ):  # a tenth of the time of np.array_equal
                yield SAME, point, WARM_LIMIT
                yield NEAR, point, WARM_LIMIT
            else:
                yield SHIFTED, point, WARM_LIMIT
        yield COLD, self._standing, COLD_LIMIT
        drawn = (random_inputs(self._problem, k, len(self._ocp.inputs)) for k in range(PERTURBED))
        for inputs in chain(self._regulated(problem, *given), drawn):
            point = self._standing.copy()
            point[self._ocp.inputs] = inputs
            yield COLD, point, COLD_LIMIT

    def _from(self, warm_start: Solution) -> Vector:
        """The warm start's z, lam and nu in the order of this OCP."""
        ocp, old = self._ocp, warm_start.ocp
        if old is ocp:
            return warm_start.point
        check_shape(warm_start, ocp)
        z, nu = warm_start.primal, warm_start.bound_duals
        lam = np.zeros(ocp.equality.size)
        lam[ocp.obstacles] = warm_start.constraint_duals[old.obstacles]
        return np.concatenate([z, lam, nu])

"""The solver of `kernel` compiled for a plant and called for one OCP: starts and second tries."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.resources import files
from itertools import chain
from typing import Any, ClassVar, NamedTuple

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.codegen import jit
from nmpcrl.control.codegen.jit import load
from nmpcrl.control.ocp import Ocp, ProblemOcp, TaskOcp
from nmpcrl.control.plant import Plant
from nmpcrl.control.problem import Problem
from nmpcrl.control.remembered import remembered
from nmpcrl.control.solution import NoStartLeft, Solution, SolverError, check_shape
from nmpcrl.control.solvers import problem_stages
from nmpcrl.control.solvers.codes import End, Start
from nmpcrl.control.solvers.nlpsol import Fatrop, Program
from nmpcrl.control.solvers.solver import LED_ASTRAY, Solver
from nmpcrl.control.solvers.stages import write
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
    for name in ("codes", "kernel", "solve", "hessian", "hessian_times", "plan_slopes")
    + ("rows", "rows_solve", "rows_slopes")
}
STAGES = ("codes", "kernel", "hessian")
NAME = "riccati"
ABSURD = 1e24  # no value is larger
UNBOUNDED = 1e20  # stands for an input without a bound


class TaskArguments(NamedTuple):
    """The first arguments of `solve.solve`, by name; u_0 is free or fixed."""

    target: Vector  # (n,)
    lower: Vector  # of the inputs, (m,)
    upper: Vector
    discs: Matrix  # x, y and the distance that each obstacle keeps [m], (obstacles, 3)
    sides: Matrix  # of the box: which state, its sign and its limit, (sides, 3)
    discount: Vector  # gamma^0, ..., gamma^N
    slack_weight: float
    soft_box: int
    tie: float


Attempt = tuple[int, Vector, int]  # which `Start`, with which (z, lam, nu), iterations allowed


class Found(NamedTuple):
    """What one start led to."""

    value: float
    iterations: float
    violation: float
    point: Vector  # z, lam and nu, and then the gradient


class Code(NamedTuple):
    """What is called of `kernel` and `hessian`, with the arguments that these say."""

    solve: Any  # called, and taken apart by `trace`
    hessian_times: Any


@remembered
def machine_code(plant: Plant) -> Code:
    """`solve` and `hessian_times` compiled for a plant.

    Raises:
        CannotCompile: numba is missing, or the plant holds an operation that is not known.
    """
    entries = ("hessian_times", "solve")
    return Code(*_loaded(entries[::-1], {"model": write(plant)}, STAGES, NOTICE))


@remembered
def plan_code(plant: Plant) -> Any:
    """`plan_slopes` compiled for a plant, where its policy is differentiated."""
    return _loaded(("plan_slopes",), {"model": write(plant)}, STAGES, PLAN_NOTICE)[0]


@remembered
def problem_code(problem: Problem) -> Any:
    """`rows_solve.solve` compiled for a problem.

    Raises:
        CannotCompile: as `machine_code`.
    """
    model = problem_stages.write(problem)
    return _loaded(("solve",), model, ("codes", "kernel", "rows"), NOTICE, "rows_")[0]


@remembered
def problem_slopes(problem: Problem) -> Any:
    """`rows_slopes.slopes` compiled for a problem."""
    model = problem_stages.write(problem)
    return _loaded(("slopes",), model, ("codes", "kernel", "rows"), PLAN_NOTICE, "rows_")[0]


def _loaded(
    entries: tuple[str, ...],
    model: Mapping[str, str],
    beside: tuple[str, ...],
    notice: str,
    kind: str = "",
) -> list[Any]:
    """Functions that are called, each from the module of its name; compiled with a model."""
    texts = {
        "__init__": "".join(f"from .{kind}{name} import {name}\n" for name in sorted(entries)),
        **model,
        **{name: TEXTS[name] for name in (*beside, *(kind + name for name in entries))},
    }
    module = load("riccati", texts, notice)
    return [getattr(module, name) for name in entries]


@dataclass(frozen=True)
class Riccati(Solver):
    """The interior point of `kernel`, compiled for a plant at its first solve."""

    name: ClassVar[str] = NAME
    prices_box: ClassVar[bool] = True

    code: Callable[[Plant], Code] = field(default=machine_code, repr=False)
    starts: int | None = None  # cold ones, of which the best plan counts; see `starts_of`

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.starts is not None and whole("starts", self.starts) > MOST:
            raise ValueError(f"starts = {self.starts} must be at most {MOST}")

    @property
    def available(self) -> bool:
        """Whether numba is installed."""
        return jit.numba_version() is not None

    def starts_of(self, ocp: Ocp) -> int:
        """How many cold starts are compared: 1 for a task, as published, 9 or 2 for a `Problem`.

        9 if it has rows. A `Problem` whose model grows has one more, that of a `Regulator`.
        """
        if self.starts is not None or not isinstance(ocp, ProblemOcp):
            return self.starts or 1
        return SEVERAL if ocp.problem.weights.size else FEW

    def prepare(self, ocp: Ocp) -> "Compiled":
        """Load the machine code, or compile it.

        Raises:
            CannotCompile: numba is missing, or the plant holds an operation that is not known.
        """
        if isinstance(ocp, ProblemOcp):
            return ProblemPoint(ocp, problem_code(ocp.problem), self)
        assert isinstance(ocp, TaskOcp)
        return InteriorPoint(ocp, self.code(ocp.plant), self)


DEFAULT = Riccati()


class Compiled(ABC):
    """An OCP and the code that solves it."""

    problem: Any  # the first arguments of the code, a tuple; u_0 free or fixed

    def __init__(self, ocp: Ocp, of: Plant | Problem, solve: Any, solver: Riccati) -> None:
        self._ocp, self._of = ocp, of
        self._code = solve
        self._fixed = int(ocp.fixed_action.size > 0)
        self._standing = np.zeros(2 * ocp.lower.size + ocp.equality.size)
        self._split = self._standing.size  # where a solution's gradient begins
        self._size = self._split + ocp.theta.numel()
        self._no_action = np.zeros(of.lower.size)
        self._bounds = np.maximum(of.lower, -UNBOUNDED), np.minimum(of.upper, UNBOUNDED)
        self._tolerance = solver.tolerance
        self._others = cold_inputs(of, len(ocp.inputs), solver.starts_of(ocp) - 1)

    def solve(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None,
        *action: Vector,
        began: float,
        data: Matrix | None = None,
    ) -> Solution:
        """Solve for (state, theta[, action]); arguments as in `Nmpc.solve`, already checked."""
        given = action[0] if action else self._no_action
        problem = self.problem if data is None else (data, *self.problem[1:])
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
        raise NoStartLeft(
            f"{Riccati.name} found no optimum from {restarts + 1} starts (the last"
            f" {ENDS[End(int(end))]} after {iterations:.0f} iterations with a relative error of"
            f" {error:.1e})",
            state,
            theta,
        )

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
        return []

    def _given(self, solution: Solution) -> tuple[Any, ...]:
        """The arguments of a derivative at a solution."""
        action = solution.action if self._fixed else self._no_action
        problem = self.problem if solution.data is None else (solution.data, *self.problem[1:])
        return (*problem, solution.state, solution.theta, action, self._fixed, solution.point)

    @abstractmethod
    def hessian_times(self, solution: Solution, vector: Vector) -> Vector | None:
        """The Hessian of the value in theta, times a vector (d,); None at no strict minimum."""

    @abstractmethod
    def plan_gradient(self, solution: Solution, states: Matrix, inputs: Matrix) -> Vector | None:
        """The gradient in theta of a weighted sum of the plan; None at no strict minimum."""

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
        drawn = (random_inputs(self._of, k, len(self._ocp.inputs)) for k in range(PERTURBED))
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


class InteriorPoint(Compiled):
    """Eq. (2) of the paper."""

    def __init__(self, ocp: TaskOcp, code: Code, solver: Riccati = DEFAULT) -> None:
        super().__init__(ocp, ocp.plant, code.solve, solver)
        self._hessian_times = code.hessian_times
        self._plant, task = ocp.plant, ocp.task
        sides = [
            (state, sign, limit[state])
            for sign, limit in ((-1.0, task.lower), (1.0, task.upper))
            for state in np.flatnonzero(np.isfinite(limit))
        ]
        self.problem = TaskArguments(
            task.target.copy(),  # which may be written to, as compiled code wants it
            *self._bounds,
            np.reshape(np.transpose(task.discs), (-1, 3)).copy(),
            np.reshape(np.array(sides, float), (-1, 3)),
            ocp.gamma ** np.arange(len(ocp.states), dtype=float),
            ocp.slack_weight,
            int(task.soft_box),
            ocp.tie,
        )

    def hessian_times(self, solution: Solution, vector: Vector) -> Vector | None:
        """As `Compiled` says."""
        out = np.empty(vector.size)
        formed = self._hessian_times(*self._given(solution), vector, out)
        return out if formed else None

    def plan_gradient(self, solution: Solution, states: Matrix, inputs: Matrix) -> Vector | None:
        """As `Compiled` says."""
        out = np.empty(solution.theta.size)
        formed = plan_code(self._plant)(*self._given(solution), states, inputs, out)
        return out if formed else None


class ProblemPoint(Compiled):
    """A `Problem`."""

    def __init__(self, ocp: ProblemOcp, solve: Any, solver: Riccati = DEFAULT) -> None:
        problem = ocp.problem
        super().__init__(ocp, problem, solve, solver)
        self._problem = problem
        kind = problem.active.astype(np.int64)  # 1 where a plan can change a row, as `rows` says
        kind[0] *= np.where(ocp.settled_rows, 2, 1)
        self.problem = (
            problem.data.copy(),
            *self._bounds,
            kind,
            ocp.gamma ** np.arange(len(ocp.states), dtype=float),
            problem.weights.copy(),
            problem.cost_scale,
            ocp.tie,
        )
        self._solver = solver

    def solve(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None,
        *action: Vector,
        **others: Any,
    ) -> Solution:
        """As `Compiled` says; by fatrop where riccati finds no optimum."""
        try:
            return super().solve(state, theta, warm_start, *action, **others)
        except SolverError as error:
            try:
                found = self._fatrop.solve(state, theta, None, *action, **others)
            except SolverError:
                raise error from None
            return replace(found, took_over=True)

    @cached_property
    def _fatrop(self) -> Program:
        return Program(self._ocp, Fatrop(self._tolerance))

    @cached_property
    def _regulator(self) -> Regulator:
        return Regulator(self._problem)

    def _regulated(self, problem: tuple[Any, ...], *given: Vector) -> list[Matrix]:
        """As `Compiled` says."""
        state, theta, action = given
        fixed = (action,) if self._fixed else ()
        inputs = self._regulator.inputs(state, theta, problem[0], *fixed)
        return [] if self._solver.starts is not None or inputs is None else [inputs]

    def hessian_times(self, solution: Solution, vector: Vector) -> Vector | None:
        """As `Compiled` says."""
        ocp = self._ocp
        return self._slopes(
            solution, vector, np.zeros(ocp.states.shape), np.zeros(ocp.inputs.shape)
        )

    def plan_gradient(self, solution: Solution, states: Matrix, inputs: Matrix) -> Vector | None:
        """As `Compiled` says."""
        return self._slopes(solution, np.zeros(solution.theta.size), states, inputs)

    def _slopes(self, solution: Solution, *directions: Matrix) -> Vector | None:
        if solution.took_over:  # whose states are not rolled out: dense algebra answers
            return None
        out = np.empty(solution.theta.size)
        formed = problem_slopes(self._problem)(*self._given(solution), *directions, out)
        return out if formed else None

"""The solver of `kernel` compiled for a plant and called for one OCP: starts and second tries."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any, ClassVar, NamedTuple

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.codegen.jit import load
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.plant import Plant
from nmpcrl.control.solution import Solution, SolverError, check_shape
from nmpcrl.control.solvers.codes import End, Start
from nmpcrl.control.solvers.solver import TOLERANCE, Solver
from nmpcrl.control.solvers.stages import write

WARM_LIMIT = 40  # iterations from a warm start
COLD_LIMIT = 200  # iterations from standing still
PERTURBED = 4  # starts from random inputs, after everything else
NOTICE = "Compiling the NMPC solver for this plant (once on this machine, about half a minute) ..."
COLD, SHIFTED, NEAR, SAME = map(int, Start)  # plain numbers, as machine code takes them
SOLVED = float(End.SOLVED)  # as it returns them
ENDS = {
    End.STALLED: "found no descent",
    End.LIMIT: "ran out of iterations",
    End.BROKEN: "met numbers that are not finite",
}
TEXTS = {  # compiled beside `model`; read with the other modules, so that an edit mixes nothing
    name: files(__package__).joinpath(f"{name}.py").read_text("utf-8")
    for name in ("codes", "kernel", "hessian")
}
UNBOUNDED = 1e20  # stands for an input without a bound


class Problem(NamedTuple):
    """The first arguments of `kernel.solve`, by name; u_0 is free or fixed."""

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


class Code(NamedTuple):
    """What is called of `kernel` and `hessian`, with the arguments that these say."""

    solve: Any  # called, and taken apart by `trace`
    hessian_times: Any


@cache
def machine_code(plant: Plant) -> Code:
    """`kernel.solve` and `hessian.hessian_times` compiled for a plant.

    Raises:
        CannotCompile: numba is missing, or the plant holds an operation that is not known.
    """
    texts = {
        "__init__": "from .hessian import hessian_times\nfrom .kernel import solve\n",
        "model": write(plant),
        **TEXTS,
    }
    module = load("riccati", texts, NOTICE)
    return Code(module.solve, module.hessian_times)


def random_inputs(plant: Plant, seed: int, horizon: int) -> Matrix:
    """Where a start begins that nothing else is known for, shape (horizon, m)."""
    lower, upper = np.maximum(plant.lower, -1.0), np.minimum(plant.upper, 1.0)
    return np.random.default_rng(seed).uniform(lower, upper, (horizon, plant.m))


@dataclass(frozen=True)
class Riccati(Solver):
    """The interior point of `kernel`, compiled for a plant at its first solve."""

    name: ClassVar[str] = "riccati"
    prices_box: ClassVar[bool] = True

    code: Callable[[Plant], Code] = field(default=machine_code, repr=False)

    def prepare(self, ocp: Ocp) -> "InteriorPoint":
        """Load the machine code, or compile it.

        Raises:
            CannotCompile: numba is missing, or the plant holds an operation that is not known.
        """
        return InteriorPoint(ocp, self.code(ocp.plant), self.tolerance)


class InteriorPoint:
    """An OCP and the code that solves it."""

    def __init__(self, ocp: Ocp, code: Code, tolerance: float = TOLERANCE) -> None:
        self._ocp, plant, task = ocp, ocp.plant, ocp.task
        self._code = code
        self._fixed = int(ocp.fixed_action.size > 0)
        self._standing = np.zeros(2 * ocp.lower.size + ocp.equality.size)
        self._size = self._standing.size + ocp.theta.numel()
        self._no_action = np.zeros(plant.m)
        sides = [
            (state, sign, limit[state])
            for sign, limit in ((-1.0, task.lower), (1.0, task.upper))
            for state in np.flatnonzero(np.isfinite(limit))
        ]
        self.problem = Problem(
            task.target.copy(),  # which may be written to, as compiled code wants it
            np.maximum(plant.lower, -UNBOUNDED),
            np.minimum(plant.upper, UNBOUNDED),
            np.reshape(np.transpose(task.discs), (-1, 3)).copy(),
            np.reshape(np.array(sides, float), (-1, 3)),
            ocp.gamma ** np.arange(len(ocp.states), dtype=float),
            ocp.slack_weight,
            int(task.soft_box),
            ocp.tie,
        )
        self._tolerance = tolerance

    def solve(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None,
        *action: Vector,
        began: float,
    ) -> Solution:
        """Solve for (state, theta[, action]); arguments as in `Nmpc.solve`, already checked."""
        given = action[0] if action else self._no_action
        arguments = (*self.problem, state, theta, given, self._fixed)
        for restarts, (start, point, limit) in enumerate(self._starts(state, warm_start)):
            out = np.empty(self._size)
            value, iterations, end, violation, error = self._code.solve(
                *arguments, start, limit, self._tolerance, point, out
            )
            if end == SOLVED:
                return Solution(
                    state,
                    theta,
                    value,
                    out[self._standing.size :],
                    int(iterations),
                    time.perf_counter() - began,
                    out[: self._standing.size],
                    self._ocp,
                    Riccati.name,
                    restarts,
                    violation,
                )
        raise SolverError(
            f"{Riccati.name} found no optimum from {restarts + 1} starts (the last"
            f" {ENDS[End(int(end))]} after {iterations:.0f} iterations with a relative error of"
            f" {error:.1e})",
            state,
            theta,
        )

    def hessian_times(self, solution: Solution, vector: Vector) -> Vector | None:
        """The Hessian of the value in theta, times a vector (d,); None at no strict minimum."""
        action = solution.action if self._fixed else self._no_action
        out = np.empty(vector.size)
        arguments = (*self.problem, solution.state, solution.theta, action, self._fixed)
        formed = self._code.hessian_times(*arguments, solution.point, vector, out)
        return out if formed else None

    def _starts(self, state: Vector, warm_start: Solution | None) -> Iterator[Attempt]:
        """The warm start, standing still, and random inputs."""
        if warm_start is not None:
            point = self._from(warm_start)
            if warm_start.state.tolist() == state.tolist():  # a tenth of the time of np.array_equal
                yield SAME, point, WARM_LIMIT
                yield NEAR, point, WARM_LIMIT
            else:
                yield SHIFTED, point, WARM_LIMIT
        yield COLD, self._standing, COLD_LIMIT
        for seed in range(PERTURBED):
            point = self._standing.copy()
            point[self._ocp.inputs] = random_inputs(self._ocp.plant, seed, len(self._ocp.inputs))
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

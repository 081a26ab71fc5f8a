"""Many solves at once: arrays in and arrays out, in several threads."""

import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control.codegen.jit import load
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.problem import Problem
from nmpcrl.control.solution import Solution, SolverError, Status, check_shape
from nmpcrl.control.solvers.codes import Start
from nmpcrl.control.solvers.riccati import ABSURD, SOLVED, Compiled, Riccati
from nmpcrl.control.solvers.solver import Asked
from nmpcrl.control.variant import Variant

FAILED, REFUSED = "failed", "refused"
TEXT = files("nmpcrl.control.solvers").joinpath("many.py").read_text("utf-8")
SHARES = 4  # of the work for each thread, since solves differ in length


@dataclass(frozen=True, eq=False)
class Batch:
    """Solutions of B problems, an array for each part; `batch[k]` is one of them as a `Solution`.

    `status` says how each was found: one of `Status`, or "failed" where no optimum was found, or
    "refused" where a number given is not finite or too large, or an action leaves its bounds.
    All results are nan there.
    """

    state: Matrix  #: s, shape (B, n)
    theta: Matrix  #: shape (B, d)
    value: Vector  #: V or Q, shape (B,)
    features: Matrix  #: the values' gradients in theta, shape (B, d)
    status: NDArray[np.str_]  #: shape (B,)
    iterations: Vector  #: of the solver, shape (B,)
    violation: Vector  #: of hard rows and of a hard box, shape (B,)
    restarts: Vector  #: shape (B,)
    solver: NDArray[np.object_]  #: names, shape (B,)
    seconds: float  #: wall time of all [s]
    point: Matrix  #: z, lam and nu of each, in the order of `ocp`
    data: NDArray[np.float64]  #: d_0, ..., d_N, shape (B, N + 1, size), or (1, N + 1, size)
    ocp: Ocp

    @cached_property
    def solved(self) -> NDArray[np.bool_]:
        """Whether an optimum was found, shape (B,)."""
        found: NDArray[np.bool_] = ~np.isin(self.status, (FAILED, REFUSED))
        return found

    @property
    def action(self) -> Matrix:
        """u_0, shape (B, m)."""
        return self.inputs[:, 0]

    @cached_property
    def inputs(self) -> NDArray[np.float64]:
        """Planned u_0, ..., u_{N-1}, shape (B, N, m)."""
        return self.point[:, self.ocp.inputs]

    @cached_property
    def states(self) -> NDArray[np.float64]:
        """Predicted x_0, ..., x_N, shape (B, N + 1, n)."""
        return self.point[:, self.ocp.states]

    def __len__(self) -> int:
        return len(self.value)

    def __iter__(self) -> Iterator[Solution | None]:
        return (self[k] if found else None for k, found in enumerate(self.solved))

    def __getitem__(self, k: int) -> Solution:
        """One solution.

        Raises:
            SolverError: there is none.
        """
        state, theta, status = self.state[k], self.theta[k], str(self.status[k])
        if not self.solved[k]:
            raise SolverError(status, state, theta)
        return Solution(
            state, theta, float(self.value[k]), self.features[k], int(self.iterations[k]),
            self.seconds / len(self), self.point[k], self.ocp, self.solver[k],
            self.data[k if len(self.data) > 1 else 0], int(self.restarts[k]),
            float(self.violation[k]), status == Status.TAKEN_OVER,
        )  # fmt: skip


def solve_many(
    variant: Variant,
    usable: NDArray[np.bool_],
    states: Matrix,
    thetas: Matrix,
    warm: Batch | None,
    actions: Matrix | None,
    data: NDArray[np.float64],
    threads: int,
) -> Batch:
    """Solve the `usable` rows; the other arguments as in `Nmpc.solve_many`, already checked."""
    began, ocp, count = time.perf_counter(), variant.ocp, len(states)
    size = 2 * ocp.lower.size + ocp.equality.size
    if warm is not None:
        if len(warm) != count:
            raise ValueError(f"warm_starts has {len(warm)} rows; states has {count}")
        check_shape(warm, ocp)  # type: ignore[arg-type]  # it asks for its `ocp` alone
    out, report = np.full((count, size + thetas.shape[1]), np.nan), np.full((count, 6), np.nan)
    status, solver = np.full(count, REFUSED, "<U10"), np.full(count, "", object)
    left = rows = np.flatnonzero(usable)
    if isinstance(variant.solver, Compiled) and rows.size:
        units, given = variant.units, np.zeros((1, variant.units.inputs.size))
        given = given if actions is None else actions / units.inputs
        begin, points = _starts(variant, states, warm)
        each = data, states / units.states, thetas, given, begin, points
        arrays = tuple(one if len(one) == 1 else one[rows] for one in each)
        got, told = np.empty((rows.size, out.shape[1])), np.empty((rows.size, 6))
        _in_threads(variant.solver, int(actions is not None), arrays, got, told, threads)
        good = (told[:, 2] == SOLVED) & (told[:, 0] < ABSURD)
        got[:, :size] *= units.sizes(ocp)
        out[rows[good]], report[rows[good]] = got[good], told[good]
        status[rows] = np.where(told[:, 5] > 0, str(Status.RESTARTED), str(Status.SOLVED))
        solver[rows], left = Riccati.name, rows[~good]
    for k in left.tolist():  # by CasADi's solvers, one at a time
        begin = None if warm is None or not warm.solved[k] else warm[k]
        action = np.empty(0) if actions is None else actions[k]
        known = data[min(k, len(data) - 1)]
        try:
            one = variant.solve(Asked(states[k], thetas[k], begin, action, known, began))
        except SolverError:
            status[k] = FAILED
            continue
        out[k], solver[k], status[k] = np.r_[one.point, one.features], one.solver, str(one.status)
        report[k] = one.value, one.iterations, 0.0, one.violation, 0.0, one.restarts
    return Batch(
        states, thetas, report[:, 0], out[:, size:], status, report[:, 1], report[:, 3],
        report[:, 5], solver, time.perf_counter() - began, out[:, :size], data, ocp,
    )  # fmt: skip


def table(name: str, value: Any, size: int, count: int | None = None) -> Matrix:
    """A copy of shape (B, size); with a `count`, (count, size), of so many rows or one for all."""
    try:
        rows = np.array(value, dtype=float, order="C")  # machine code takes no other
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be an array of rows of {size} numbers") from None
    if count is not None and rows.shape == (size,):
        rows = np.tile(rows, (count, 1))
    if rows.ndim != 2 or rows.shape[1] != size or count not in (None, len(rows)):
        allowed = f"(B, {size})" if count is None else f"({count}, {size}) or ({size},)"
        raise ValueError(f"{name} has shape {rows.shape}; it must be {allowed}")
    return rows


def stage_data(of: Problem, values: Mapping[str, Any], count: int) -> NDArray[np.float64]:
    """d_0, ..., d_N of each problem, shape (count, N + 1, size), or (1, ...) if all have the same.

    An array with two axes in front of its shape is (count, N + 1, ...), a row a problem.
    """
    own = {name for name, one in values.items() if np.ndim(one) == len(of.data_names[name]) + 2}
    base = of.stage_data({name: one for name, one in values.items() if name not in own})[None]
    if not own:
        return base
    return of.data_names.filled(np.repeat(base, count, 0), {name: values[name] for name in own})


def _starts(variant: Variant, states: Matrix, warm: Batch | None) -> tuple[Any, Matrix]:
    """The `Start` of each solve, and the warm starts in the order and units of the solver."""
    ocp, cold = variant.ocp, np.full(len(states), int(Start.COLD))
    points = np.zeros((1, 2 * ocp.lower.size + ocp.equality.size))
    if warm is None:
        return cold, points
    if warm.ocp is ocp:
        points = warm.point / variant.units.sizes(ocp)
    else:
        inside, point_of = variant.units.inside, variant.solver.point_of  # type: ignore[attr-defined]
        points = np.array([points[0] if w is None else point_of(inside(w)) for w in warm])
    same = (warm.state == states).all(axis=1)
    begin = np.where(same, int(Start.SAME), int(Start.SHIFTED))
    return np.where(warm.solved, begin, cold), np.nan_to_num(points)


def _in_threads(
    solver: Compiled, fixed: int, arrays: tuple[Any, ...], out: Matrix, report: Matrix, threads: int
) -> None:
    """Solve all rows of `arrays`, shares of them beside each other."""
    code = load("many", {"__init__": TEXT}).many
    given = solver.code, solver.arguments[1:], fixed, solver.others, solver.drawn, solver.tolerance
    cuts = np.linspace(0, len(out), SHARES * threads + 1).astype(int)

    def share(first: int, end: int) -> None:
        code(*given, first, end, *arrays, out, report)

    if threads == 1:
        share(0, len(out))
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(share, cuts[:-1], cuts[1:]))

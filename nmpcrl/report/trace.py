"""One solve, watched from within: the text of `kernel` run by Python instead of numba.

Machine code cannot be looked into. The functions that numba compiled are still there as Python,
some hundred times slower, and with every step open to a debugger or to `trace`.
"""

from collections.abc import Callable
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Matrix, Vector
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.problem import Problem
from nmpcrl.control.solution import Solution
from nmpcrl.control.solvers.codes import End
from nmpcrl.control.solvers.riccati import Compiled, Riccati, machine_code
from nmpcrl.control.solvers.solver import Asked
from nmpcrl.control.units import Units


def interpreted(of: Problem) -> ModuleType:
    """The solver's functions, and those of its model, as plain Python.

    Replace one of them, `plain.factorise = mine`, and the others call yours.

    Raises:
        CannotCompile: the problem holds an operation that is not known.
    """
    find = machine_code(of).py_func
    kernel = find.__globals__["solve"].py_func.__globals__
    plain, model = ModuleType("riccati"), ModuleType("model")
    for module, names in ((model, vars(kernel["model"])), (plain, find.__globals__ | kernel)):
        own = vars(module)
        own.update({name: one for name, one in names.items() if name not in own})
        for name, found in names.items():
            if hasattr(found, "py_func"):
                own[name] = FunctionType(found.py_func.__code__, own, name)
    vars(plain)["model"] = model
    return plain


def trace(
    ocp: Ocp,
    state: Vector,
    theta: Vector,
    warm_start: Solution | None = None,
    *,
    curvature: bool = True,
    data: Matrix | None = None,
) -> pd.DataFrame:
    """Every iterate of the first start of V_theta(s), from the start to the answer, a row each.

    Without `curvature` the Hessian leaves out dynamics and rows (Gauss-Newton). `ocp` is
    `Nmpc.ocp`, `data` is from `Problem.stage_data`, the other arguments are those of `Nmpc.solve`.

    Columns: error (of the KKT conditions, as the solver judges it), mu (barrier parameter), value
    (of the plan, slacks included), delta (added to every Q_uu in the step from here; nan in the
    last row).
    """
    units = Units(ocp)
    ocp, state = units.ocp, state / units.states
    data = ocp.problem.data if data is None else data
    warm_start = None if warm_start is None else units.inside(warm_start)
    plain = interpreted(ocp.problem)
    solve, soft = plain.solve, np.flatnonzero(ocp.problem.soft)
    rows: list[dict[str, float]] = []
    factors: list[float] = []
    values: list[float] = []

    def judged(norms: Any, task: Any, point: Any, _duals: Any, _stages: Any, mu: float) -> None:
        stationarity, complementarity, largest = norms
        objective, _ = plain.measure(task, point, mu)
        slacks = (task.weights * np.maximum(0, point.h)).reshape(-1, task.rows)[task.begin :, soft]
        error, value = max(stationarity / largest, complementarity, mu), objective + slacks.sum()
        rows.append({"error": error, "mu": mu, "value": value, "delta": np.nan})

    def factorised(_done: bool, _stages: Any, delta: float, *_: Any) -> None:
        if rows:  # else of the way back to the plan of a warm start
            rows[-1]["delta"] = delta

    def first_alone(*arguments: Any) -> tuple[Any, ...]:
        value, iterations, *_ = solve(*arguments)
        values.append(value)
        return 0.0, iterations, float(End.SOLVED), 0.0, 0.0

    vars(plain)["solve"] = first_alone
    _watch(plain, "scale", lambda factor, *_: factors.append(factor))
    _watch(plain, "residuals", judged)
    _watch(plain, "factorise", factorised)
    if not curvature:
        _straighten(plain)
    with np.errstate(all="ignore"):
        Compiled(ocp, plain.find, Riccati(starts=1)).solve(
            Asked(state, theta, warm_start, np.empty(0), data, 0.0)
        )
    iterates = pd.DataFrame(rows).rename_axis("iteration").astype(float)
    iterates.loc[iterates.index[-1], "delta"] = np.nan  # a look at the curvature of the solution
    iterates["value"] = values[0] + factors[0] * (iterates.value - iterates.value.iloc[-1])
    return iterates


def _watch(plain: ModuleType, name: str, note: Callable[..., None]) -> None:
    """Call `note(result, *arguments)` after each call of a function."""
    function = getattr(plain, name)

    def watched(*arguments: Any) -> Any:
        result = function(*arguments)
        note(result, *arguments)
        return result

    setattr(plain, name, watched)


def _straighten(plain: ModuleType) -> None:
    """Differentiate as if dynamics and rows were linear."""
    linearise, expand_rows = plain.linearise, plain.expand_rows

    def without_costates(task: Any, point: Any, duals: Any, stages: Any, costates: Matrix) -> None:
        linearise(task, point, duals, stages, np.zeros_like(costates))

    def gradients_alone(task: Any, x: Matrix, u: Matrix, i: int, stages: Any) -> None:
        hessians = stages.Q[i], stages.S[i], stages.R[i]
        before = [one.copy() for one in hessians]
        expand_rows(task, x, u, i, stages)
        for one, old in zip(hessians, before, strict=True):
            one[:] = old

    vars(plain).update(linearise=without_costates, expand_rows=gradients_alone)

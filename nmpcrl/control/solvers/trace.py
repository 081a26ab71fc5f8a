"""One solve, watched from within: the text of `kernel` run by Python instead of numba.

Machine code cannot be looked into. The functions that numba compiled are still there as Python,
some hundred times slower, and with every step open to a debugger or to `trace`.
"""

from collections.abc import Callable
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.control.ocp import TaskOcp
from nmpcrl.control.plant import Plant
from nmpcrl.control.solution import Solution
from nmpcrl.control.solvers.codes import End
from nmpcrl.control.solvers.riccati import Code, InteriorPoint, machine_code


def interpreted(plant: Plant) -> ModuleType:
    """The solver's functions, and those of its model, as plain Python.

    Replace one of them, `plain.factorise = mine`, and the others call yours.

    Raises:
        CannotCompile: numba is missing.
    """
    plain = ModuleType("riccati")
    names = vars(plain)
    solve = machine_code(plant).solve.py_func
    names.update(solve.__globals__["iterate"].py_func.__globals__)
    names.update(solve.__globals__)
    for name, found in list(names.items()):
        if hasattr(found, "py_func"):
            names[name] = FunctionType(found.py_func.__code__, names, name)
    return plain


def trace(
    ocp: TaskOcp,
    state: Vector,
    theta: Vector,
    warm_start: Solution | None = None,
    *,
    curvature: bool = True,
) -> pd.DataFrame:
    """Every iterate of V_theta(s)'s first start, from the start to the answer.

    Args:
        ocp: with u_0 free, as `Nmpc.ocp` is.
        state: as in `Nmpc.solve`, as the next two.
        theta: shape (2n + m + 1,).
        warm_start: an earlier solution to start from.
        curvature: False drops from the Hessian how dynamics and obstacles bend (Gauss-Newton).

    Returns:
        A row an iterate. Columns: error (of the KKT conditions, as the solver judges it), mu
        (barrier parameter), value (of the plan, slacks included), delta (what every Q_uu got on top
        in the step from here; nan in the last row).
    """
    plain = interpreted(ocp.plant)
    rows: list[dict[str, float]] = []
    factor = [1.0]

    def judged(norms: Any, task: Any, point: Any, _duals: Any, _stages: Any, mu: float) -> None:
        stationarity, complementarity, largest = norms
        objective, _ = plain.evaluate(task, point, mu)
        obstacles = len(task.discs)
        slacks = task.weights[:, :obstacles] * np.maximum(0, point.h[:, :obstacles])
        error, value = max(stationarity / largest, complementarity, mu), objective + slacks.sum()
        rows.append({"error": error, "mu": mu, "value": value, "delta": np.nan})

    def factorised(_done: bool, _stages: Any, delta: float, *_: Any) -> None:
        rows[-1]["delta"] = delta

    _watch(plain, "scaled", lambda result, *_: factor.append(result[1]))
    _watch(plain, "residuals", judged)
    _watch(plain, "factorise", factorised)
    if not curvature:
        _straighten(plain)
    code = Code(
        lambda *arguments: (*plain.solve(*arguments)[:2], End.SOLVED, 0.0, 0.0),
        machine_code(ocp.plant).hessian_times,
    )
    with np.errstate(all="ignore"):
        InteriorPoint(ocp, code).solve(state, theta, warm_start, began=0.0)
    at_state = np.maximum(0, ocp.task.overlap(state) + theta[-1]).sum()
    iterates = pd.DataFrame(rows).rename_axis("iteration").astype(float)
    iterates["value"] = factor[-1] * iterates["value"] + ocp.slack_weight * at_state
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
    """Differentiate as if dynamics and obstacles were straight lines."""
    expand, expand_path = plain.expand_stage, plain.expand_constraint

    def without_costate(*arguments: Any) -> None:
        *point, costate = arguments[:6]
        expand(*point, np.zeros_like(costate), *arguments[6:])

    def without_hessian(x: Any, theta: Any, disc: Any, hx: Any, hxx: Any) -> None:
        expand_path(x, theta, disc, hx, hxx)
        hxx[:] = 0.0

    vars(plain).update(expand_stage=without_costate, expand_constraint=without_hessian)

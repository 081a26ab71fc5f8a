"""One solve, watched from within: the text of `kernel` run by Python instead of numba.

Machine code cannot be looked into. The functions that numba compiled are still there as Python,
some hundred times slower, and with every step open to a debugger or to `trace`.
"""

from collections.abc import Callable
from types import FunctionType, ModuleType
from typing import Any

import casadi as ca
import numpy as np
import pandas as pd

from nmpcrl import Matrix, Vector
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.problem import Problem
from nmpcrl.control.solution import Solution
from nmpcrl.control.solvers.codes import End
from nmpcrl.control.solvers.riccati import Compiled, Riccati, machine_code
from nmpcrl.control.units import Units


def interpreted(of: Problem) -> ModuleType:
    """The solver's functions, and those of its model, as plain Python.

    Replace one of them, `plain.factorise = mine`, and the others call yours.

    Raises:
        CannotCompile: numba is missing.
    """
    plain = ModuleType("riccati")
    names = vars(plain)
    find = machine_code(of).py_func
    solve = find.__globals__["solve"].py_func
    for function in (solve.__globals__["iterate"].py_func, solve, find):
        names.update(function.__globals__)
    for name, found in list(names.items()):
        if hasattr(found, "py_func"):
            names[name] = FunctionType(found.py_func.__code__, names, name)
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
    """Every iterate of V_theta(s)'s first start, from the start to the answer.

    Args:
        ocp: with u_0 free, as `Nmpc.ocp` is.
        state: as in `Nmpc.solve`, as the next two.
        theta: shape (2n + m + 1,), or that of a problem's theta.
        warm_start: an earlier solution to start from.
        curvature: False drops from the Hessian how dynamics and obstacles bend (Gauss-Newton).
        data: of a problem, as `Problem.stage_data` gives them; its own if absent.

    Returns:
        A row an iterate. Columns: error (of the KKT conditions, as the solver judges it), mu
        (barrier parameter), value (of the plan, slacks included), delta (what every Q_uu got on top
        in the step from here; nan in the last row).
    """
    units = Units(ocp)
    ocp, state = units.ocp, state / units.states
    warm_start = None if warm_start is None else units.inside(warm_start)
    plain = interpreted(ocp.problem)
    known = ocp.problem.data if data is None else data
    rows: list[dict[str, float]] = []
    factor: list[float] = []

    def judged(norms: Any, task: Any, point: Any, _duals: Any, _stages: Any, mu: float) -> None:
        stationarity, complementarity, largest = norms
        objective, _ = plain.measure(task, point, mu)
        beyond, weights = (
            np.reshape(of_rows, (-1, task.rows))[task.begin :, np.flatnonzero(ocp.problem.soft)]
            for of_rows in (np.maximum(0, point.h), task.weights)
        )
        slacks = (weights * beyond).sum()
        error, value = max(stationarity / largest, complementarity, mu), objective + slacks
        rows.append({"error": error, "mu": mu, "value": value, "delta": np.nan})

    def factorised(_done: bool, _stages: Any, delta: float, *_: Any) -> None:
        rows[-1]["delta"] = delta

    _watch(plain, "scale", lambda size, *_: factor.append(size))
    _watch(plain, "residuals", judged)
    _watch(plain, "factorise", factorised)
    if not curvature:
        _straighten(plain)
    with np.errstate(all="ignore"):
        _point(ocp, plain).solve(state, theta, warm_start, began=0.0, data=known)
    iterates = pd.DataFrame(rows).rename_axis("iteration").astype(float)
    iterates.loc[iterates.index[-1], "delta"] = np.nan  # not that of the look at its curvature
    iterates["value"] = factor[-1] * iterates["value"] + _settled(ocp, state, theta, known)
    return iterates


def _point(ocp: Ocp, plain: ModuleType) -> Compiled:
    """The OCP with plain Python for its machine code, and its first start taken as it ends."""
    solve = plain.solve

    def taken(*arguments: Any) -> tuple[Any, ...]:
        return (0.0, solve(*arguments)[1], float(End.SOLVED), 0.0, 0.0)

    vars(plain)["solve"] = taken
    return Compiled(ocp, plain.find, Riccati(starts=1))


def _settled(ocp: Ocp, state: Vector, theta: Vector, data: Matrix) -> float:
    """What the value has of the state alone."""
    of, e = ocp.problem, ocp.problem.expressions
    initial = ca.Function("initial", [e.x, e.theta, e.d], [e.initial])
    which, rows, _ = ocp.settled(np.concatenate([state, theta, data.ravel()]))
    beyond = ocp.slack_weights[which] @ np.maximum(0, rows)
    return float(initial(state, theta, of.own(data[0]))) + float(beyond)


def _watch(plain: ModuleType, name: str, note: Callable[..., None]) -> None:
    """Call `note(result, *arguments)` after each call of a function."""
    function = getattr(plain, name)

    def watched(*arguments: Any) -> Any:
        result = function(*arguments)
        note(result, *arguments)
        return result

    setattr(plain, name, watched)


def _straighten(plain: ModuleType) -> None:
    """Differentiate as if dynamics and rows were straight lines."""
    names = vars(plain)
    names["expand_stage"] = _without(plain.expand_stage, 5)  # costate
    for name in ("expand_fixed", "expand_line"):
        names[name] = _straight(names[name])


def _straight(expand: Callable[..., None]) -> Callable[..., None]:
    """What rows add to a stage but for their curvature."""

    def called(*arguments: Any) -> None:
        *_, Q, S, R = arguments[: -2 if "line" in expand.__name__ else -1]
        before = [one.copy() for one in (Q, S, R)]
        expand(*arguments)
        for one, old in zip((Q, S, R), before, strict=True):
            one[:] = old

    return called


def _without(function: Callable[..., None], *places: int) -> Callable[..., None]:
    """The function with zeros for some of its arguments."""

    def called(*arguments: Any) -> None:
        function(*(np.zeros_like(a) if k in places else a for k, a in enumerate(arguments)))

    return called

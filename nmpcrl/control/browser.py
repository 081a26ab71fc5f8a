"""What `codegen.browser` compiles of a controller, and the numbers that its host is given."""

from importlib.resources import files
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Vector
from nmpcrl.control.codegen.source import INNER, source
from nmpcrl.control.ocp import transcribe
from nmpcrl.control.plant import Plant
from nmpcrl.control.problem import Problem
from nmpcrl.control.solvers import riccati, stages
from nmpcrl.control.task import Task

ARRAYS = ("data", "lower", "upper", "sides", "kind", "discount", "weights", "others", "drawn")
TASK = '''"""The RL stage cost of a task; `task_cost` is called as `entries`."""

import math

import numpy as np
from numba import carray, float64, njit

from .entries import address, unpacked
from .model import NU, NX


{entered}

{charged}

{inner}def charge(state, action, data):
    """Eq. (20); data are those of a stage, the target and then three numbers an obstacle."""
    total = 0.0
    for at in range(len(state), len(data), 3):
        total += entered(state, data[at:])
    return charged(state, action, data, (total,))


@njit(float64(address, address, address), error_model="numpy")
def task_cost(problem, state, action):
    """The RL stage cost, Eq. (20), with the target and the obstacles of stage 0."""
    data = unpacked(problem, 0)[0][0]
    return charge(carray(state, NX), carray(action, NU), data[0])


EXPORTS = (task_cost,)
'''


def texts(of: Plant | Problem, task: Task | None = None) -> dict[str, str]:
    """The texts to compile, by name of the module; a `Problem` has no task.

    Its functions are those of `solvers.entries`, and of `TASK` where there is a task. All numbers
    that `problem` returns are arguments of the functions.

    Raises:
        CannotCompile: the plant or the task holds an operation that is not known.
    """
    beside = {"entries": files(riccati.__package__).joinpath("entries.py").read_text("utf-8")}
    if not isinstance(of, Problem):
        assert task is not None
        beside["task"] = _task(task, of.m)
        of = task.problem(of, horizon=1, gamma=1.0, slack_weight=1.0)
    return riccati.TEXTS | {"model": stages.write(of.solved)} | beside


def _task(task: Task, inputs: int) -> str:
    """The text of the module `task`, for any target and obstacles."""
    state, action = ca.SX.sym("state", task.start.size), ca.SX.sym("action", inputs)
    target, disc = ca.SX.sym("target", task.start.size), ca.SX.sym("disc", 3)
    total, entered = ca.SX.sym("total"), task.entered(state, *ca.vertsplit(disc))
    given = {"state": state, "action": action, "target": target, "total": total}
    return TASK.format(
        inner=INNER,
        entered=_inner("entered", {"state": state, "disc": disc}, entered),
        charged=_inner("charged", given, task.cost_of(*given.values())),
    )


def _inner(name: str, of: dict[str, ca.SX], result: ca.SX) -> str:
    """The text of a function that machine code calls."""
    function = ca.Function(name, [*of.values()], [result], [*of], ["result"])
    return INNER + source(function, returned=True)


def problem(
    of: Problem, solver: riccati.Riccati = riccati.DEFAULT, *, ties_active: bool = False
) -> dict[str, Any]:
    """The numbers that a host passes to the module, for JSON.

    These are the sizes that `solvers.stages` names, the units of states and inputs, in which all
    else is given, and the `ARRAYS`: `riccati.Arguments` with `kind` for u_0 free and given, and the
    inputs of `others` and `drawn`, which `find` explains. A W of None is infinite.
    """
    solved, e = of.solved, of.expressions
    ocps = [transcribe(solved, fix_action=one, ties_active=ties_active) for one in (False, True)]
    free, given = (riccati.Compiled(ocp, None, solver) for ocp in ocps)
    fixed = e.fixed.numel()
    parts = free.arguments._asdict() | {
        "kind": [free.arguments.kind, given.arguments.kind],
        "weights": [weight if weight < np.inf else None for weight in of.weights.tolist()],
        "others": free.others,
        "drawn": free.drawn,
        "units": of.sizes[0],
        "input_units": of.sizes[1],
    }
    return {name: np.asarray(part).tolist() for name, part in parts.items()} | {
        "states": of.states,
        "inputs": of.inputs,
        "theta": of.theta.size,
        "soft": int(of.soft[:fixed].sum()),
        "fixed": fixed,
        "per": e.each.numel(),
        "own": of.own_names.size,
        "width": e.line.numel(),
        "tolerance": solver.tolerance,
    }


def packed(described: dict[str, Any]) -> Vector:
    """The result of `problem` as one array, whose address the module's functions take."""
    arrays = {name: np.array(described[name], float) for name in ARRAYS}
    arrays["weights"][np.isnan(arrays["weights"])] = np.inf
    lines = (arrays["weights"].size - described["fixed"]) // max(described["per"], 1)
    counts = [len(arrays[name]) for name in ("sides", "others", "drawn")]
    head = [len(arrays["discount"]) - 1, lines, *counts, described["tie"]]
    return np.concatenate([head, *(one.ravel() for one in arrays.values())])

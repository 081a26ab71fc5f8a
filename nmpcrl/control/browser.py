"""A controller as WebAssembly: the solver that trains every run, for any other host."""

from importlib.resources import files

import casadi as ca
import numpy as np

from nmpcrl.control.codegen import browser
from nmpcrl.control.codegen.source import source
from nmpcrl.control.ocp import transcribe as transcribe_problem
from nmpcrl.control.plant import Plant
from nmpcrl.control.problem import Problem
from nmpcrl.control.solvers import riccati, stages
from nmpcrl.control.solvers.charge import DISCS, LONGEST
from nmpcrl.control.solvers.starts import cold_inputs, random_inputs
from nmpcrl.control.task import Task
from nmpcrl.control.units import sizes_in

HEADER = '''"""The RL stage cost of a task, and inputs to start from."""

import math

import numpy as np
from numba import njit

DISCS, LONGEST = {discs}, {longest}
WARM_LIMIT, COLD_LIMIT = {warm}, {cold}
RANDOM_INPUTS = np.array({inputs})


@njit(error_model="numpy", forceinline=True)
'''
BEGIN = f'''"""What `Riccati` does where nothing is known: the best plan of its cold starts.

But for the one that a `Regulator` holds by feedback.
"""

import numpy as np
from numba import carray, float64, int32, njit

from .entries import *
from .settled import COLD_INPUTS


@njit(int32(address, address, address, float64, address, address), error_model="numpy")
def nmpc_begin(data, state, theta, tolerance, out, report):
    """As `nmpc_solve` with u_0 free and no warm start; the arguments are as there."""
    end = nmpc_solve(data, state, theta, out, 0, UNKNOWN, out, tolerance, out, report)
    sizes, (z, lam) = sizes_of(0), lengths(N, ROWS, 0)
    size, report_ = len(sizes) + NTHETA, carray(report, 5)
    result, other = carray(out, size), np.empty(size)
    for k in range(len(COLD_INPUTS) if end == SOLVED else 0):
        point = np.zeros(2 * z + lam)
        for i in range(N):
            for a in range(NU):
                point[i * (NX + NU + ROWS) + NX + a] = COLD_INPUTS[k, i, a]
        value, iterations, ended, _, error = solve(
            carray(data, DATA.shape), LOWER.copy(), UPPER.copy(), KIND[0].copy(),
            DISCOUNT.copy(), WEIGHTS.copy(), FACTOR, TIE,
            divided(carray(state, NX), STATES), carray(theta, NTHETA), np.zeros(NU), 0,
            COLD, COLD_LIMIT, tolerance, point, other,
        )
        if int(ended) == SOLVED and value < report_[0] - {riccati.CLEARLY} * abs(report_[0]):
            report_[0], report_[1], report_[4] = value, iterations, error
            for j in range(size):
                result[j] = other[j] * (sizes[j] if j < len(sizes) else 1.0)
    return end


EXPORTS = (nmpc_begin,)
'''


def module(of: Plant | Problem, task: Task | None = None) -> bytes:
    """One WebAssembly module that solves Eq. (2), steps the plant and charges Eq. (20).

    Target, obstacles, box, horizon and discount are arguments of its functions, which
    `solvers.entries` describes; the plant and the rest of the task are compiled in. Of a `Problem`
    all but data and theta are, and `solvers.rows_entries` and `BEGIN` describe the functions. Made
    once, in about a minute, and kept with the machine code.

    Raises:
        CannotCompile: the plant or the task holds an operation that is not known.
        RuntimeError: numba is missing, or cannot compile this.
        CannotLink: they call more than the functions that every host has.
    """
    return browser.from_texts(texts(of, task))


def texts(of: Plant | Problem, task: Task | None = None) -> dict[str, str]:
    """What is compiled: the text of each module by its name; a `Problem` has no task."""
    if isinstance(of, Problem):
        return _texts_of_problem(of)
    assert task is not None
    return _texts_of_task(of, task)


def _texts_of_task(plant: Plant, task: Task) -> dict[str, str]:
    here = files(riccati.__package__)
    return {
        **{name: riccati.TEXTS[name] for name in (*riccati.STAGES, "solve", "hessian_times")},
        "model": stages.write(plant),
        "charge": _charge(plant, task),
        **{name: here.joinpath(f"{name}.py").read_text("utf-8") for name in ("points", "entries")},
    }


def _texts_of_problem(problem: Problem) -> dict[str, str]:
    here, solved = files(riccati.__package__), problem.solved
    names = ("codes", "kernel", "rows", "rows_solve", "rows_slopes")
    return {
        **{name: riccati.TEXTS[name] for name in names},
        **problem_stages.write(solved),
        "settled": _settled(problem, solved),
        "points": here.joinpath("points.py").read_text("utf-8"),
        "entries": here.joinpath("rows_entries.py").read_text("utf-8"),
        "begin": BEGIN,
    }


def _settled(problem: Problem, solved: Problem) -> str:
    """The text of the module `settled`."""
    ocps = [transcribe_problem(problem, fix_action=fixed) for fixed in (False, True)]
    points = [riccati.ProblemPoint(transcribe_problem(solved, fix_action=fixed), None)
              for fixed in (False, True)]  # fmt: skip
    data, lower, upper, free, discount, weights, factor, tie = points[0].problem
    inputs = [random_inputs(solved, seed, problem.horizon) for seed in range(riccati.PERTURBED)]
    cold = cold_inputs(solved, problem.horizon, riccati.DEFAULT.starts_of(ocps[0]) - 1)
    arrays = {
        "LOWER": lower,
        "UPPER": upper,
        "STATES": problem.sizes[0],
        "INPUTS": problem.sizes[1],
        "SIZES": np.concatenate([sizes_in(ocp, *problem.sizes) for ocp in ocps]),
        "DISCOUNT": discount,
        "WEIGHTS": weights,
        "KIND": np.array([free, points[1].problem[3]]),
        "DATA": data,
        "THETA": problem.theta,
        "THETA_LOWER": problem.theta_lower,
        "THETA_UPPER": problem.theta_upper,
        "RANDOM_INPUTS": np.array(inputs),
        "COLD_INPUTS": np.reshape(cold, (-1, *inputs[0].shape)),
    }
    numbers = {
        "N": problem.horizon,
        "ROWS": weights.size,
        "WARM_LIMIT": riccati.WARM_LIMIT,
        "COLD_LIMIT": riccati.COLD_LIMIT,
        "FACTOR": factor,
        "TIE": tie,
    }
    lines = ["from math import inf", "", "import numpy as np", ""]
    lines += [f"{name} = {number!r}" for name, number in numbers.items()]
    lines += [
        f"{name} = np.array({one.ravel().tolist()}, np.{one.dtype}).reshape({one.shape})"
        for name, one in arrays.items()
    ]
    return "\n".join(lines) + "\n"


def _charge(plant: Plant, task: Task) -> str:
    """The text of the module `charge`: the signatures are those of `solvers.charge`."""
    state, action = ca.SX.sym("state", plant.n), ca.SX.sym("action", plant.m)
    target, discs = ca.SX.sym("target", plant.n), ca.SX.sym("discs", DISCS, 3)
    cost = task.cost_of(state, action, target, tuple(ca.horzsplit(discs)))
    names = ["state", "action", "target", "discs"]
    function = ca.Function("charge", [state, action, target, discs], [cost], names, ["cost"])
    inputs = [random_inputs(plant, seed, LONGEST) for seed in range(riccati.PERTURBED)]
    header = HEADER.format(
        discs=DISCS,
        longest=LONGEST,
        warm=riccati.WARM_LIMIT,
        cold=riccati.COLD_LIMIT,
        inputs=np.array(inputs).tolist(),
    )
    return header + source(function)

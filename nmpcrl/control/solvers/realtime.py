"""Real-time iteration: a solve that begins warm makes some Newton steps and no more."""

from functools import partial
from typing import Any

from nmpcrl.control.codegen.jit import load
from nmpcrl.control.problem import Problem
from nmpcrl.control.solvers import stages
from nmpcrl.control.solvers.riccati import NOTICE, TEXTS, Riccati
from nmpcrl.control.vectors import integer

TEXT = """import numpy as np
from numba import njit

from . import find as whole
from .kernel import COLD, LIMIT, SOLVED, options, solve


@njit(whole.SIGNATURE, cache=True, **options)
def find(
    data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
    others, drawn, start, tolerance, warm_start, out,
):
    if start != COLD:
        value, iterations, ended, violation, error = solve(
            data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
            start, {steps}, tolerance, drawn[0], warm_start, out,
        )
        if (ended == SOLVED or ended == LIMIT) and value < np.inf:
            return value, iterations, float(SOLVED), violation, error, 0.0
    return whole.find(
        data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
        others, drawn, start, tolerance, warm_start, out,
    )
"""


def real_time(steps: int = 1) -> Riccati:
    """Riccati, whose solves from a warm start make at most so many Newton steps.

    Nmpc(problem, solver=real_time()) acts on a plan that is near an optimum, and nearer at each
    step of the closed loop, in a fixed time: the real-time iteration of Diehl et al. (2005).
    `value` is that of the plan, and `features` holds with its multipliers, as far as these are
    right; further derivatives need an optimum. A cold solve, and one whose steps fail, go on to it.
    """
    return Riccati(code=partial(_limited, integer("steps", steps)))


def _limited(steps: int, problem: Problem) -> Any:
    """The function `find` of `TEXT`, compiled for a problem once."""
    name = f"real time {steps}"
    if name not in problem.machine_code:
        texts = {name: TEXTS[name] for name in ("codes", "kernel", "find")}
        texts |= {"__init__": TEXT.replace("{steps}", str(steps)), "model": stages.write(problem)}
        problem.machine_code[name] = load("riccati", texts, NOTICE).find
    return problem.machine_code[name]

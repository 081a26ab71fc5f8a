"""The optimum of a `Problem` by one start after another, as every host asks for it."""

import numpy as np
from numba import float64, int64, njit, types

from .codes import End, Start
from .kernel import PROBLEM, inner, lines_of, options, tensor, vector
from .model import NU, NX, PER, SOFT
from .solve import solve

COLD, SHIFTED, NEAR, SAME = map(int, Start)
SOLVED = int(End.SOLVED)
WARM_LIMIT = 40  # iterations from a warm start
COLD_LIMIT = 200  # iterations from standing still
CLEARLY = 1e-6  # a plan is better if its value is less by this share
LEAVES = 1e-9  # and it violates hard rows by no more than this

SIGNATURE = types.UniTuple(float64, 6)(
    *PROBLEM,
    tensor, tensor,  # inputs of the cold starts that are compared, and of those that come last
    int64, float64,  # start, tolerance
    vector, vector,  # warm start and result
)  # fmt: skip


@njit(**inner, **options)
def planned(inputs, data, standing):
    """A warm start with these inputs and nothing else."""
    point = standing.copy()
    for i in range(len(inputs)):
        for a in range(NU):
            point[i * (NX + NU + SOFT + PER * lines_of(data)) + NX + a] = inputs[i, a]
    return point


@njit(SIGNATURE, cache=True, **options)
def find(
    data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
    others, drawn, start, tolerance, warm_start, out,
):  # fmt: skip
    """Solve from a warm start, else standing still, else from `drawn` inputs (count, N, NU).

    Without a warm start, `start` being COLD, the best plan of standing still and of `others` is
    taken. Returns what `solve` does, of the start that counts, and the number of starts that failed
    before it; see `solve` for the other arguments.
    """
    value, iterations, ended, violation, error, failed = np.inf, 0.0, -1.0, 0.0, np.inf, 0
    standing = np.zeros(warm_start.size)
    for attempt in range(3 + len(drawn)):
        begin, limit, point = COLD, COLD_LIMIT, standing
        if attempt < 2:
            if start == COLD or (attempt == 1 and start == SHIFTED):
                continue
            begin, limit, point = (start if attempt == 0 else NEAR), WARM_LIMIT, warm_start
        elif attempt > 2:
            point = planned(drawn[attempt - 3], data, standing)
        value, iterations, ended, violation, error = solve(
            data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
            begin, limit, tolerance, point, out,
        )  # fmt: skip
        if ended == SOLVED and value < np.inf:
            if start == COLD:
                break
            return value, iterations, ended, violation, error, float(failed)
        failed += 1
    if ended != SOLVED or not value < np.inf:
        return value, iterations, ended, violation, error, float(failed)
    other = np.empty(out.size)
    for k in range(len(others)):
        point = planned(others[k], data, standing)
        found, taken, end, beyond, left = solve(
            data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
            COLD, COLD_LIMIT, tolerance, point, other,
        )  # fmt: skip
        less = found < value - CLEARLY * abs(value)
        if end == SOLVED and less and beyond <= violation + LEAVES:
            value, iterations, violation, error = found, taken, beyond, left
            out[:] = other
    return value, iterations, ended, violation, error, float(failed)

"""The optimum of a `Problem` by one start after another, as every host asks for it."""

import numpy as np
from numba import float64, int64, njit, types

from .kernel import COLD, HELD, NEAR, PROBLEM, SAME, SOLVED, options, solve, tensor, vector
from .model import NU

WARM_LIMIT = 40  # iterations from a warm start
COLD_LIMIT = 300  # iterations from a cold one
CLEARLY = 1e-6  # a plan is better if its value is less by this share
LEAVES = 1e-6  # and if it violates hard rows by less than this

SIGNATURE = types.UniTuple(float64, 6)(
    *PROBLEM,
    tensor, tensor,  # inputs of the cold starts that are compared, and of those that come last
    int64, float64,  # start, tolerance
    vector, vector,  # warm start and result
)  # fmt: skip


@njit(SIGNATURE, cache=True, **options)
def find(
    data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
    others, drawn, start, tolerance, warm_start, out,
):  # fmt: skip
    """Solve from a warm start; else from cold ones, of which the best plan counts.

    Cold starts are inputs at rest, inputs held by feedback (`kernel.regulate`), and `others`, of
    shape (count, N, NU); where these are none, the first start that succeeds counts. `drawn`
    inputs, (count, N, NU), are tried one by one where none does. `start` is COLD, or SHIFTED or
    SAME with a `warm_start`. Returns what `solve` does, of the start that counts, and the number of
    starts that failed before one succeeded; see `solve` for the other arguments.
    """
    value, iterations, ended, violation, error = np.inf, 0.0, -1.0, np.inf, np.inf
    failed, found, into = 0.0, False, out
    rest, last = np.zeros((len(discount) - 1, NU)), 4 + len(others)
    for attempt in range(last + len(drawn)):
        begin, limit, inputs = COLD, COLD_LIMIT, rest
        if attempt < 2:
            if start == COLD or (attempt == 1 and start != SAME):
                continue
            begin, limit = (start if attempt == 0 else NEAR), WARM_LIMIT
        elif found and (attempt >= last or last == 4):
            break
        elif attempt == 3:
            begin = HELD
        elif attempt > 3:
            inputs = others[attempt - 4] if attempt < last else drawn[attempt - last]
        reached, taken, end, beyond, left = solve(
            data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
            begin, limit, tolerance, inputs, warm_start, into,
        )  # fmt: skip
        solved = end == SOLVED and reached < np.inf
        if not found and not solved:
            failed += 1.0
        less = beyond <= violation + LEAVES and reached < value - CLEARLY * abs(value)
        if not found or (solved and (less or beyond < violation - LEAVES)):
            value, iterations, ended, violation, error = reached, taken, end, beyond, left
            if found:
                for k in range(len(out)):
                    out[k] = into[k]
        if solved and attempt < 2:
            break
        if solved and not found:
            found, into = True, np.empty(out.size)
    return value, iterations, ended, violation, error, failed

"""A `Problem` solved by `kernel`: the function that is called."""

import numpy as np
from numba import float64, int64, njit, types

from .kernel import (
    ABSURD,
    COLD,
    DELTA_FIRST,
    DELTA_GROWS,
    DELTA_LARGEST,
    PROBLEM,
    RIGID,
    SADDLE,
    SOLVED,
    START_MU,
    allocate,
    begin_multipliers,
    begin_rows,
    condense,
    factorise,
    follow,
    iterate,
    linearise,
    measure,
    options,
    recall,
    scaled,
    vector,
    write_solution,
)
from .model import NX

FLAT = 1e-6  # curvature of the scaled problem that counts as none

SIGNATURE = types.UniTuple(float64, 5)(
    *PROBLEM,
    int64, int64, float64,  # start, limit, tolerance
    vector, vector,  # warm start and result
)  # fmt: skip


@njit(SIGNATURE, cache=True, **options)
def solve(
    data, lower, upper, sides, kind, discount, weights, tie,
    state, theta, action, fixed, start, limit, tolerance, warm_start, out,
):  # fmt: skip
    """Solve a problem; see `riccati.Arguments` for the first arguments.

    Returns value, iterations, the end, the violation of hard rows, and the relative error; `out`
    receives z, lam and nu in the order of `Ocp`, as `warm_start` has them, and then the gradient.
    A plan with a state beyond `ABSURD` is none: its value is infinite.
    """
    N = len(discount) - 1
    point, trial, duals, stages, step = allocate(N, len(weights) + len(sides))
    mu = START_MU[start]
    task, factor = scaled(
        theta, data, lower, upper, sides, kind, discount, weights, fixed, point, state, action,
        start, warm_start,
    )  # fmt: skip
    begin_multipliers(task, point, duals, start, mu, factor, warm_start)
    if start != COLD and recall(task, start, warm_start, point, trial):
        measure(task, trial, mu)
        begin_rows(task, trial, duals, start, mu, factor, warm_start)
        linearise(task, trial, duals, stages)
        condense(task, trial, duals, stages, mu)
        added = 0.0
        while not factorise(stages, added, task.first, step) and added < DELTA_LARGEST:
            added = max(DELTA_GROWS * added, DELTA_FIRST)
        follow(task, trial, step, 0.0, point)
    for a in range(NX):
        trial.x[0, a] = state[a]
    objective, total = measure(task, point, mu)
    begin_rows(task, point, duals, start, mu, factor, warm_start)
    point, objective, iterations, ended, error = iterate(
        task, point, trial, duals, stages, step, mu, objective, total, limit, tolerance
    )
    if ended == SOLVED and start == COLD:  # a plan that is no minimum is not left by chance
        condense(task, point, duals, stages, RIGID)
        if not factorise(stages, FLAT, task.first, step):
            ended = SADDLE
    value, violation, largest = write_solution(
        task, point, duals, stages, objective, factor, tie, out
    )
    if not largest <= ABSURD:
        value = np.inf
    return value, float(iterations), float(ended), violation, error

"""A `Problem` solved by `kernel` and `rows`: the function that is called."""

import numpy as np
from numba import float64, int64, njit, types

from .kernel import (
    COLD,
    DELTA_FIRST,
    DELTA_GROWS,
    DELTA_LARGEST,
    RIGID,
    SADDLE,
    SOLVED,
    START_MU,
    factorise,
    initialise,
    iterate,
    options,
    vector,
)
from .model import NX
from .rows import (
    ABSURD,
    PROBLEM,
    allocate,
    condense,
    evaluate,
    follow,
    grows,
    initialise_rows,
    linearise,
    measure,
    recall,
    scaled,
    write_solution,
)

FLAT = 1e-6  # curvature of the scaled problem that counts as none

SIGNATURE = types.UniTuple(float64, 5)(
    *PROBLEM,
    int64, int64, float64,  # start, limit, tolerance
    vector, vector,  # warm start and result
)  # fmt: skip


@njit(SIGNATURE, cache=True, **options)
def solve(
    data, lower, upper, kind, discount, weights, factor, tie,
    state, theta, action, fixed, start, limit, tolerance, warm_start, out,
):  # fmt: skip
    """Solve a problem; see `ProblemPoint` for the arguments, and `solve.solve` for the rest.

    Returns value, iterations, the end, 0, and the relative error. A plan with a state beyond
    `ABSURD` is none: its value is infinite.
    """
    task, factor = scaled(theta, data, lower, upper, kind, discount, weights, factor, fixed, state)
    point, trial, duals, stages, step = allocate(len(discount) - 1)
    mu = START_MU[start]
    initialise(task, point, duals, state, action, start, mu, factor, warm_start)
    for a in range(NX):
        trial.x[0, a] = state[a]
    objective, total = evaluate(task, point, mu)
    initialise_rows(task, point, duals, start, mu, factor, warm_start)
    if start == COLD:
        task.held[0] = grows(task, point)
    else:
        recall(task, start, warm_start, point.u, trial)
        task.held[0] = grows(task, trial)
        if task.held[0]:
            measure(task, trial, mu)
            linearise(task, trial, duals, stages)
            condense(task, trial, duals, stages, mu)
            added = 0.0
            while not factorise(stages, added, task.first, step) and added < DELTA_LARGEST:
                added = max(DELTA_GROWS * added, DELTA_FIRST)
            follow(task, trial, step, 0.0, point)
            objective, total = measure(task, point, mu)
            initialise_rows(task, point, duals, start, mu, factor, warm_start)
        for a in range(NX):
            trial.x[0, a] = state[a]
    point, objective, iterations, ended, error = iterate(
        task, point, trial, duals, stages, step, mu, objective, total, limit, tolerance
    )
    if ended == SOLVED and start == COLD:  # a plan that is no minimum is not left by chance
        condense(task, point, duals, stages, RIGID)
        if not factorise(stages, FLAT, task.first, step):
            ended = SADDLE
    value, largest = write_solution(task, point, duals, stages, objective, factor, tie, out)
    if not largest <= ABSURD:
        value = np.inf
    return value, float(iterations), float(ended), 0.0, error

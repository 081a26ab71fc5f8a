"""A `Problem` solved by `kernel` from one start."""

import numpy as np
from numba import njit

from .kernel import (
    ABSURD,
    COLD,
    DELTA_FIRST,
    DELTA_GROWS,
    DELTA_LARGEST,
    HELD,
    RIGID,
    SADDLE,
    SOLVED,
    START_MU,
    WITHIN,
    allocate,
    begin_inputs,
    begin_multipliers,
    begin_rows,
    condense,
    described,
    factorise,
    follow,
    inner,
    iterate,
    linearise,
    measure,
    options,
    recall,
    regulate,
    roll,
    scale,
    write_solution,
)
from .model import NTHETA, NX

FLAT = 1e-6  # curvature of the scaled problem that counts as none


@njit(**inner, **options)
def solve(
    data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
    start, limit, tolerance, inputs, warm_start, out,
):  # fmt: skip
    """Solve a problem from one start; see `riccati.Arguments` for the first arguments.

    Returns value, iterations, the end, the violation of hard rows, and the relative error; `out`
    receives z, lam and nu in the order of `Ocp`, as `warm_start` has them, and then the gradient.
    A cold start takes `inputs`, (N, NU), and a warm one `warm_start`. A plan with a state beyond
    `ABSURD` is none: its value is infinite.
    """
    task = described(theta, data, lower, upper, sides, kind, discount, weights, fixed)
    point, trial, duals, stages, step = allocate(len(discount) - 1, task.rows)
    mu, cold = START_MU[start], start in (COLD, HELD)
    begin_inputs(task, point, state, action, start, inputs, warm_start)
    if start == HELD:
        regulate(task, trial, stages, step, point)
    else:
        roll(task, point)
    factor = scale(task, point, weights)
    begin_multipliers(task, point, duals, start, mu, factor, warm_start)
    if not cold and recall(task, start, warm_start, point, trial):
        measure(task, trial, mu)
        begin_rows(task, trial, duals, start, mu, factor, warm_start)
        linearise(task, trial, duals, stages, stages.p)
        condense(task, trial, duals, stages, mu)
        added = 0.0
        while not factorise(stages, added, task.first, step) and added < DELTA_LARGEST:
            added = max(DELTA_GROWS * added, DELTA_FIRST)
        follow(task, trial, step, 0.0, WITHIN, point)
    for a in range(NX):
        trial.x[0, a] = state[a]
    objective, total = measure(task, point, mu)
    begin_rows(task, point, duals, start, mu, factor, warm_start)
    objective, iterations, ended, error, added, where = iterate(
        task, point, trial, duals, stages, step, mu, objective, total, limit, tolerance
    )
    if where:
        point, trial = trial, point
    if ended == SOLVED and (cold or added > 0.0):  # no plan at a maximum or saddle is a solution
        condense(task, point, duals, stages, RIGID)
        if not factorise(stages, FLAT, task.first, step):
            ended = SADDLE
    value, violation, largest = write_solution(
        task, point, duals, stages, objective, factor, tie, np.empty(NTHETA), out
    )
    if not largest <= ABSURD:
        value = np.inf
    return value, float(iterations), float(ended), violation, error

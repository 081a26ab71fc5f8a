"""Eq. (2) solved by `kernel`: the function that is called."""

from numba import float64, int64, njit, types

from .kernel import (
    PROBLEM,
    START_MU,
    allocate,
    evaluate,
    initialise,
    initialise_rows,
    iterate,
    options,
    scaled,
    vector,
    write_solution,
)
from .model import NX

SIGNATURE = types.UniTuple(float64, 5)(
    *PROBLEM,
    int64, int64, float64,  # start, limit, tolerance
    vector, vector,  # warm start and result
)  # fmt: skip


@njit(SIGNATURE, cache=True, **options)
def solve(
    target, lower, upper, discs, sides, discount, slack_weight, soft_box, tie,
    state, theta, action, fixed, start, limit, tolerance, warm_start, out,
):  # fmt: skip
    """Solve Eq. (2); see `InteriorPoint` for the arguments.

    Returns value, iterations, the end, the violation of the box, and the relative error; `out`
    receives z, lam and nu in the order of `Ocp`, as `warm_start` has them, and then the gradient.
    """
    task, factor = scaled(
        theta, target, lower, upper, discs, sides, discount, slack_weight, soft_box, fixed
    )
    N, M, rows = len(discount) - 1, len(discs), len(discs) + len(sides)
    point, trial, duals, stages, step = allocate(N, M, rows)
    mu = START_MU[start]
    initialise(task, point, duals, state, action, start, mu, factor, warm_start)
    for a in range(NX):
        trial.x[0, a] = state[a]
    objective, total = evaluate(task, point, mu)
    initialise_rows(task, point, duals, start, mu, factor, warm_start)
    point, objective, iterations, ended, error = iterate(
        task, point, trial, duals, stages, step, mu, objective, total, limit, tolerance
    )
    value, violation = write_solution(
        task, point, duals, stages, objective, factor, slack_weight, soft_box, tie, out
    )
    return value, float(iterations), float(ended), violation, error

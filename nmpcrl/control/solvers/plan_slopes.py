"""The gradient in theta of a weighted sum of Eq. (2)'s plan, at a solution: see `rows_slopes`."""

import numpy as np
from numba import njit, types

from .hessian import gradient_along
from .kernel import (
    INSIDE,
    PROBLEM,
    RIGID,
    SAME,
    allocate,
    condense,
    evaluate,
    factorise,
    initialise,
    inlined,
    linearise,
    matrix,
    offsets,
    options,
    rows_along,
    scale_rows,
    scaled,
    sweep,
    vector,
)
from .model import NTHETA, NU, NX


@inlined
def restore_rows(task, duals, factor, solved):
    """The rows' multipliers as they were solved for, upon which the costates depend."""
    last, obstacles = len(duals.lam), len(task.discs)
    variables, constraints = offsets(task, last)
    lam = variables + NX + obstacles
    nu = lam + constraints + obstacles
    for i in range(last):
        variables, constraints = offsets(task, i + 1)
        row = lam + constraints + (NX if i + 1 < last else 0)
        for j in range(duals.lam.shape[1]):
            weight = task.weights[i, j]
            if j < obstacles:
                old = solved[row + j] / factor
            else:
                side = task.sides[j - obstacles]
                old = side[1] * solved[nu + variables + int(side[0])] / factor
            duals.lam[i, j] = min(max(old, INSIDE * weight), (1.0 - INSIDE) * weight)


SIGNATURE = types.boolean(*PROBLEM, vector, matrix, matrix, vector)


@njit(SIGNATURE, cache=True, **options)
def plan_slopes(
    target, lower, upper, discs, sides, discount, slack_weight, soft_box, tie,
    state, theta, action, fixed, solved, of_states, of_inputs, out,
):  # fmt: skip
    """Put the gradient into `out`, shape (NTHETA,); whether it could be formed, as `slopes` says.

    `of_states` (N + 1, NX) and `of_inputs` (N, NU) are the sum's weights.
    """
    task, factor = scaled(
        theta, target, lower, upper, discs, sides, discount, slack_weight, soft_box, fixed
    )
    N, M, rows = len(discount) - 1, len(discs), len(discs) + len(sides)
    point, _, duals, stages, step = allocate(N, M, rows)
    mu = RIGID
    initialise(task, point, duals, state, action, SAME, mu, factor, solved)
    evaluate(task, point, mu)
    restore_rows(task, duals, factor, solved)
    linearise(task, point, duals, stages)
    condense(task, point, duals, stages, mu)
    for i in range(N + 1):
        for a in range(NX):
            stages.q[i, a] = of_states[i, a] / factor
        for a in range(NU if i < N else 0):
            stages.r[i, a] = of_inputs[i, a] / factor
        for j in range(rows if i < N else 0):
            stages.off[i, j] = 0.0
    if not factorise(stages, 0.0, task.first, step):
        return False
    sweep(task, stages, step)
    rows_along(task, stages, step)
    scale_rows(step.lam.ravel(), stages.off.ravel(), stages.stiff.ravel())
    still = np.zeros(NTHETA)
    gradient_along(task, point, duals, step, slack_weight, factor, tie, still, out)
    return True

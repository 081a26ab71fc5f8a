"""The product that `hessian` describes: the function that is called."""

from numba import njit, types

from .hessian import gradient_along, right_hand_side
from .kernel import (
    PROBLEM,
    RIGID,
    SAME,
    allocate,
    condense,
    evaluate,
    factorise,
    initialise,
    initialise_rows,
    linearise,
    options,
    rows_along,
    scale_rows,
    scaled,
    sweep,
    vector,
)

SIGNATURE = types.boolean(*PROBLEM, vector, vector, vector)  # point, w, result


@njit(SIGNATURE, cache=True, **options)
def hessian_times(
    target, lower, upper, discs, sides, discount, slack_weight, soft_box, tie,
    state, theta, action, fixed, solved, w, out,
):  # fmt: skip
    """Put the product with w into `out`, shape (NTHETA,); see `InteriorPoint` for the rest.

    Returns whether it could be formed: not where the solution is no strict minimum.
    """
    task, factor = scaled(
        theta, target, lower, upper, discs, sides, discount, slack_weight, soft_box, fixed
    )
    N, M, rows = len(discount) - 1, len(discs), len(discs) + len(sides)
    point, _, duals, stages, step = allocate(N, M, rows)
    mu = RIGID
    initialise(task, point, duals, state, action, SAME, mu, factor, solved)
    evaluate(task, point, mu)
    initialise_rows(task, point, duals, SAME, mu, factor, solved)
    linearise(task, point, duals, stages)
    condense(task, point, duals, stages, mu)
    right_hand_side(task, point, duals, stages, w)
    if not factorise(stages, 0.0, task.first, step):
        return False
    sweep(task, stages, step)
    rows_along(task, stages, step)
    scale_rows(step.lam.ravel(), stages.off.ravel(), stages.stiff.ravel())
    gradient_along(task, point, duals, step, slack_weight, factor, tie, w, out)
    return True

"""How the KKT system answers to weights on a plan: the solution of K step + weights = 0.

The change of a weighted sum of states and inputs with anything that the problem was given is then
the change of the Lagrangian's gradient in that along the step: the sweep of `slopes`, with weights
on all stages.
"""

from numba import njit, types

from .kernel import (
    PROBLEM,
    costate,
    factorise,
    options,
    places,
    rows_along,
    scale_rows,
    sweep,
    vector,
)
from .model import FIXED, NU, NX, PER
from .slopes import FARTHEST, system

SIGNATURE = types.boolean(*PROBLEM, vector, vector, vector)


@njit(SIGNATURE, cache=True, **options)
def adjoint(
    data, lower, upper, sides, kind, discount, weights, tie,
    state, theta, action, fixed, solved, of_plan, out,
):  # fmt: skip
    """The step of z and lam, in the order of `Ocp`, for weights `of_plan` in the order of z.

    Slacks, and multipliers of x_0 = s and of a given u_0, have no step in `out`. Returns whether
    it could be formed: see `slopes.system`.
    """
    task, _, stages, step, factor, formed = system(
        data, lower, upper, sides, kind, discount, weights, state, theta, action, fixed, solved
    )
    if not formed:
        return False
    N = len(discount) - 1
    z_size, g_size, rows, _, _ = places(N + 1, task.lines, task.first)
    stages.off[:] = 0.0
    for i in range(N + 1):
        for a in range(NX):
            stages.q[i, a] = of_plan[i * z_size + a] / factor
        for a in range(NU if i < N else 0):
            stages.r[i, a] = of_plan[i * z_size + NX + a] / factor
    factorise(stages, 0.0, task.first, step)
    sweep(task, stages, step)
    rows_along(task, stages, step)
    scale_rows(task, stages, step)
    for i in range(N + 1):
        g = rows + i * g_size - (NX if i == N else 0)
        for a in range(NX):
            out[i * z_size + a] = step.x[i, a]
        for a in range(NU if i < N else 0):
            if not abs(step.u[i, a]) < FARTHEST:
                return False
            out[i * z_size + NX + a] = step.u[i, a]
        for a in range(NX if i < N else 0):
            after = g - NX if i > 0 else g - 2 * NX - task.first * NU
            out[after + a] = -factor * costate(step, i + 1, a)
        for j in range(FIXED + PER * task.lines):
            out[g + j] = factor * step.lam[i * task.rows + j]
    return True

"""Second derivatives of a `Problem`'s value, and first ones of its plan, at a solution.

If theta moves along w, the solution moves along (dx, du, dp, dlam), which solves Newton's system of
`kernel` with the derivative of KKT along w on the right: K step + G w = 0. The value's Hessian is
then the change of its gradient along (step, w), L_tt w + G' step. A weighted sum s' z of states and
inputs changes by -s' K^-1 G w, so its gradient in theta is G' step with K step + s = 0: the same
sweep, one for each sum and not one for each parameter. Of the step itself its gradient in anything
that the problem was given is the change of the Lagrangian's gradient in that.

Where more rows and bounds are active than the inputs can follow, the barrier would share the rest
between them. `independent` finds such points, at which `Sensitivity` takes one side of a kink.

The dynamics' share of G w, f_theta w, is the gap of each stage that the sweep closes.
"""

from numba import njit, types

from . import model
from .kernel import (
    INSIDE,
    PROBLEM,
    RIGID,
    SAME,
    allocate,
    begin_bounds,
    begin_inputs,
    condense,
    costate,
    factorise,
    fold,
    inlined,
    linearise,
    measure,
    merged,
    options,
    places,
    recall,
    roll,
    rows_along,
    scale,
    scale_rows,
    settle,
    sweep,
    task_of,
    vector,
)
from .model import FIXED, NTHETA, NU, NX, PER

STIFF = 1e4  # at least, where a row is active
GOLDEN = 0.6180339887498949
LEFT = 1e-2  # of the motion that an active row was asked for: more, and it cannot have it
FARTHEST = 1e7  # an input moves farther only where nothing but the barrier curves
ROWS = 1e-10  # barrier parameter of the rows: of RIGID they lose digits, where h is exactly 0


@inlined
def restore_rows(task, duals, old, factor):
    """The rows' multipliers as they were solved for, upon which the costates depend."""
    for t in range(task.begin * task.rows, len(duals.lam)):
        weight = task.weights[t]
        duals.lam[t] = min(max(old.lam[t] / factor, INSIDE * weight), (1.0 - INSIDE) * weight)


@inlined
def independent(task, stages, step):
    """Whether all active rows can move as they like, and bounds stay; `factorise` after `condense`.

    Each active row is asked to move by another amount, and all have to.
    """
    off, rows = stages.off, 0
    stages.q[:] = 0.0
    stages.r[:] = 0.0
    for t in range(len(off)):
        off[t] = 0.0
        if task.planned[t] > 0.0 and stages.stiff[t] > STIFF:
            rows += 1
            off[t] = 1.0 + (GOLDEN * rows) % 1.0
    for i in range(task.begin, len(task.rate)):
        pull_of_rows(task, stages, i)
    if not factorise(stages, 0.0, task.first, step):
        return False
    if rows == 0:
        return True
    sweep(task, stages, step)
    rows_along(task, stages, step)
    for t in range(task.begin * task.rows, len(off)):
        if off[t] > 0.0 and abs(off[t] + step.lam[t]) > LEFT:
            return False
    return True


@inlined
def pull_of_rows(task, stages, i):
    """Add h' stiff off of a stage to q and r."""
    for t in range(i * task.rows, (i + 1) * task.rows):
        stages.firm[t], stages.pull[t] = 0.0, stages.stiff[t] * stages.off[t]
    fold(task, stages, i)


@inlined
def right_hand_side(task, point, stages, w):
    """G w as q, r, `off` and gaps, after `condense`."""
    last, theta, held, off = len(point.u), task.theta, stages.held, stages.off
    stages.q[:] = 0.0
    stages.r[:] = 0.0
    for i in range(last + 1):
        q, r, d, rate = stages.q[i], stages.r[i], task.data[i], task.rate[i:]
        x, u, t = point.x[i], point.u[min(i, last - 1)], i * task.rows
        if i < last:
            model.stage_mixed(x, u, theta, d, rate, stages.p[i + 1], w, q, r, stages.gap[i + 1])
        else:
            model.terminal_mixed(x, theta, d, rate, w, q)
        if i >= task.begin:
            model.mixed_rows(x, u, theta, d, held, w, q, r, off, t, task.lines)
            for j in range(task.rows):
                in_theta = j < task.rows - len(task.sides) and task.planned[t + j] > 0.0
                off[t + j] = off[t + j] if in_theta else 0.0
            pull_of_rows(task, stages, i)


@inlined
def gradient_along(task, point, stages, step, factor, w, out):
    """The derivative of the value's gradient along the step and w."""
    last, theta, held = len(point.u), task.theta, stages.held
    for a in range(NTHETA):
        out[a] = 0.0
    for i in range(last + 1):
        rate, d, t = task.rate[i:], task.data[i], i * task.rows
        x, dx = point.x[i], step.x[i]
        u, du = point.u[min(i, last - 1)], step.u[min(i, last - 1)]
        if i < last:
            model.stage_along(x, u, theta, d, rate, stages.p[i + 1], dx, du, step.p[i + 1], w, out)
        else:
            model.terminal_along(x, theta, d, rate, dx, w, out)
        model.along_theta_rows(x, u, theta, d, held, dx, du, step.lam, w, out, t, task.lines)
    for a in range(NTHETA):
        out[a] *= factor
    model.initial_along(point.x[0], theta, task.data[0], w, out)


@merged
def system(
    data, lower, upper, sides, kind, discount, weights, state, theta, action, fixed, solved,
):  # fmt: skip
    """The KKT system at a solution, scaled by `factor` and condensed, and whether it can be solved.

    It cannot where the solution is no strict minimum, or inputs cannot follow what is active.
    """
    N = len(discount) - 1
    task = task_of(theta, data, lower, upper, sides, kind, discount, weights, fixed)
    point, plan, duals, old, stages, step = allocate(N, task.rows)
    recall(task, SAME, solved, plan, old)
    begin_inputs(task, point, state, action, SAME, plan.u)
    roll(task, point)
    factor = scale(task, point, weights, stages.firm)
    begin_bounds(task, point, duals, old, RIGID, 1.0 / factor)
    for i in range(N + 1):  # the plan itself: rolled out, an unstable model would leave it
        for a in range(NX):
            point.x[i, a] = plan.x[i, a]
    measure(task, point, ROWS)
    restore_rows(task, duals, old, factor)
    linearise(task, point, duals, stages, stages.p)
    condense(task, point, duals, stages, RIGID)
    step.lam[:] = 0.0
    return task, point, stages, step, factor, independent(task, stages, step)


@inlined
def write_step(task, stages, step, factor, out):
    """The step of z and lam; slacks, and multipliers of x_0 = s and of a given u_0, have none."""
    N = len(step.u)
    z_size, g_size, rows, _, _ = places(N + 1, task.lines, task.first)
    for i in range(N + 1):
        g = rows + i * g_size - (NX if i == N else 0)
        for a in range(NX):
            out[i * z_size + a] = step.x[i, a]
        for a in range(NU if i < N else 0):
            out[i * z_size + NX + a] = step.u[i, a]
        for a in range(NX if i < N else 0):
            after = g - NX if i > 0 else g - 2 * NX - task.first * NU
            out[after + a] = -factor * costate(step, i + 1, a)
        for j in range(FIXED + PER * task.lines):
            out[g + j] = factor * step.lam[i * task.rows + j]


SIGNATURE = types.boolean(*PROBLEM, vector, vector, vector, vector)


@njit(SIGNATURE, cache=True, **options)
def slopes(
    data, lower, upper, sides, kind, discount, weights, tie,
    state, theta, action, fixed, solved, w, of_plan, out,
):  # fmt: skip
    """The Hessian times w, plus the gradient of the sum of u_0 with weights (NU,), shape (NTHETA,).

    Where `out` has NU NX more places, they are du_0 / ds, the gain of stage 0. With weights of all
    z, in the order of `Ocp`, `out` is the step of z and lam in its place: see `write_step`. Returns
    whether it could be formed: see `system`.
    """
    task, point, stages, step, factor, formed = system(
        data, lower, upper, sides, kind, discount, weights, state, theta, action, fixed, solved
    )
    if not formed:
        return False
    N = len(discount) - 1
    right_hand_side(task, point, stages, w)
    whole, z_size = len(of_plan) > NU, places(N + 1, task.lines, task.first)[0]
    for i in range(N + 1 if whole else 1):
        for a in range(NX if whole else 0):
            stages.q[i, a] += of_plan[i * z_size + a] / factor
        for a in range(NU if i < N else 0):
            stages.r[i, a] += of_plan[i * z_size + NX + a if whole else a] / factor
    factorise(stages, 0.0, task.first, step)
    sweep(task, stages, step)
    for i in range(task.first, N):
        for a in range(NU):
            if not abs(step.u[i, a]) < FARTHEST:
                return False
    rows_along(task, stages, step)
    scale_rows(task, stages, step)
    if whole:
        write_step(task, stages, step, factor, out)
        return True
    for k in range(len(out) - NTHETA):
        out[NTHETA + k] = step.K[0, k // NX, k % NX] if task.first == 0 else 0.0
    for i in range(1, N + 1):
        for a in range(NX):
            step.p[i, a] = costate(step, i, a)
    settle(task, point, tie, point.h, stages.firm, stages.held)
    gradient_along(task, point, stages, step, factor, w, out)
    return True

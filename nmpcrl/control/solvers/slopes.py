"""Second derivatives of a `Problem`'s value, and first ones of its plan, at a solution.

If theta moves along w, the solution moves along (dx, du, dp, dlam), which solves Newton's system of
`kernel` with what w adds to KKT's violation on the right: K step + G w = 0. The value's Hessian is
then the change of its gradient along (step, w), L_tt w + G' step. A weighted sum s'(x, u) of the
plan changes by -s' K^-1 G w, so its gradient in theta is G' step with K step + s = 0: the same
sweep from the other side, one for each number of the plan and not one for each parameter.

Where rows and bounds are active that no input can follow all at once, springs of the barrier would
share what is left between them: `independent` finds out, and `Sensitivity` takes a side instead.

See `hessian` for the barrier parameter and the source. The dynamics' share of G w, f_theta w, is
taken up by a `drift` of the states in which inputs move by the feedback alone, lest an unstable
model carry it away.
"""

import numpy as np
from numba import njit, types

from .kernel import (
    INSIDE,
    PLANNED,
    PROBLEM,
    RIGID,
    SAME,
    add,
    allocate,
    begin_multipliers,
    condense,
    factorise,
    hold,
    inlined,
    linearise,
    matrix,
    measure,
    offsets,
    old_row,
    options,
    rows_along,
    scale_rows,
    scaled,
    settle,
    sweep,
    vector,
)
from .model import (
    FIXED,
    NTHETA,
    NU,
    NX,
    OWN,
    PER,
    WIDTH,
    along_theta_fixed,
    along_theta_fixed_end,
    along_theta_line,
    along_theta_line_end,
    initial_along,
    mixed_fixed,
    mixed_fixed_end,
    mixed_line,
    mixed_line_end,
    stage_along,
    stage_mixed,
    terminal_along,
    terminal_mixed,
)

STIFF = 1e4  # at least, where a row is active
GOLDEN = 0.6180339887498949
LEFT = 1e-2  # of the motion that an active row was asked for: more, and it cannot have it
FARTHEST = 1e7  # an input moves farther only where nothing but the barrier curves
ROWS = 1e-10  # barrier parameter of the rows: of RIGID they lose digits, where h is exactly 0


@inlined
def restore_rows(task, duals, factor, solved):
    """The rows' multipliers as they were solved for, upon which the costates depend."""
    for i in range(task.begin, len(duals.lam)):
        for j in range(duals.lam.shape[1]):
            weight, old = task.weights[i, j], 0.0
            if task.kind[i, j] == PLANNED:
                old = old_row(task, len(duals.lam) - 1, i, j, solved) / factor
            duals.lam[i, j] = min(max(old, INSIDE * weight), (1.0 - INSIDE) * weight)


@inlined
def independent(task, stages, step):
    """Whether all active rows can move as they like, and bounds stay; `factorise` after `condense`.

    Each active row is asked to move by another amount, and all have to.
    """
    last, rows = len(step.u), 0
    stages.q[:] = 0.0
    stages.r[:] = 0.0
    stages.off[:] = 0.0
    for i in range(task.begin, last + 1):
        for j in range(stages.off.shape[1]):
            if task.kind[i, j] == PLANNED and stages.stiff[i, j] > STIFF:
                rows += 1
                stages.off[i, j] = 1.0 + (GOLDEN * rows) % 1.0
        pull_of_rows(task, stages, i)
    if not factorise(stages, 0.0, task.first, step):
        return False
    if rows == 0:
        return True
    sweep(task, stages, step)
    rows_along(task, stages, step)
    for i in range(task.begin, last + 1):
        for j in range(stages.off.shape[1]):
            if stages.off[i, j] > 0.0 and abs(stages.off[i, j] + step.lam[i, j]) > LEFT:
                return False
    return True


@inlined
def pull_of_rows(task, stages, i):
    """Add h' stiff off of a stage to q and r."""
    first = FIXED + PER * task.lines
    for j in range(stages.off.shape[1]):
        pull = stages.stiff[i, j] * stages.off[i, j]
        if j >= first:
            side = task.sides[j - first]
            stages.q[i, int(side[0])] += pull * side[1]
            continue
        for a in range(NX):
            stages.q[i, a] += pull * stages.hx[i, j, a]
        for a in range(NU if i < len(stages.A) else 0):
            stages.r[i, a] += pull * stages.hu[i, j, a]


@inlined
def right_hand_side(task, point, duals, stages, step, w, drift, steer):
    """G w as q, r and `off`, and as the drift, after `condense` and `factorise`."""
    last, theta = len(point.u), task.theta
    held, f, off = stages.held, np.empty(NX), stages.off
    for a in range(NX):
        drift[0, a] = 0.0
    for i in range(last + 1):
        q, r, d, rate = stages.q[i], stages.r[i], task.data[i], task.rate[i : i + 1]
        x, u = point.x[i], point.u[min(i, last - 1)]
        if i < last:
            stage_mixed(x, u, theta, d, rate, stages.p[i + 1], w, q, r, f)
        else:
            terminal_mixed(x, theta, d, rate, w, q)
        if i >= task.begin:
            hold(task, duals, i, held)
            for j in range(off.shape[1]):
                off[i, j] = 0.0
            if i < last:
                mixed_fixed(x, u, theta, d, held, w, q, r, off[i], q, r)
            else:
                mixed_fixed_end(x, u, theta, d, held, w, q, r, off[i], q, r)
            for line in range(task.lines):
                of, at = OWN + WIDTH * line, FIXED + PER * line
                if i < last:
                    mixed_line(x, u, theta, d, d, held, w, q, r, off[i], q, r, of, at)
                else:
                    mixed_line_end(x, u, theta, d, d, held, w, q, r, off[i], q, r, of, at)
            for j in range(off.shape[1]):
                off[i, j] = off[i, j] if task.kind[i, j] == PLANNED else 0.0
            pull_of_rows(task, stages, i)
        if i < last:
            for a in range(NU):
                steer[i, a] = 0.0
                for b in range(NX if i >= task.first else 0):
                    steer[i, a] += step.K[i, a, b] * drift[i, b]
            for a in range(NX):
                drift[i + 1, a] = f[a]
                for b in range(NX):
                    drift[i + 1, a] += stages.A[i, a, b] * drift[i, b]
                for b in range(NU):
                    drift[i + 1, a] += stages.B[i, a, b] * steer[i, b]
        for b in range(NX):
            for a in range(NX):
                q[a] += stages.Q[i, a, b] * drift[i, b]
            if i < last:
                for a in range(NU):
                    r[a] += stages.S[i, a, b] * drift[i, b]
        for b in range(NU if i < last else 0):
            for a in range(NX):
                q[a] += stages.S[i, b, a] * steer[i, b]
            for a in range(NU):
                r[a] += stages.R[i, a, b] * steer[i, b]


@inlined
def costates_along(stages, step, dp):
    """How the costates change along the step, before the drift is added to it."""
    last = len(step.u)
    for i in range(last, -1, -1):
        for a in range(NX):
            total = stages.q[i, a]
            for b in range(NX):
                total += stages.Q[i, a, b] * step.x[i, b]
            if i < last:
                for b in range(NU):
                    total += stages.S[i, b, a] * step.u[i, b]
                for b in range(NX):
                    total += stages.A[i, b, a] * dp[i + 1, b]
            dp[i, a] = total


@inlined
def gradient_along(task, point, duals, stages, step, dp, factor, tie, w, out):
    """The derivative of the value's gradient along the step and w."""
    last, theta, rows = len(point.u), task.theta, duals.lam.shape[1]
    gradient, held, h = np.empty(NTHETA), stages.held, np.empty(rows)
    initial_along(point.x[0], theta, task.data[0], w, gradient)
    for a in range(NTHETA):
        out[a] = gradient[a]
    for i in range(last + 1):
        for j in range(rows):
            held[j] = 0.0
        if i >= task.begin:
            hold(task, duals, i, held)
        if i == 0:
            settle(task, point, tie, h, held)
        rate, d, dlam, dx = task.rate[i : i + 1], task.data[i], step.lam[i], step.x[i]
        x, u, du = point.x[i], point.u[min(i, last - 1)], step.u[min(i, last - 1)]
        if i < last:
            stage_along(x, u, theta, d, rate, stages.p[i + 1], dx, du, dp[i + 1], w, gradient)
            along_theta_fixed(x, u, theta, d, held, dx, du, dlam, w, gradient, gradient)
        else:
            terminal_along(x, theta, d, rate, dx, w, gradient)
            along_theta_fixed_end(x, u, theta, d, held, dx, du, dlam, w, gradient, gradient)
        for line in range(task.lines):
            of, at = OWN + WIDTH * line, FIXED + PER * line
            if i < last:
                along_theta_line(
                    x, u, theta, d, d, held, dx, du, dlam, w, gradient, gradient, of, at
                )
            else:
                along_theta_line_end(
                    x, u, theta, d, d, held, dx, du, dlam, w, gradient, gradient, of, at
                )
        add(out, 0, factor, gradient)


SIGNATURE = types.boolean(*PROBLEM, vector, vector, matrix, matrix, vector)


@njit(SIGNATURE, cache=True, **options)
def slopes(
    data, lower, upper, sides, kind, discount, weights, tie,
    state, theta, action, fixed, solved, w, of_states, of_inputs, out,
):  # fmt: skip
    """The Hessian times w, plus the gradient of a weighted sum of the plan, shape (NTHETA,).

    `of_states` (N + 1, NX) and `of_inputs` (N, NU) are the sum's weights. Returns whether it could
    be formed: not where the solution is no strict minimum, or inputs cannot follow what is active.
    """
    N, mu = len(discount) - 1, RIGID
    point, _, duals, stages, step = allocate(N, len(weights) + len(sides))
    drift, dp, steer = np.empty((N + 1, NX)), np.empty((N + 1, NX)), np.empty((N, NU))
    task, factor = scaled(
        theta, data, lower, upper, sides, kind, discount, weights, fixed, point, state, action,
        SAME, solved,
    )  # fmt: skip
    begin_multipliers(task, point, duals, SAME, mu, factor, solved)
    for i in range(N + 1):  # the plan itself: rolled out, an unstable model would leave it
        at = offsets(task, i)[0]
        for a in range(NX):
            point.x[i, a] = solved[at + a]
    measure(task, point, ROWS)
    restore_rows(task, duals, factor, solved)
    linearise(task, point, duals, stages)
    condense(task, point, duals, stages, mu)
    step.lam[:] = 0.0
    if not independent(task, stages, step):
        return False
    right_hand_side(task, point, duals, stages, step, w, drift, steer)
    for i in range(N + 1):
        for a in range(NX):
            stages.q[i, a] += of_states[i, a] / factor
        for a in range(NU if i < N else 0):
            stages.r[i, a] += of_inputs[i, a] / factor
    factorise(stages, 0.0, task.first, step)
    sweep(task, stages, step)
    for i in range(task.first, N):
        for a in range(NU):
            if not abs(step.u[i, a]) < FARTHEST:
                return False
    costates_along(stages, step, dp)
    for i in range(N + 1):
        for a in range(NX):
            step.x[i, a] += drift[i, a]
        for a in range(NU if i < N else 0):
            step.u[i, a] += steer[i, a]
    rows_along(task, stages, step)
    scale_rows(task, stages, step)
    gradient_along(task, point, duals, stages, step, dp, factor, tie, w, out)
    return True

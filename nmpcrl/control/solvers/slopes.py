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

from .expressions import (
    NROWS,
    initial_along,
    last_along,
    last_mixed,
    stage_along,
    stage_mixed,
)
from .kernel import (
    INSIDE,
    RIGID,
    SAME,
    add,
    factorise,
    initialise,
    inlined,
    matrix,
    offsets,
    options,
    scale_rows,
    sweep,
    vector,
)
from .model import NTHETA, NU, NX
from .rows import (
    PLANNED,
    PROBLEM,
    allocate,
    condense,
    hold,
    linearise,
    measure,
    place_of_rows,
    rows_along,
    scaled,
    settle,
)

STIFF = 1e4  # at least, where a row is active
GOLDEN = 0.6180339887498949
LEFT = 1e-2  # of the motion that an active row was asked for: more, and it cannot have it
FARTHEST = 1e7  # an input moves farther only where nothing but the barrier curves
ROWS = 1e-10  # barrier parameter of the rows: of RIGID they lose digits, where h is exactly 0


@inlined
def restore_rows(task, duals, factor, solved):
    """The rows' multipliers as they were solved for, upon which the costates depend."""
    last = len(duals.lam) - 1
    lam = offsets(task, last)[0] + NX + NROWS
    for i in range(last + 1):
        row = lam + place_of_rows(task, i, last)
        for j in range(NROWS):
            weight = task.weights[i, j]
            old = solved[row + j] / factor if task.kind[i, j] == PLANNED else 0.0
            duals.lam[i, j] = min(max(old, INSIDE * weight), (1.0 - INSIDE) * weight)


@inlined
def independent(task, point, duals, stages, step):
    """Whether all active rows can move as they like, and bounds stay; `factorise` after `condense`.

    Each active row is asked to move by another amount, and all have to.
    """
    last, rows = len(point.u), 0
    for i in range(last + 1):
        for a in range(NX):
            stages.q[i, a] = 0.0
        for a in range(NU if i < last else 0):
            stages.r[i, a] = 0.0
        for j in range(NROWS):
            stages.off[i, j] = 0.0
            if task.kind[i, j] == PLANNED and stages.stiff[i, j] > STIFF:
                rows += 1
                apart = 1.0 + (GOLDEN * rows) % 1.0
                stages.off[i, j] = apart
                pull = stages.stiff[i, j] * apart
                for a in range(NX):
                    stages.q[i, a] += pull * stages.hx[i, j, a]
                for a in range(NU if i < last else 0):
                    stages.r[i, a] += pull * stages.hu[i, j, a]
    if not factorise(stages, 0.0, task.first, step):
        return False
    if rows == 0:
        return True
    sweep(task, stages, step)
    rows_along(task, stages, step)
    for i in range(last + 1):
        for j in range(NROWS):
            if stages.off[i, j] > 0.0 and abs(stages.off[i, j] + step.lam[i, j]) > LEFT:
                return False
    return True


@inlined
def right_hand_side(task, point, duals, stages, step, w, drift, steer):
    """G w as q, r and `off`, and as the drift, after `condense` and `factorise`."""
    last = len(point.u)
    held, h, f = np.empty(NROWS), np.empty(NROWS), np.empty(NX)
    for a in range(NX):
        drift[0, a] = 0.0
    for i in range(last + 1):
        hold(task, duals, i, held)
        q, rate, data = stages.q[i], task.rate[i : i + 1], task.data[i]
        if i < last:
            stage_mixed(
                point.x[i], point.u[i], task.theta, data, rate, stages.p[i + 1], held, w,
                q, stages.r[i], f, h,
            )  # fmt: skip
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
        else:
            last_mixed(point.x[i], task.theta, data, rate, held, w, q, h)
        for j in range(NROWS):
            off = h[j] if task.kind[i, j] == PLANNED else 0.0
            stages.off[i, j] = off
            pull = stages.stiff[i, j] * off
            for a in range(NX):
                q[a] += pull * stages.hx[i, j, a]
            if i < last:
                for a in range(NU):
                    stages.r[i, a] += pull * stages.hu[i, j, a]
        for b in range(NX):
            for a in range(NX):
                q[a] += stages.Q[i, a, b] * drift[i, b]
            if i < last:
                for a in range(NU):
                    stages.r[i, a] += stages.S[i, a, b] * drift[i, b]
        for b in range(NU if i < last else 0):
            for a in range(NX):
                q[a] += stages.S[i, b, a] * steer[i, b]
            for a in range(NU):
                stages.r[i, a] += stages.R[i, a, b] * steer[i, b]


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
    last = len(point.u)
    gradient, held, h = np.empty(NTHETA), np.empty(NROWS), np.empty(NROWS)
    initial_along(point.x[0], task.theta, task.data[0], w, gradient)
    for a in range(NTHETA):
        out[a] = gradient[a]
    for i in range(last + 1):
        hold(task, duals, i, held)
        if i == 0:
            settle(task, point, tie, h, held)
        rate, data, dlam = task.rate[i : i + 1], task.data[i], step.lam[i]
        if i < last:
            stage_along(
                point.x[i], point.u[i], task.theta, data, rate, stages.p[i + 1], held,
                step.x[i], step.u[i], dp[i + 1], dlam, w, gradient,
            )  # fmt: skip
        else:
            last_along(point.x[i], task.theta, data, rate, held, step.x[i], dlam, w, gradient)
        add(out, 0, factor, gradient)


SIGNATURE = types.boolean(*PROBLEM, vector, vector, matrix, matrix, vector)


@njit(SIGNATURE, cache=True, **options)
def slopes(
    data, lower, upper, kind, discount, weights, factor, tie,
    state, theta, action, fixed, solved, w, of_states, of_inputs, out,
):  # fmt: skip
    """The Hessian times w, plus the gradient of a weighted sum of the plan, shape (NTHETA,).

    `of_states` (N + 1, NX) and `of_inputs` (N, NU) are the sum's weights. Returns whether it could
    be formed: not where the solution is no strict minimum, or inputs cannot follow what is active.
    """
    task, factor = scaled(theta, data, lower, upper, kind, discount, weights, factor, fixed, state)
    N, mu = len(discount) - 1, RIGID
    point, _, duals, stages, step = allocate(N)
    drift, dp, steer = np.empty((N + 1, NX)), np.empty((N + 1, NX)), np.empty((N, NU))
    initialise(task, point, duals, state, action, SAME, mu, factor, solved)
    for i in range(N + 1):  # the plan itself: rolled out, an unstable model would leave it
        at = offsets(task, i)[0]
        for a in range(NX):
            point.x[i, a] = solved[at + a]
    measure(task, point, ROWS)
    restore_rows(task, duals, factor, solved)
    linearise(task, point, duals, stages)
    condense(task, point, duals, stages, mu)
    if not independent(task, point, duals, stages, step):
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
    scale_rows(step.lam.ravel(), stages.off.ravel(), stages.stiff.ravel())
    gradient_along(task, point, duals, stages, step, dp, factor, tie, w, out)
    return True

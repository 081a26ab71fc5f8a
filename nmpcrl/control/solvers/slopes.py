"""Second derivatives of a `Problem`'s value, and first ones of its plan, at a solution.

If theta moves along w, the solution moves along (dx, du, dp, dlam), which solves Newton's system of
`kernel` with what w adds to KKT's violation on the right: K step + G w = 0. The value's Hessian is
then the change of its gradient along (step, w), L_tt w + G' step. A weighted sum s'(x, u) of the
plan changes by -s' K^-1 G w, so its gradient in theta is G' step with K step + s = 0: the same
sweep from the other side, one for each number of the plan and not one for each parameter.

Where rows and bounds are active that no input can follow all at once, springs of the barrier would
share what is left between them: `independent` finds out, and `Sensitivity` takes a side instead.

The dynamics' share of G w, f_theta w, is the gap of each stage that the sweep closes.
"""

import numpy as np
from numba import njit, types

from .kernel import (
    INSIDE,
    PLANNED,
    PROBLEM,
    RIGID,
    SAME,
    allocate,
    begin_inputs,
    begin_multipliers,
    condense,
    described,
    factorise,
    inlined,
    linearise,
    matrix,
    measure,
    old_row,
    options,
    place,
    roll,
    rows_along,
    scale,
    scale_rows,
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
    along_theta_line,
    initial_along,
    mixed_fixed,
    mixed_line,
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
    for i in range(task.begin, len(task.rate)):
        for j in range(task.rows):
            t = i * task.rows + j
            weight, old = task.weights[t], 0.0
            if task.kind[i, j] == PLANNED:
                old = old_row(task, i, j, solved) / factor
            duals.lam[t] = min(max(old, INSIDE * weight), (1.0 - INSIDE) * weight)


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
    first = FIXED + PER * task.lines
    for j in range(task.rows):
        t = i * task.rows + j
        pull = stages.stiff[t] * stages.off[t]
        if j >= first:
            stages.q[i, int(task.sides[j - first, 0])] += pull * task.sides[j - first, 1]
            continue
        for a in range(NX):
            stages.q[i, a] += pull * stages.hx[t, a]
        for a in range(NU if i < len(stages.A) else 0):
            stages.r[i, a] += pull * stages.hu[t, a]


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
            stage_mixed(x, u, theta, d, rate, stages.p[i + 1], w, q, r, stages.gap[i + 1])
        else:
            terminal_mixed(x, theta, d, rate, w, q)
        if i >= task.begin:
            for j in range(task.rows):
                off[t + j] = 0.0
            mixed_fixed(x, u, theta, d, held, w, q, r, off, t)
            for line in range(task.lines):
                mixed_line(
                    x, u, theta, d, d, held, w, q, r, off,
                    OWN + WIDTH * line, t + FIXED + PER * line,
                )  # fmt: skip
            for j in range(task.rows):
                off[t + j] = off[t + j] if task.planned[t + j] > 0.0 else 0.0
            pull_of_rows(task, stages, i)


@inlined
def costates_along(stages, step, dp):
    """How the costates change along the step."""
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
def gradient_along(task, point, stages, step, dp, factor, w, out):
    """The derivative of the value's gradient along the step and w."""
    last, theta, held = len(point.u), task.theta, stages.held
    for a in range(NTHETA):
        out[a] = 0.0
    for i in range(last + 1):
        rate, d, t = task.rate[i:], task.data[i], i * task.rows
        x, dx = point.x[i], step.x[i]
        u, du = point.u[min(i, last - 1)], step.u[min(i, last - 1)]
        if i < last:
            stage_along(x, u, theta, d, rate, stages.p[i + 1], dx, du, dp[i + 1], w, out)
        else:
            terminal_along(x, theta, d, rate, dx, w, out)
        along_theta_fixed(x, u, theta, d, held, dx, du, step.lam, w, out, t)
        for line in range(task.lines):
            along_theta_line(
                x, u, theta, d, d, held, dx, du, step.lam, w, out,
                OWN + WIDTH * line, t + FIXED + PER * line,
            )  # fmt: skip
    for a in range(NTHETA):
        out[a] *= factor
    initial_along(point.x[0], theta, task.data[0], w, out)


SIGNATURE = types.boolean(*PROBLEM, vector, vector, matrix, matrix, vector)


@njit(SIGNATURE, cache=True, **options)
def slopes(
    data, lower, upper, sides, kind, discount, weights, tie,
    state, theta, action, fixed, solved, w, of_states, of_inputs, out,
):  # fmt: skip
    """The Hessian times w, plus the gradient of a weighted sum of the plan, shape (NTHETA,).

    `of_states` (N + 1, NX) and `of_inputs` (N, NU) are the sum's weights. Returns whether it could
    be formed: not where the solution is no strict minimum, or inputs cannot follow what is active.
    Where `out` has NU NX more places, they are du_0 / ds, the gain of stage 0.
    """
    N, mu = len(discount) - 1, RIGID
    task = described(theta, data, lower, upper, sides, kind, discount, weights, fixed)
    point, _, duals, stages, step = allocate(N, task.rows)
    dp = np.empty((N + 1, NX))
    begin_inputs(task, point, state, action, SAME, point.u, solved)
    roll(task, point)
    factor = scale(task, point, weights)
    begin_multipliers(task, point, duals, SAME, mu, factor, solved)
    for i in range(N + 1):  # the plan itself: rolled out, an unstable model would leave it
        z = place(task, i)[0]
        for a in range(NX):
            point.x[i, a] = solved[z + a]
    measure(task, point, ROWS)
    restore_rows(task, duals, factor, solved)
    linearise(task, point, duals, stages, stages.p)
    condense(task, point, duals, stages, mu)
    step.lam[:] = 0.0
    if not independent(task, stages, step):
        return False
    right_hand_side(task, point, stages, w)
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
    for k in range(len(out) - NTHETA):
        out[NTHETA + k] = step.K[0, k // NX, k % NX]
    costates_along(stages, step, dp)
    rows_along(task, stages, step)
    scale_rows(task, stages, step)
    settle(task, point, tie, point.h, stages.firm, stages.held)
    gradient_along(task, point, stages, step, dp, factor, w, out)
    return True

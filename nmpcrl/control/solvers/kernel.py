"""A primal-dual interior point for a `Problem` whose work is linear in stages and rows.

The inputs are the variables and the states follow from them (single shooting). Each constraint
h(x, u) <= sigma of a stage is a *row*: with slack s = sigma - h it adds W sigma - mu log sigma - mu
log s to the objective, and its multiplier lam lies in (0, W). A hard row, or a bound of a state, is
one whose W exceeds what its multiplier can be, and is no part of the value. Rows come in the order
fixed ones, those of lines of data, sides of the states' box. A row of a stage is *planned* where
the plan can change it, *settled* at stage 0 where it cannot, and else absent; what is not planned
stands in the barrier as h = -1 and counts for nothing. From a start, one solve repeats the
following while the barrier parameter mu falls:

1. `measure` a plan: h, and for it the best sigma and s in closed form;
2. `linearise`: from the last stage to the first, the costates p = L_x + A' p+ and the Hessian of
   the Lagrangian, exact, with the curvature of the dynamics;
3. `residuals`: how far KKT is from holding; stop if hardly, let mu fall if little beside mu;
4. `condense`: fold rows and bounds into the stages, one division each;
5. `factorise`: the Riccati recursion. Where some Q_uu is not positive definite, delta I is added
   to all of them and the recursion repeated;
6. `newton_step`: sweep forwards for the step, and find how far every variable stays inside bounds;
7. `search`: roll out along the feedback of 5, which holds an unstable model to its plan, and
   backtrack until the barrier function has fallen enough (Armijo).

Sources: the recursion, Rawlings, Mayne and Diehl (2017), section 8.8; barrier, fraction to the
boundary and inertia, Wächter and Biegler (2006); stage-wise elimination, Frison and Diehl (2020);
the feedback, Tassa, Mansard and Todorov (2014).

numba compiles this file beside a `model` generated from CasADi expressions, whose sizes are
constants there. Everything is inlined and every buffer allocated inside `solve`: only then does
the compiler know that no two of them overlap, which is worth 30 % of the time.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import float64, int64, njit

from .codes import End, Start
from .model import (
    FIXED,
    NTHETA,
    NU,
    NX,
    OWN,
    PER,
    SOFT,
    WIDTH,
    along_fixed,
    along_fixed_end,
    along_line,
    along_line_end,
    condense_fixed,
    condense_fixed_end,
    condense_line,
    condense_line_end,
    expand_fixed,
    expand_fixed_end,
    expand_line,
    expand_line_end,
    expand_stage,
    expand_terminal,
    fixed_end_rows,
    fixed_rows,
    fixed_sizes,
    initial_cost,
    initial_theta,
    line_end_rows,
    line_rows,
    line_sizes,
    stage_cost,
    stage_size,
    stage_theta,
    terminal_cost,
    terminal_size,
    terminal_theta,
    theta_fixed,
    theta_fixed_end,
    theta_line,
    theta_line_end,
    transition,
)

# numba takes plain numbers; a tuple below has one entry a start.
COLD, SHIFTED, NEAR, SAME = map(int, Start)
SOLVED, STALLED, LIMIT, BROKEN, SADDLE = map(int, End)
START_MU = (10.0, 1e-3, 1e-3, 1e-9)  # the barrier parameter
PUSH = (1e-2, 1e-3, 1e-3, 1e-9)  # inside its bounds an input starts, in parts of their distance

PLANNED, SETTLED = 1, 2  # kinds of rows, else absent
STRICT = 1e4  # W of hard rows, scaled: an exact penalty, so that no state is infeasible
STRICT_TO_SOFT = 100.0  # so many times the largest other W it is at least
ABSURD = 1e9  # no plan goes through such a state
GROWS = 3.0  # times the first state's distance from a plan: inputs leave it by more
NOTICED = 0.1  # and by more than this part of its largest state
WITHIN = 1.0 - 1e-5  # the most of its way to a bound that an input may go along the feedback

# The barrier's fall, Eqs. (7) and (8), and inertia, Algorithm IC, of Wächter and Biegler (2006);
# their values in brackets. On 2,200 drawn problems a solve takes 11.5 iterations on average, 11.9
# with their kappa_epsilon, 11.7 with their kappa_w^+ and 11.5 with their theta_mu.
KAPPA_EPSILON = 100.0  # mu falls once KKT with mu is violated by no more than so many mu [10]
KAPPA_MU = 0.2  # the part of itself to which mu falls at least [0.2]
THETA_MU = 1.7  # the power of itself to which it falls if that is less: superlinear [1.5]
MU_FLOOR = 0.1  # the part of the allowed error below which it need not fall [0.1]
TAU_MIN = 0.99  # the least part of the way to a bound that a step may go; else 1 - mu [0.99]
TAU_REST = 1e-5  # the least part of it that is left, lest an iterate be rounded to its bound [none]
DELTA_FIRST = 1e-6  # the first delta, in parts of the largest multiplier [1e-4, absolute]
DELTA_LEAST = 1e-12  # the least of later ones, likewise [1e-20, absolute]
DELTA_GROWS = 6.0  # kappa_w^+, its factor after a factorisation that failed [8]
DELTA_SHRINKS = 4.0  # 1 / kappa_w^-, what the next delta is first divided by [3]
DELTA_LARGEST = 1e12  # beyond which no factorisation is tried [1e40]
BACKTRACKS = 0.5  # the part to which a step is cut that falls too little [0.5]
ARMIJO = 1e-4  # eta_phi, the part of its predicted fall that the barrier function must make [1e-4]

LEAST_VALUE = 1e-4  # of the objective that the error is compared with, in largest multipliers
POLISHED = 4  # iterations within the tolerance, after which rounding keeps the error above `goal`
INSIDE = 1e-12  # the part of W by which a multiplier starts inside (0, W)
ROUNDING = 1e-14  # of the barrier function, relative
ALMOST = 1.0 - 4e-16  # of W is the most for lam, or W - lam is rounded to 0
SHORTEST = 1e-10  # step that the search tries
RIGID = 1e-12  # barrier parameter of a solution that is differentiated

fast = {"contract", "arcp", "nsz", "reassoc", "afn"}  # not nnan, ninf: bad numbers must show
options: dict[str, Any] = {"error_model": "numpy", "fastmath": fast}
# To be called from machine code alone: a wrapper for Python takes a quarter of the compiling.
inner: dict[str, Any] = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
inlined = njit(**inner, **options)


class Task(NamedTuple):
    """The problem of one solve, scaled."""

    theta: np.ndarray  # (NTHETA,)
    data: np.ndarray  # (N + 1, OWN + lines WIDTH)
    lower: np.ndarray  # of an input, (NU,)
    upper: np.ndarray  # (NU,)
    sides: np.ndarray  # of the states' box: state, sign and limit, sign (x - limit) <= 0, (B, 3)
    kind: np.ndarray  # of each row at each stage, (N + 1, rows)
    begin: int  # the first stage with a planned row, 0 or 1
    lines: int
    rate: np.ndarray  # scaled gamma^i, (N + 1,)
    weights: np.ndarray  # W, (N + 1, rows)
    first: int  # the first stage with a free input: 1 if u_0 is given, else 0


class Point(NamedTuple):
    """An iterate."""

    x: np.ndarray  # (N + 1, NX)
    u: np.ndarray  # (N, NU)
    h: np.ndarray  # (N + 1, rows), as all that follows
    sigma: np.ndarray
    slack: np.ndarray


class Duals(NamedTuple):
    """The multipliers of an iterate."""

    lam: np.ndarray  # of the rows, in (0, W), (N + 1, rows)
    below: np.ndarray  # of the inputs' lower bounds, (N, NU)
    above: np.ndarray  # (N, NU)


class Stages(NamedTuple):
    """Derivatives at an iterate, and their condensed form; what has u at stage N is not used."""

    A: np.ndarray  # d x+ / d x, (N, NX, NX)
    B: np.ndarray  # d x+ / d u, (N, NX, NU)
    hx: np.ndarray  # gradients of the rows but the sides, (N + 1, rows, NX)
    hu: np.ndarray  # (N + 1, rows, NU)
    lx: np.ndarray  # of the objective, (N + 1, NX)
    cu: np.ndarray  # (N + 1, NU)
    lu: np.ndarray  # of the objective and lam' h, (N + 1, NU)
    p: np.ndarray  # costates, (N + 1, NX)
    Q: np.ndarray  # Hessian of the Lagrangian, (N + 1, NX, NX)
    S: np.ndarray  # (N + 1, NU, NX)
    R: np.ndarray  # (N + 1, NU, NU)
    q: np.ndarray  # Newton's right-hand side, (N + 1, NX)
    r: np.ndarray  # (N + 1, NU)
    off: np.ndarray  # dlam = stiff (off + dh), (N + 1, rows)
    stiff: np.ndarray
    held: np.ndarray  # of one stage: lam of what is planned, (rows,)
    firm: np.ndarray  # stiff
    pull: np.ndarray  # lam + off stiff


class Step(NamedTuple):
    """A Newton step, and the feedback u = k + K x that makes it."""

    K: np.ndarray  # (N, NU, NX)
    k: np.ndarray  # (N, NU)
    x: np.ndarray  # (N + 1, NX)
    u: np.ndarray  # (N, NU)
    lam: np.ndarray  # (N + 1, rows)
    below: np.ndarray
    above: np.ndarray


@inlined
def roll(task, point):
    """The states that the inputs lead to from point.x[0]."""
    for i in range(len(point.u)):
        transition(point.x[i], point.u[i], task.theta, task.data[i], point.x[i + 1])


@inlined
def measure(task, point, mu):
    """Step 1: the objective and the barrier function of a plan."""
    x, u, last, begin = point.x, point.u, len(point.u), task.begin
    objective = 0.0
    for i in range(last):
        objective += task.rate[i] * stage_cost(x[i], u[i], task.theta, task.data[i])
    objective += task.rate[last] * terminal_cost(x[last], task.theta, task.data[last])
    for i in range(begin, last):
        fixed_rows(x[i], u[i], task.theta, task.data[i], point.h[i])
        for line in range(task.lines):
            line_rows(
                x[i], u[i], task.theta, task.data[i], task.data[i], point.h[i],
                OWN + WIDTH * line, FIXED + PER * line,
            )  # fmt: skip
        sides_of(task, x[i], point.h[i])
    rows_of_end(task, point, point.h[last])
    for i in range(begin, last + 1):
        for j in range(point.h.shape[1]):
            if task.kind[i, j] != PLANNED:
                point.h[i, j] = -1.0
    centre(
        point.h[begin:].ravel(), task.weights[begin:].ravel(), mu,
        point.sigma[begin:].ravel(), point.slack[begin:].ravel(),
    )  # fmt: skip
    return objective, objective + barrier(task, point, mu)


@inlined
def rows_of_end(task, point, h):
    """h of every row of stage N, planned or not."""
    last = len(point.u)
    fixed_end_rows(point.x[last], point.u[last - 1], task.theta, task.data[last], h)
    for line in range(task.lines):
        line_end_rows(
            point.x[last], point.u[last - 1], task.theta, task.data[last], task.data[last], h,
            OWN + WIDTH * line, FIXED + PER * line,
        )  # fmt: skip
    sides_of(task, point.x[last], h)


@inlined
def sides_of(task, x, h):
    """h of the sides of the states' box."""
    first = FIXED + PER * task.lines
    for j in range(len(task.sides)):
        h[first + j] = task.sides[j, 1] * (x[int(task.sides[j, 0])] - task.sides[j, 2])


@inlined
def centre(h, weights, mu, sigma, slack):
    """The sigma and slack that minimise each row's barrier while h = sigma - slack is given.

    With k = |h| W / mu they are mu / W times (2 + k + sqrt(k^2 + 4)) / 2 and its conjugate.
    """
    for t in range(h.size):
        unit = mu / weights[t]
        k = abs(h[t]) / unit
        twice = 2.0 + k + math.sqrt(k * k + 4.0)
        large, small = 0.5 * unit * twice, unit * twice / (twice - 2.0)
        sigma[t] = large if h[t] > 0.0 else small
        slack[t] = small if h[t] > 0.0 else large


@inlined
def barrier(task, point, mu):
    """What the rows and the inputs' bounds add to the objective."""
    u, sigma, slack = point.u, point.sigma, point.slack
    total, logs = 0.0, 0.0
    for i in range(task.begin, len(sigma)):
        product = 1.0  # one logarithm serves eight rows, in units in which it cannot overflow
        for j in range(sigma.shape[1]):
            total += task.weights[i, j] * sigma[i, j]
            unit = task.weights[i, j] / mu
            product *= (unit * sigma[i, j]) * (unit * slack[i, j])
            if j % 8 == 7:
                logs += math.log(product)
                product = 1.0
        logs += math.log(product)
    for i in range(task.first, len(u)):
        for a in range(NU):
            logs += math.log((u[i, a] - task.lower[a]) * (task.upper[a] - u[i, a]))
    return total - mu * logs


@inlined
def hold(task, duals, i, held):
    """The multipliers of the planned rows of a stage, 0 for the others."""
    for j in range(len(held)):
        held[j] = duals.lam[i, j] if task.kind[i, j] == PLANNED else 0.0


@inlined
def linearise(task, point, duals, stages):
    """Step 2: derivatives of every stage, from the last to the first."""
    x, u, p, last = point.x, point.u, stages.p, len(point.u)
    held, px, pu = stages.held, np.zeros(NX), np.zeros(NU)
    first = FIXED + PER * task.lines
    expand_terminal(
        x[last], task.theta, task.data[last], task.rate[last:], stages.lx[last], stages.Q[last]
    )
    hold(task, duals, last, held)
    expand_fixed_end(
        x[last], u[last - 1], task.theta, task.data[last], held,
        px, pu, stages.Q[last], stages.S[last], stages.R[last], stages.hx[last], stages.hu[last],
        px, pu, stages.Q[last], stages.S[last], stages.R[last],
    )  # fmt: skip
    for line in range(task.lines):
        expand_line_end(
            x[last], u[last - 1], task.theta, task.data[last], task.data[last], held,
            px, pu, stages.Q[last], stages.S[last], stages.R[last],
            stages.hx[last], stages.hu[last],
            px, pu, stages.Q[last], stages.S[last], stages.R[last],
            OWN + WIDTH * line, FIXED + PER * line,
        )  # fmt: skip
    for j in range(len(task.sides)):
        px[int(task.sides[j, 0])] += held[first + j] * task.sides[j, 1]
    for a in range(NX):
        p[last, a] = stages.lx[last, a] + px[a]
    for i in range(last - 1, -1, -1):
        expand_stage(
            x[i], u[i], task.theta, task.data[i], task.rate[i : i + 1], p[i + 1],
            stages.A[i], stages.B[i], stages.lx[i], stages.cu[i],
            stages.Q[i], stages.S[i], stages.R[i],
        )  # fmt: skip
        for a in range(NX):
            px[a] = 0.0
        for a in range(NU):
            pu[a] = 0.0
        if i >= task.begin:
            hold(task, duals, i, held)
            expand_fixed(
                x[i], u[i], task.theta, task.data[i], held,
                px, pu, stages.Q[i], stages.S[i], stages.R[i], stages.hx[i], stages.hu[i],
                px, pu, stages.Q[i], stages.S[i], stages.R[i],
            )  # fmt: skip
            for line in range(task.lines):
                expand_line(
                    x[i], u[i], task.theta, task.data[i], task.data[i], held,
                    px, pu, stages.Q[i], stages.S[i], stages.R[i], stages.hx[i], stages.hu[i],
                    px, pu, stages.Q[i], stages.S[i], stages.R[i],
                    OWN + WIDTH * line, FIXED + PER * line,
                )  # fmt: skip
            for j in range(len(task.sides)):
                px[int(task.sides[j, 0])] += held[first + j] * task.sides[j, 1]
        for a in range(NX):
            total = stages.lx[i, a] + (px[a] if i > 0 else 0.0)  # x_0 is given
            for b in range(NX):
                total += stages.A[i, b, a] * p[i + 1, b]
            p[i, a] = total
        for a in range(NU):
            stages.lu[i, a] = stages.cu[i, a] + pu[a]


@inlined
def residuals(task, point, duals, stages, mu):
    """Step 3: Euclidean norms of KKT's violation, and the largest multiplier.

    Stationarity is that of the inputs; the others' holds by construction. Complementarity is how
    far the products of multipliers and distances are from mu.
    """
    largest, stationarity, complementarity = 1.0, 0.0, 0.0
    for i in range(task.first, len(point.u)):
        for b in range(NX):
            size = abs(stages.p[i + 1, b])
            largest = size if size > largest else largest
        for a in range(NU):
            gradient = input_gradient(stages, i, a) - duals.below[i, a] + duals.above[i, a]
            low = duals.below[i, a] * (point.u[i, a] - task.lower[a]) - mu
            high = duals.above[i, a] * (task.upper[a] - point.u[i, a]) - mu
            stationarity += gradient * gradient
            complementarity += low * low + high * high
    complementarity += row_residuals(
        duals.lam[task.begin :].ravel(), task.weights[task.begin :].ravel(),
        point.sigma[task.begin :].ravel(), point.slack[task.begin :].ravel(), mu,
    )
    return math.sqrt(stationarity), math.sqrt(complementarity), largest


@inlined
def input_gradient(stages, i, a):
    """The Lagrangian's derivative in input a of stage i, but for the bounds."""
    gradient = stages.lu[i, a]
    for b in range(NX):
        gradient += stages.B[i, b, a] * stages.p[i + 1, b]
    return gradient


@inlined
def row_residuals(lam, weights, sigma, slack, mu):
    """Squared violation of lam slack = mu = (W - lam) sigma."""
    total = 0.0
    for t in range(lam.size):
        low, high = lam[t] * slack[t] - mu, (weights[t] - lam[t]) * sigma[t] - mu
        if lam[t] >= ALMOST * weights[t]:
            high = 0.0
        total += low * low + high * high
    return total


@inlined
def condense(task, point, duals, stages, mu):
    """Step 4: Newton's system without rows and bounds: q and r, and Q, S and R in place."""
    begin, last, first = task.begin, len(point.u), FIXED + PER * task.lines
    soften(
        point.h[begin:].ravel(), point.sigma[begin:].ravel(), point.slack[begin:].ravel(),
        duals.lam[begin:].ravel(), task.weights[begin:].ravel(), mu,
        stages.off[begin:].ravel(), stages.stiff[begin:].ravel(),
    )  # fmt: skip
    stiff, pull, hx, hu = stages.firm, stages.pull, stages.hx, stages.hu
    q, r, Q, S, R = stages.q, stages.r, stages.Q, stages.S, stages.R
    for i in range(last):
        for a in range(NX):
            q[i, a] = stages.lx[i, a]
        for a in range(NU):
            r[i, a] = stages.cu[i, a]
    for a in range(NX):
        q[last, a] = stages.lx[last, a]
    for i in range(begin, last + 1):
        for j in range(len(stiff)):
            planned = task.kind[i, j] == PLANNED
            stiff[j] = stages.stiff[i, j] if planned else 0.0
            pull[j] = duals.lam[i, j] + stages.off[i, j] * stiff[j] if planned else 0.0
        for j in range(len(task.sides)):
            a = int(task.sides[j, 0])
            q[i, a] += pull[first + j] * task.sides[j, 1]
            Q[i, a, a] += stiff[first + j]
        if i == last:
            break
        condense_fixed(
            stiff, pull, hx[i], hu[i], q[i], r[i], Q[i], S[i], R[i], q[i], r[i], Q[i], S[i], R[i]
        )
        for line in range(task.lines):
            condense_line(
                stiff, pull, hx[i], hu[i], q[i], r[i], Q[i], S[i], R[i],
                q[i], r[i], Q[i], S[i], R[i], 0, FIXED + PER * line,
            )  # fmt: skip
    condense_fixed_end(
        stiff, pull, hx[last], hu[last], q[last], r[last], Q[last], S[last], R[last],
        q[last], r[last], Q[last], S[last], R[last],
    )  # fmt: skip
    for line in range(task.lines):
        condense_line_end(
            stiff, pull, hx[last], hu[last], q[last], r[last], Q[last], S[last], R[last],
            q[last], r[last], Q[last], S[last], R[last], 0, FIXED + PER * line,
        )  # fmt: skip
    for i in range(task.first, last):
        for a in range(NU):
            low, high = 1.0 / (point.u[i, a] - task.lower[a]), 1.0 / (task.upper[a] - point.u[i, a])
            r[i, a] += mu * high - mu * low
            R[i, a, a] += duals.below[i, a] * low + duals.above[i, a] * high


@inlined
def soften(h, sigma, slack, lam, weights, mu, off, stiff):
    """Eliminate the rows: Newton on lam slack = mu = (W - lam) sigma with h = sigma - slack."""
    for t in range(h.size):
        rest = weights[t] - lam[t]
        both = lam[t] * rest
        off[t] = h[t] + mu * (rest - lam[t]) / both
        stiff[t] = both / (slack[t] * rest + sigma[t] * lam[t])


@inlined
def factorise(stages, delta, first, step):
    """Step 5: the Riccati recursion; false where Q_uu + delta I is not positive definite."""
    A, B, r, S, R = stages.A, stages.B, stages.r, stages.S, stages.R
    last = len(A)
    V, v, w = np.empty((NX, NX)), np.empty(NX), np.empty(NX)  # of the cost to go
    VA, VB = np.empty((NX, NX)), np.empty((NX, NU))
    L, F, f = np.empty((NU, NU)), np.empty((NU, NX)), np.empty(NU)
    for a in range(NX):
        v[a] = stages.q[last, a]
        for b in range(NX):
            V[a, b] = stages.Q[last, a, b]
    for i in range(last - 1, first - 1, -1):
        for a in range(NX):
            for b in range(NX):
                VA[a, b] = 0.0
                for c in range(NX):
                    VA[a, b] += V[a, c] * A[i, c, b]
            for b in range(NU):
                VB[a, b] = 0.0
                for c in range(NX):
                    VB[a, b] += V[a, c] * B[i, c, b]
        for a in range(NU):
            f[a] = r[i, a]
            for c in range(NX):
                f[a] += B[i, c, a] * v[c]
            for b in range(NX):
                F[a, b] = S[i, a, b]
                for c in range(NX):
                    F[a, b] += B[i, c, a] * VA[c, b]
            for b in range(a + 1):
                L[a, b] = R[i, a, b]
                for c in range(NX):
                    L[a, b] += B[i, c, a] * VB[c, b]
            L[a, a] += delta
        if not cholesky(L):
            return False
        feedback(L, F, f, step.K[i], step.k[i])
        if i == 0:
            break
        for a in range(NX):
            w[a] = stages.q[i, a]
            for c in range(NX):
                w[a] += A[i, c, a] * v[c]
            for c in range(NU):
                w[a] += F[c, a] * step.k[i, c]
            for b in range(a + 1):
                total = stages.Q[i, a, b]
                for c in range(NX):
                    total += A[i, c, a] * VA[c, b]
                for c in range(NU):
                    total += F[c, a] * step.K[i, c, b]
                V[a, b] = total
                V[b, a] = total
        for a in range(NX):
            v[a] = w[a]
    return True


@inlined
def cholesky(L):
    """L of H = L L' in the place of H's lower triangle, its diagonal inverted; false if H <= 0."""
    for a in range(NU):
        for b in range(a):
            for c in range(b):
                L[a, b] -= L[a, c] * L[b, c]
            L[a, b] *= L[b, b]
            L[a, a] -= L[a, b] * L[a, b]
        if not L[a, a] > 0.0:
            return False
        L[a, a] = 1.0 / math.sqrt(L[a, a])
    return True


@inlined
def feedback(L, F, f, K, k):
    """K = -H^-1 F and k = -H^-1 f, from the factor that `cholesky` left."""
    for a in range(NU):
        k[a] = -f[a]
        for c in range(a):
            k[a] -= L[a, c] * k[c]
        k[a] *= L[a, a]
        for b in range(NX):
            K[a, b] = -F[a, b]
            for c in range(a):
                K[a, b] -= L[a, c] * K[c, b]
            K[a, b] *= L[a, a]
    for a in range(NU - 1, -1, -1):
        for c in range(a + 1, NU):
            k[a] -= L[c, a] * k[c]
        k[a] *= L[a, a]
        for b in range(NX):
            for c in range(a + 1, NU):
                K[a, b] -= L[c, a] * K[c, b]
            K[a, b] *= L[a, a]


@inlined
def newton_step(task, point, duals, stages, mu, step):
    """Step 6: the step; the primal and the dual length that stay inside bounds; the descent."""
    sweep(task, stages, step)
    rows_along(task, stages, step)
    derivative = descent(task, point, stages, mu, step)
    scale_rows(task, stages, step)
    tau = max(TAU_MIN, 1.0 - max(mu, TAU_REST))
    primal, dual = bounds_along(task, point, duals, mu, step, tau)
    inside = inside_rows(
        duals.lam[task.begin :].ravel(), step.lam[task.begin :].ravel(),
        task.weights[task.begin :].ravel(), tau,
    )  # fmt: skip
    return primal, min(dual, inside), derivative


@inlined
def sweep(task, stages, step):
    """The step of inputs and states, forwards along the feedback."""
    for a in range(NX):
        step.x[0, a] = 0.0
    for i in range(len(step.u)):
        for a in range(NU):
            step.u[i, a] = 0.0
            if i >= task.first:
                step.u[i, a] = step.k[i, a]
                for b in range(NX):
                    step.u[i, a] += step.K[i, a, b] * step.x[i, b]
        for a in range(NX):
            total = 0.0
            for b in range(NX):
                total += stages.A[i, a, b] * step.x[i, b]
            for b in range(NU):
                total += stages.B[i, a, b] * step.u[i, b]
            step.x[i + 1, a] = total


@inlined
def rows_along(task, stages, step):
    """dh of every planned row, in the place of its multiplier's step."""
    last, first, dh = len(step.u), FIXED + PER * task.lines, step.lam
    for i in range(task.begin, last):
        along_fixed(stages.hx[i], stages.hu[i], step.x[i], step.u[i], dh[i])
        for line in range(task.lines):
            along_line(
                stages.hx[i], stages.hu[i], step.x[i], step.u[i], dh[i], 0, FIXED + PER * line
            )
    along_fixed_end(stages.hx[last], stages.hu[last], step.x[last], step.u[last - 1], dh[last])
    for line in range(task.lines):
        along_line_end(
            stages.hx[last], stages.hu[last], step.x[last], step.u[last - 1], dh[last], 0,
            FIXED + PER * line,
        )  # fmt: skip
    for i in range(task.begin, last + 1):
        for j in range(len(task.sides)):
            dh[i, first + j] = task.sides[j, 1] * step.x[i, int(task.sides[j, 0])]
        for j in range(dh.shape[1]):
            if task.kind[i, j] != PLANNED:
                dh[i, j] = 0.0


@inlined
def scale_rows(task, stages, step):
    """dlam of every row, in the place of dh."""
    dlam, off, stiff = (
        step.lam[task.begin :].ravel(),
        stages.off[task.begin :].ravel(),
        stages.stiff[task.begin :].ravel(),
    )
    for t in range(dlam.size):
        dlam[t] = stiff[t] * (off[t] + dlam[t])


@inlined
def inside_rows(lam, dlam, weights, tau):
    """The largest step up to 1 that leaves every lam the share 1 - tau of its way to 0 or W."""
    worst = tau
    for t in range(lam.size):
        ratio = abs(dlam[t]) / (lam[t] if dlam[t] < 0.0 else weights[t] - lam[t])
        worst = ratio if ratio > worst else worst
    return tau / worst


@inlined
def bounds_along(task, point, duals, mu, step, tau):
    """Steps of the bounds' multipliers; the lengths that stay inside bounds, primal and dual."""
    primal, dual = tau, tau
    for i in range(len(step.u)):
        for a in range(NU):
            if i < task.first:
                step.below[i, a] = step.above[i, a] = 0.0
                continue
            du, low, high = (
                step.u[i, a],
                point.u[i, a] - task.lower[a],
                task.upper[a] - point.u[i, a],
            )
            below, above = duals.below[i, a], duals.above[i, a]
            step.below[i, a] = (mu - below * du) / low - below
            step.above[i, a] = (mu + above * du) / high - above
            ratio = abs(du) / (low if du < 0.0 else high)
            primal = ratio if ratio > primal else primal
            ratio = max(-step.below[i, a] / below, -step.above[i, a] / above)
            dual = ratio if ratio > dual else dual
    return tau / primal, tau / dual


@inlined
def descent(task, point, stages, mu, step):
    """The barrier function's derivative along the step, while step.lam holds dh."""
    total = 0.0
    for i in range(len(step.x)):
        for a in range(NX):
            total += stages.lx[i, a] * step.x[i, a]
    for i in range(task.first, len(step.u)):
        for a in range(NU):
            low, high = point.u[i, a] - task.lower[a], task.upper[a] - point.u[i, a]
            total += (stages.cu[i, a] - mu / low + mu / high) * step.u[i, a]
    for i in range(task.begin, len(step.lam)):
        for j in range(step.lam.shape[1]):
            total += mu / point.slack[i, j] * step.lam[i, j]
    return total


@inlined
def follow(task, plan, step, length, point):
    """Roll out u + length k + K (x - plan) from point.x[0], inside the inputs' bounds."""
    for i in range(len(plan.u)):
        for a in range(NU):
            move = 0.0
            if i >= task.first:
                move = length * step.k[i, a]
                for b in range(NX):
                    move += step.K[i, a, b] * (point.x[i, b] - plan.x[i, b])
            low, high = plan.u[i, a] - task.lower[a], task.upper[a] - plan.u[i, a]
            point.u[i, a] = plan.u[i, a] + min(max(move, -WITHIN * low), WITHIN * high)
        transition(point.x[i], point.u[i], task.theta, task.data[i], point.x[i + 1])


@inlined
def search(task, point, trial, mu, step, length, total, derivative):
    """Step 7: put into `trial` what lowers the barrier function; it and the objective, or nan."""
    while length > SHORTEST:
        follow(task, point, step, length, trial)
        objective, reached = measure(task, trial, mu)
        if reached <= total + ARMIJO * length * derivative + ROUNDING * abs(total):
            return objective, reached
        length *= BACKTRACKS
    return np.nan, np.nan


@inlined
def advance(task, duals, step, length):
    """Move the multipliers along the step."""
    for i in range(len(duals.below)):
        for a in range(NU):
            duals.below[i, a] += length * step.below[i, a]
            duals.above[i, a] += length * step.above[i, a]
    for i in range(task.begin, len(duals.lam)):
        for j in range(duals.lam.shape[1]):
            most = ALMOST * task.weights[i, j]
            duals.lam[i, j] = min(duals.lam[i, j] + length * step.lam[i, j], most)


@inlined
def lines_of(data):
    """The number of lines of data that have rows of their own."""
    return (data.shape[1] - OWN) // WIDTH if WIDTH > 0 else 0


@inlined
def slacks_of(task):
    """The number of slacks of a stage, one for each row that is not hard."""
    return SOFT + PER * task.lines


@inlined
def offsets(task, stage):
    """Where the variables and the constraints of a stage begin in the vectors of `Ocp`."""
    slacks, later = slacks_of(task), min(stage, 1)
    constraints = stage * (NX + slacks + FIXED - SOFT) + later * (NX + task.first * NU)
    return stage * (NX + NU + slacks), constraints


@inlined
def place_of_rows(task, stage, last):
    """Where the rows of a stage begin among the constraints of `Ocp`."""
    constraints = offsets(task, stage)[1] + (NX if stage < last else 0)
    return constraints + (NX + task.first * NU if stage == 0 else 0)


@inlined
def place_of_row(task, j):
    """Where row j is among those of its stage in `Ocp`: soft ones first, then hard ones."""
    if j < SOFT:
        return j
    return slacks_of(task) + j - SOFT if j < FIXED else SOFT + j - FIXED


@inlined
def begin_inputs(task, point, state, action, start, warm_start):
    """The inputs of the warm start, inside their bounds."""
    last, ahead = len(point.u), 1 if start == SHIFTED else 0
    for a in range(NX):
        point.x[0, a] = state[a]
    for i in range(last):
        at = offsets(task, min(i + ahead, last - 1))[0] + NX
        for a in range(NU):
            low, high = task.lower[a], task.upper[a]
            push = PUSH[start] * min(1.0, high - low)
            point.u[i, a] = min(max(warm_start[at + a], low + push), high - push)
            if i < task.first:
                point.u[i, a] = action[a]


@inlined
def recall(task, start, warm_start, point, plan):
    """The states of a warm start beside the inputs of `point`; how far this leaves them.

    Returns whether a deviation of the first state grows: then the inputs alone lead nowhere.
    """
    last, ahead = len(point.u), 1 if start == SHIFTED else 0
    apart, farthest, largest = 0.0, 0.0, 0.0
    for i in range(last + 1):
        at = offsets(task, min(i + ahead, last))[0]
        for a in range(NX):
            plan.x[i, a] = warm_start[at + a]
            largest = max(largest, abs(plan.x[i, a]))
            away = abs(point.x[i, a] - plan.x[i, a])
            if i == 0:
                apart = max(apart, away)
            if not away <= farthest and i + ahead <= last:
                farthest = away
        for a in range(NU if i < last else 0):
            plan.u[i, a] = point.u[i, a]
    return not farthest <= max(GROWS * apart, NOTICED * largest)


@inlined
def scaled(
    theta, data, lower, upper, sides, kind, discount, weights, first, point, state, action, start,
    warm_start,
):  # fmt: skip
    """The problem divided by the size of its costs along the plan of a start, and that size."""
    last, rows = len(discount) - 1, len(weights) + len(sides)
    scaled_weights, begin = np.empty((last + 1, rows)), 1
    for j in range(rows):
        if kind[0, j] == PLANNED:
            begin = 0
    rate = discount.copy()
    task = Task(
        theta, data, lower, upper, sides, kind, begin, lines_of(data), rate, scaled_weights, first
    )
    begin_inputs(task, point, state, action, start, warm_start)
    roll(task, point)
    factor = discount[last] * terminal_size(point.x[last], theta, data[last])
    for i in range(last):
        factor = max(factor, discount[i] * stage_size(point.x[i], point.u[i], theta, data[i]))
    if not 0.0 < factor < np.inf:
        factor = 1.0
    strict = STRICT
    for j in range(len(weights)):
        if weights[j] < np.inf:
            strict = max(strict, STRICT_TO_SOFT * weights[j] / factor)
    for i in range(last + 1):
        rate[i] = discount[i] / factor
        for j in range(rows):
            soft = j < len(weights) and weights[j] < np.inf
            scaled_weights[i, j] = weights[j] * rate[i] if soft else strict
    return task, factor


@inlined
def begin_multipliers(task, point, duals, start, mu, factor, warm_start):
    """The bounds' multipliers: the warm start's, or central ones where these are larger."""
    last, ahead = len(point.u), 1 if start == SHIFTED else 0
    gain = task.rate[0] / task.rate[ahead] / factor
    nu = offsets(task, last)[0] + NX + slacks_of(task) + place_of_rows(task, last, last)
    nu += slacks_of(task) + FIXED - SOFT
    for i in range(last):
        at = nu + offsets(task, min(i + ahead, last - 1))[0] + NX
        for a in range(NU):
            below, above = mu / (point.u[i, a] - task.lower[a]), mu / (task.upper[a] - point.u[i, a])
            duals.below[i, a] = max(-gain * warm_start[at + a], below)
            duals.above[i, a] = max(gain * warm_start[at + a], above)
            if i < task.first:
                duals.below[i, a] = duals.above[i, a] = 0.0


@inlined
def old_row(task, last, i, j, solution):
    """The multiplier of row j of a stage in a solution."""
    slacks, first = slacks_of(task), FIXED + PER * task.lines
    lam = offsets(task, last)[0] + NX + slacks
    if j < first:
        return solution[lam + place_of_rows(task, i, last) + place_of_row(task, j)]
    nu = lam + place_of_rows(task, last, last) + slacks + FIXED - SOFT
    state, sign = int(task.sides[j - first, 0]), task.sides[j - first, 1]
    return sign * solution[nu + offsets(task, i)[0] + state]


@inlined
def begin_rows(task, point, duals, start, mu, factor, warm_start):
    """The rows' multipliers: central, or the warm start's unless these are nearer to 0 or W."""
    last, ahead = len(point.u), 1 if start == SHIFTED else 0
    gain = task.rate[0] / task.rate[ahead] / factor
    for i in range(task.begin, last + 1):
        for j in range(duals.lam.shape[1]):
            source = min(i + ahead, last)
            if task.kind[source, j] != PLANNED:
                source = i
            middle = mu / point.slack[i, j]
            if start != COLD and task.kind[source, j] == PLANNED:
                old = gain * old_row(task, last, source, j, warm_start)
                middle = max(old, middle) if point.h[i, j] < 0.0 else min(old, middle)
            weight = task.weights[i, j]
            duals.lam[i, j] = min(max(middle, INSIDE * weight), (1.0 - INSIDE) * weight)


@inlined
def recentre(task, point, duals, mu):
    """Multipliers that agree with the point: then Newton's step surely descends."""
    for i in range(len(point.u)):
        for a in range(NU):
            if i >= task.first:
                duals.below[i, a] = mu / (point.u[i, a] - task.lower[a])
                duals.above[i, a] = mu / (task.upper[a] - point.u[i, a])
    for i in range(task.begin, len(duals.lam)):
        for j in range(duals.lam.shape[1]):
            duals.lam[i, j] = min(mu / point.slack[i, j], ALMOST * task.weights[i, j])


@inlined
def iterate(task, point, trial, duals, stages, step, mu, objective, total, limit, tolerance):
    """Steps 2 to 7 until one of the ends; the point, its objective, iterations, end and error."""
    delta, iteration, polished, centred, ended = 0.0, 0, 0, False, LIMIT
    while True:
        linearise(task, point, duals, stages)
        stationarity, complementarity, largest = residuals(task, point, duals, stages, mu)
        error = max(stationarity / largest, complementarity, mu)
        if not stationarity + complementarity < np.inf:  # `max` may lose a nan
            ended = BROKEN
            break
        goal = tolerance * min(1.0, max(abs(objective), LEAST_VALUE * largest))
        polished += 1 if error <= tolerance else 0
        if error <= goal or polished > POLISHED:
            ended = SOLVED
            break
        if iteration >= limit:
            ended = SOLVED if error <= tolerance else LIMIT
            break
        if max(stationarity, complementarity) <= KAPPA_EPSILON * mu and mu > MU_FLOOR * goal:
            mu = max(MU_FLOOR * goal, min(KAPPA_MU * mu, mu**THETA_MU))
            centre(
                point.h[task.begin :].ravel(), task.weights[task.begin :].ravel(), mu,
                point.sigma[task.begin :].ravel(), point.slack[task.begin :].ravel(),
            )  # fmt: skip
            total = objective + barrier(task, point, mu)
        iteration += 1
        condense(task, point, duals, stages, mu)
        added = 0.0
        while not factorise(stages, added, task.first, step) and added < DELTA_LARGEST:
            if added > 0.0:
                added = DELTA_GROWS * added
            else:
                added = (
                    max(delta / DELTA_SHRINKS, DELTA_LEAST * largest)
                    if delta > 0.0
                    else DELTA_FIRST * largest
                )
        delta = added if added > 0.0 else delta
        primal, dual, derivative = newton_step(task, point, duals, stages, mu, step)
        reached, reached_total = search(task, point, trial, mu, step, primal, total, derivative)
        if reached == reached:
            point, trial, centred = trial, point, False
            objective, total = reached, reached_total
            advance(task, duals, step, dual)
        elif centred:
            ended = SOLVED if error <= tolerance else STALLED
            break
        else:
            recentre(task, point, duals, mu)
            centred = True
    return point, objective, iteration, ended, error


@inlined
def settle(task, point, tie, h, held):
    """h of the rows of stage 0, and the multipliers of the soft ones that no plan can change."""
    size = np.empty(len(h))
    x, u, theta, d = point.x[0], point.u[0], task.theta, task.data[0]
    fixed_rows(x, u, theta, d, h)
    fixed_sizes(x, u, theta, d, size)
    for line in range(task.lines):
        of, at = OWN + WIDTH * line, FIXED + PER * line
        line_rows(x, u, theta, d, d, h, of, at)
        line_sizes(x, u, theta, d, d, size, of, at)
    for j in range(FIXED + PER * task.lines):
        if task.kind[0, j] == SETTLED:
            soft = j < SOFT or j >= FIXED
            held[j] = task.weights[0, j] if soft and h[j] > tie * size[j] else 0.0


@inlined
def theta_of_rows(task, x, u, i, last, held, gradient):
    """Add the gradient of held' h in theta."""
    theta, d = task.theta, task.data[i]
    if i < last:
        theta_fixed(x, u, theta, d, held, gradient, gradient)
    else:
        theta_fixed_end(x, u, theta, d, held, gradient, gradient)
    for line in range(task.lines):
        of, at = OWN + WIDTH * line, FIXED + PER * line
        if i < last:
            theta_line(x, u, theta, d, d, held, gradient, gradient, of, at)
        else:
            theta_line_end(x, u, theta, d, d, held, gradient, gradient, of, at)


@inlined
def write_solution(task, point, duals, stages, objective, factor, tie, out):
    """Write the solution in the order of `Ocp`, and the value's gradient: the kernel's Lagrangian.

    Returns the value, the largest violation of a hard row and the largest number in the plan.
    """
    last, slacks, rows = len(point.u), slacks_of(task), duals.lam.shape[1]
    variables = offsets(task, last)[0] + NX + slacks
    nu = variables + place_of_rows(task, last, last) + slacks + FIXED - SOFT
    phi, first = nu + variables, FIXED + PER * task.lines
    violation, largest = 0.0, 0.0
    gradient, held, h = np.empty(NTHETA), np.empty(rows), np.empty(rows)
    initial_theta(point.x[0], task.theta, task.data[0], gradient)
    for a in range(NTHETA):
        out[phi + a] = gradient[a]
    value = factor * objective + initial_cost(point.x[0], task.theta, task.data[0])
    for i in range(last + 1):
        at, row = offsets(task, i)
        u = point.u[min(i, last - 1)]
        for j in range(rows):
            held[j] = duals.lam[i, j] if i >= task.begin and task.kind[i, j] == PLANNED else 0.0
            h[j] = point.h[i, j]
        if i == 0:
            settle(task, point, tie, h, held)
        rate, data = task.rate[i : i + 1], task.data[i]
        if i < last:
            p = stages.p[i + 1]
            stage_theta(point.x[i], u, task.theta, data, rate, p, gradient)
            for a in range(NX):
                out[variables + row + a] = -factor * p[a]
            for a in range(NU):
                out[at + NX + a] = u[a]
                out[nu + at + NX + a] = factor * (duals.above[i, a] - duals.below[i, a])
        else:
            terminal_theta(point.x[i], task.theta, data, rate, gradient)
        theta_of_rows(task, point.x[i], u, i, last, held, gradient)
        add(out, phi, factor, gradient)
        if i == 0:
            row = variables + NX  # behind the dynamics
            for a in range(NX):
                out[row + a] = -factor * stages.p[0, a]
            for a in range(task.first * NU):
                out[row + NX + a] = -factor * input_gradient(stages, 0, a)
        for a in range(NX):
            out[at + a] = point.x[i, a]
            out[nu + at + a] = 0.0
            largest = max(largest, abs(point.x[i, a]))
        row = variables + place_of_rows(task, i, last)
        sigma = at + NX + (NU if i < last else 0)
        for j in range(rows):
            there = task.kind[i, j] == PLANNED or (task.kind[i, j] == SETTLED and j < first)
            beyond = max(0.0, h[j]) if there else 0.0
            if j >= first:
                side = task.sides[j - first]
                out[nu + at + int(side[0])] += side[1] * factor * held[j]
            else:
                out[row + place_of_row(task, j)] = factor * held[j]
            if j >= SOFT and (j < FIXED or j >= first):
                violation = max(violation, beyond if task.kind[i, j] == PLANNED else 0.0)
                continue
            weight, k = factor * task.weights[i, j], place_of_row(task, j)
            value += weight * beyond
            out[sigma + k] = beyond
            out[nu + sigma + k] = factor * held[j] - weight
    return value, violation, largest


@inlined
def add(out, at, times, vector):
    """Add `times` the vector to a part of `out`."""
    for a in range(len(vector)):
        out[at + a] += times * vector[a]


@inlined
def allocate(N, rows):
    """Space for an iterate, a trial of the next one, multipliers, derivatives and a step."""
    point = Point(
        np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N + 1, rows)), np.empty((N + 1, rows)), np.empty((N + 1, rows)),
    )  # fmt: skip
    trial = Point(
        np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N + 1, rows)), np.empty((N + 1, rows)), np.empty((N + 1, rows)),
    )  # fmt: skip
    duals = Duals(np.empty((N + 1, rows)), np.empty((N, NU)), np.empty((N, NU)))
    stages = Stages(  # what is written at its nonzeros begins as zeros
        np.zeros((N, NX, NX)), np.zeros((N, NX, NU)),
        np.zeros((N + 1, rows, NX)), np.zeros((N + 1, rows, NU)),
        np.empty((N + 1, NX)), np.empty((N + 1, NU)), np.empty((N + 1, NU)), np.empty((N + 1, NX)),
        np.empty((N + 1, NX, NX)), np.empty((N + 1, NU, NX)), np.empty((N + 1, NU, NU)),
        np.empty((N + 1, NX)), np.empty((N + 1, NU)),
        np.empty((N + 1, rows)), np.empty((N + 1, rows)),
        np.empty(rows), np.empty(rows), np.empty(rows),
    )  # fmt: skip
    step = Step(
        np.empty((N, NU, NX)), np.empty((N, NU)), np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N + 1, rows)), np.empty((N, NU)), np.empty((N, NU)),
    )  # fmt: skip
    return point, trial, duals, stages, step


vector, matrix, tensor = float64[::1], float64[:, ::1], float64[:, :, ::1]
PROBLEM = (
    matrix, vector, vector, matrix, int64[:, ::1], vector, vector, float64,  # see `Arguments`
    vector, vector, vector, int64,  # state, theta, action, whether u_0 is the action
)  # fmt: skip

"""A primal-dual interior point for Eq. (2) whose cost is linear in stages and constraints.

The inputs are the variables and the states follow from them (single shooting). Each constraint
h(x) <= sigma of a stage, an obstacle or a side of the box, is a *row*: with slack s = sigma - h it
adds W sigma - mu log sigma - mu log s to the objective, and its multiplier lam lies in (0, W). From
a warm start, one solve repeats the following while the barrier parameter mu falls:

1. `evaluate`: roll the inputs out; measure h, and for it the best sigma and s in closed form;
2. `linearise`: from the last stage to the first, the costates p = L_x + A' p+ and the Hessian of
   the Lagrangian, exact, with the curvature of the dynamics;
3. `residuals`: how far KKT is from holding; stop if hardly, let mu fall if little beside mu;
4. `condense`: fold rows and bounds into the stages, one division each;
5. `factorise`: the Riccati recursion. Where some Q_uu is not positive definite, delta I is added
   to all of them and the recursion repeated;
6. `newton_step`: sweep forwards for the step, and find how far every variable stays inside bounds;
7. `search`: backtrack until the barrier function has fallen enough (Armijo).

Sources: the recursion, Rawlings, Mayne and Diehl (2017), section 8.8; barrier, fraction to the
boundary and inertia, Wächter and Biegler (2006); stage-wise elimination, Frison and Diehl (2020).

numba compiles this file beside a `model` generated from a plant's CasADi expressions, whose sizes
are constants there. Everything is inlined and every buffer allocated inside `solve`: only then does
the compiler know that no two of them overlap, which is worth 30 % of the time.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import float64, int64, njit

from .codes import End, Start
from .model import (
    NTHETA,
    NU,
    NX,
    constraint,
    constraint_gradient,
    expand_constraint,
    expand_stage,
    expand_terminal,
    stage_cost,
    stage_gradient,
    terminal_cost,
    terminal_gradient,
    transition,
)

# numba takes plain numbers; a tuple below has one entry a start.
COLD, SHIFTED, NEAR, SAME = map(int, Start)
SOLVED, STALLED, LIMIT, BROKEN, SADDLE = map(int, End)
START_MU = (10.0, 1e-3, 1e-3, 1e-9)  # the barrier parameter
PUSH = (1e-2, 1e-3, 1e-3, 1e-9)  # inside its bounds an input starts, in parts of their distance

BOX_WEIGHT = 1e4  # W of the box, scaled: an exact penalty, so that no state is infeasible
BOX_TO_SLACK = 100.0  # so many times an obstacle's W it is at least

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
    """The problem of one solve, scaled so that no weight exceeds 1."""

    theta: np.ndarray  # (NTHETA,)
    target: np.ndarray  # (NX,)
    lower: np.ndarray  # of an input, (NU,)
    upper: np.ndarray  # (NU,)
    discs: np.ndarray  # centre x, centre y and clearance, (M, 3)
    sides: np.ndarray  # state, sign and limit: sign (x - limit) <= 0, (B, 3)
    rate: np.ndarray  # scaled gamma^i, (N + 1,)
    weights: np.ndarray  # W of the rows of stages 1, ..., N, (N, M + B)
    first: int  # the first stage with a free input: 1 if u_0 is given, else 0


class Point(NamedTuple):
    """An iterate; row arrays are those of the stages 1, ..., N."""

    x: np.ndarray  # (N + 1, NX)
    u: np.ndarray  # (N, NU)
    h: np.ndarray  # (N, M + B), as all that follows
    sigma: np.ndarray
    slack: np.ndarray


class Duals(NamedTuple):
    """The multipliers of an iterate."""

    lam: np.ndarray  # of the rows, in (0, W)
    below: np.ndarray  # of the inputs' lower bounds, (N, NU)
    above: np.ndarray  # (N, NU)


class Stages(NamedTuple):
    """Derivatives at an iterate, and their condensed form."""

    A: np.ndarray  # d x+ / d x, (N, NX, NX)
    B: np.ndarray  # d x+ / d u, (N, NX, NU)
    hx: np.ndarray  # gradients of the obstacles, (N, M, NX)
    lx: np.ndarray  # of the objective, (N + 1, NX)
    lu: np.ndarray  # (N, NU)
    p: np.ndarray  # costates, (N + 1, NX)
    Q: np.ndarray  # Hessian of the Lagrangian, (N + 1, NX, NX)
    S: np.ndarray  # (N, NU, NX)
    R: np.ndarray  # (N, NU, NU)
    q: np.ndarray  # Newton's right-hand side, (N + 1, NX)
    r: np.ndarray  # (N, NU)
    off: np.ndarray  # dlam = stiff (off + h_x dx), shape of the rows
    stiff: np.ndarray


class Step(NamedTuple):
    """A Newton step, and the feedback u = k + K x that makes it."""

    K: np.ndarray  # (N, NU, NX)
    k: np.ndarray  # (N, NU)
    x: np.ndarray  # (N + 1, NX)
    u: np.ndarray  # (N, NU)
    lam: np.ndarray
    below: np.ndarray
    above: np.ndarray


@inlined
def evaluate(task, point, mu):
    """Step 1 for point.x[0] and point.u; the objective and the barrier function."""
    x, u = point.x, point.u
    for i in range(len(u)):
        transition(x[i], u[i], x[i + 1])
    measure(task, x, point.h)
    centre(point.h.ravel(), task.weights.ravel(), mu, point.sigma.ravel(), point.slack.ravel())
    last = len(u)
    objective = task.rate[last] * terminal_cost(x[last], task.theta, task.target)
    for i in range(last):
        objective += task.rate[i] * stage_cost(x[i], u[i], task.theta, task.target)
    return objective, objective + barrier(task, point, mu)


@inlined
def measure(task, x, h):
    """h of every row: the obstacles, then the sides of the box."""
    obstacles = len(task.discs)
    for i in range(len(h)):
        for j in range(obstacles):
            h[i, j] = constraint(x[i + 1], task.theta, task.discs[j])
        for j in range(len(task.sides)):
            state, sign, limit = int(task.sides[j, 0]), task.sides[j, 1], task.sides[j, 2]
            h[i, obstacles + j] = sign * (x[i + 1, state] - limit)


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
    for i in range(len(sigma)):
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
def linearise(task, point, duals, stages):
    """Step 2: derivatives of every stage, from the last to the first."""
    x, u, p, Q, A = point.x, point.u, stages.p, stages.Q, stages.A
    last, obstacles = len(u), len(task.discs)
    curved = np.empty((NX, NX))
    for i in range(last, -1, -1):
        rate = task.rate[i : i + 1]
        if i == last:
            expand_terminal(x[i], task.theta, task.target, rate, stages.lx[i], Q[i])
            for a in range(NX):
                p[i, a] = stages.lx[i, a]
        else:
            expand_stage(
                x[i], u[i], task.theta, task.target, rate, p[i + 1],
                A[i], stages.B[i], stages.lx[i], stages.lu[i], Q[i], stages.S[i], stages.R[i],
            )  # fmt: skip
            for a in range(NX):
                total = stages.lx[i, a]
                for b in range(NX):
                    total += A[i, b, a] * p[i + 1, b]
                p[i, a] = total
        if i == 0:
            return
        for j in range(obstacles):
            lam, hx = duals.lam[i - 1, j], stages.hx[i - 1, j]
            expand_constraint(x[i], task.theta, task.discs[j], hx, curved)
            for a in range(NX):
                p[i, a] += lam * hx[a]
                for b in range(NX):
                    Q[i, a, b] += lam * curved[a, b]
        for j in range(len(task.sides)):
            p[i, int(task.sides[j, 0])] += duals.lam[i - 1, obstacles + j] * task.sides[j, 1]


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
        duals.lam.ravel(), task.weights.ravel(), point.sigma.ravel(), point.slack.ravel(), mu
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
    """Step 4: Newton's system without rows and bounds: q and r, and Q and R in place."""
    soften(
        point.h.ravel(), point.sigma.ravel(), point.slack.ravel(), duals.lam.ravel(),
        task.weights.ravel(), mu, stages.off.ravel(), stages.stiff.ravel(),
    )  # fmt: skip
    q, Q, obstacles = stages.q, stages.Q, len(task.discs)
    for i in range(1, len(q)):
        for a in range(NX):
            q[i, a] = stages.lx[i, a]
        for j in range(obstacles):
            hx, stiff = stages.hx[i - 1, j], stages.stiff[i - 1, j]
            pull = duals.lam[i - 1, j] + stages.off[i - 1, j] * stiff
            for a in range(NX):
                q[i, a] += pull * hx[a]
                for b in range(NX):
                    Q[i, a, b] += stiff * hx[a] * hx[b]
        for j in range(len(task.sides)):
            a, t = int(task.sides[j, 0]), obstacles + j
            pull = duals.lam[i - 1, t] + stages.off[i - 1, t] * stages.stiff[i - 1, t]
            q[i, a] += pull * task.sides[j, 1]
            Q[i, a, a] += stages.stiff[i - 1, t]
    for i in range(task.first, len(point.u)):
        for a in range(NU):
            low, high = 1.0 / (point.u[i, a] - task.lower[a]), 1.0 / (task.upper[a] - point.u[i, a])
            stages.r[i, a] = stages.lu[i, a] - mu * low + mu * high
            stages.R[i, a, a] += duals.below[i, a] * low + duals.above[i, a] * high


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
    scale_rows(step.lam.ravel(), stages.off.ravel(), stages.stiff.ravel())
    tau = max(TAU_MIN, 1.0 - max(mu, TAU_REST))
    primal, dual = bounds_along(task, point, duals, mu, step, tau)
    inside = inside_rows(duals.lam.ravel(), step.lam.ravel(), task.weights.ravel(), tau)
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
    """h_x dx of every row, in the place of its multiplier's step."""
    dx, hx_dx, obstacles = step.x, step.lam, len(task.discs)
    for i in range(len(hx_dx)):
        for j in range(obstacles):
            total = 0.0
            for a in range(NX):
                total += stages.hx[i, j, a] * dx[i + 1, a]
            hx_dx[i, j] = total
        for j in range(len(task.sides)):
            hx_dx[i, obstacles + j] = task.sides[j, 1] * dx[i + 1, int(task.sides[j, 0])]


@inlined
def scale_rows(dlam, off, stiff):
    """dlam of every row, in the place of h_x dx."""
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
    """The barrier function's derivative along the step, while step.lam holds h_x dx."""
    total = 0.0
    for i in range(len(step.x)):
        for a in range(NX):
            total += stages.lx[i, a] * step.x[i, a]
    for i in range(task.first, len(step.u)):
        for a in range(NU):
            total += stages.r[i, a] * step.u[i, a]
    for i in range(len(step.lam)):
        for j in range(step.lam.shape[1]):
            total += mu / point.slack[i, j] * step.lam[i, j]
    return total


@inlined
def search(task, point, trial, mu, step, length, total, derivative):
    """Step 7: put into `trial` what lowers the barrier function; it and the objective, or nan."""
    while length > SHORTEST:
        for i in range(len(step.u)):
            for a in range(NU):
                trial.u[i, a] = point.u[i, a] + length * step.u[i, a]
        objective, reached = evaluate(task, trial, mu)
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
    for i in range(len(duals.lam)):
        for j in range(duals.lam.shape[1]):
            most = ALMOST * task.weights[i, j]
            duals.lam[i, j] = min(duals.lam[i, j] + length * step.lam[i, j], most)


@inlined
def scaled(theta, target, lower, upper, discs, sides, discount, slack_weight, soft_box, first):
    """The task divided by max(1, theta^2), and that factor."""
    factor = 1.0
    for a in range(NTHETA):
        factor = max(factor, theta[a] * theta[a])
    rate = np.empty(len(discount))
    weights = np.empty((len(discount) - 1, len(discs) + len(sides)))
    strict = max(BOX_WEIGHT, BOX_TO_SLACK * slack_weight / factor)
    for i in range(len(discount)):
        rate[i] = discount[i] / factor
        for j in range(weights.shape[1]):
            if i > 0:
                slack = soft_box or j < len(discs)
                weights[i - 1, j] = slack_weight * rate[i] if slack else strict
    return Task(theta, target, lower, upper, discs, sides, rate, weights, first), factor


@inlined
def slacks_of(task):
    """The number of slacks of a stage."""
    return len(task.discs)


@inlined
def offsets(task, stage):
    """Where the variables and the constraints of a stage begin in the vectors of `Ocp`."""
    obstacles, later = slacks_of(task), min(stage, 1)
    constraints = stage * (NX + obstacles) + later * (NX + task.first * NU)
    return stage * (NX + NU + obstacles), constraints


@inlined
def initialise(task, point, duals, state, action, start, mu, factor, warm_start):
    """The inputs of the warm start, inside their bounds, and the bounds' multipliers."""
    last = len(point.u)
    ahead = 1 if start == SHIFTED else 0
    gain = task.rate[0] / task.rate[ahead] / factor
    variables, constraints = offsets(task, last)
    nu = variables + NX + constraints + 2 * slacks_of(task)
    for a in range(NX):
        point.x[0, a] = state[a]
    for i in range(last):
        at = offsets(task, min(i + ahead, last - 1))[0] + NX
        for a in range(NU):
            low, high = task.lower[a], task.upper[a]
            push = PUSH[start] * min(1.0, high - low)
            point.u[i, a] = min(max(warm_start[at + a], low + push), high - push)
            duals.below[i, a] = max(-gain * warm_start[nu + at + a], mu / (point.u[i, a] - low))
            duals.above[i, a] = max(gain * warm_start[nu + at + a], mu / (high - point.u[i, a]))
            if i < task.first:
                point.u[i, a] = action[a]
                duals.below[i, a] = duals.above[i, a] = 0.0


@inlined
def initialise_rows(task, point, duals, start, mu, factor, warm_start):
    """The rows' multipliers: central, or the warm start's unless these are nearer to 0 or W."""
    last, obstacles = len(point.u), len(task.discs)
    ahead = 1 if start == SHIFTED else 0
    gain = task.rate[0] / task.rate[ahead] / factor
    variables, constraints = offsets(task, last)
    lam = variables + NX + obstacles
    nu = lam + constraints + obstacles
    for i in range(last):
        source = min(i + 1 + ahead, last)
        variables, constraints = offsets(task, source)
        dynamics = NX if source < last else 0
        for j in range(duals.lam.shape[1]):
            middle, old = mu / point.slack[i, j], 0.0
            if j < obstacles:
                old = gain * warm_start[lam + constraints + dynamics + j]
            else:
                side = task.sides[j - obstacles]
                old = gain * side[1] * warm_start[nu + variables + int(side[0])]
            if start != COLD:
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
    for i in range(len(duals.lam)):
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
                point.h.ravel(), task.weights.ravel(), mu, point.sigma.ravel(), point.slack.ravel()
            )
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
def write_solution(task, point, duals, stages, objective, factor, slack_weight, soft_box, tie, out):
    """Write the solution in the order of `Ocp`, and the value's gradient; see `Sensitivity`."""
    last, obstacles = len(point.u), len(task.discs)
    variables, constraints = offsets(task, last)
    lam = variables + NX + obstacles
    nu = lam + constraints + obstacles
    phi = nu + lam
    value, violation = factor * objective, 0.0
    gradient = np.empty(NTHETA)
    for a in range(NTHETA):
        out[phi + a] = 0.0
    for i in range(last + 1):
        rate = factor * task.rate[i]
        at, row = offsets(task, i)
        for a in range(NX):
            out[at + a] = point.x[i, a]
            out[nu + at + a] = 0.0
        if i < last:
            stage_gradient(point.x[i], point.u[i], task.theta, task.target, gradient)
            for a in range(NX):
                out[lam + row + a] = -factor * stages.p[i + 1, a]
            row += NX
        else:
            terminal_gradient(point.x[i], task.theta, task.target, gradient)
        add(out, phi, rate, gradient)
        if i == 0:
            for a in range(NX):
                out[lam + row + a] = -factor * stages.p[0, a]
            for a in range(task.first * NU):
                out[lam + row + NX + a] = -factor * input_gradient(stages, 0, a)
            row += NX + task.first * NU
        else:
            for j in range(len(task.sides)):
                a, sign = int(task.sides[j, 0]), task.sides[j, 1]
                out[nu + at + a] += sign * factor * duals.lam[i - 1, obstacles + j]
                beyond = max(0.0, point.h[i - 1, obstacles + j])
                violation = max(violation, beyond)
                value += rate * slack_weight * beyond if soft_box else 0.0
        at += NX
        if i < last:
            for a in range(NU):
                out[at + a] = point.u[i, a]
                out[nu + at + a] = factor * (duals.above[i, a] - duals.below[i, a])
            at += NU
        for j in range(obstacles):
            weight = rate * slack_weight
            h = constraint(point.x[i], task.theta, task.discs[j])
            multiplier = weight if h > tie else 0.0
            if i > 0:
                multiplier = factor * duals.lam[i - 1, j]
            value += weight * max(0.0, h)
            constraint_gradient(point.x[i], task.theta, task.discs[j], gradient)
            add(out, phi, multiplier, gradient)
            out[at + j] = max(0.0, h)
            out[lam + row + j] = multiplier
            out[nu + at + j] = multiplier - weight
    return value, violation


@inlined
def add(out, at, times, vector):
    """Add `times` the vector to a part of `out`."""
    for a in range(len(vector)):
        out[at + a] += times * vector[a]


@inlined
def allocate(N, M, rows):
    """Space for an iterate, a trial of the next one, multipliers, derivatives and a step."""
    point = Point(
        np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N, rows)), np.empty((N, rows)), np.empty((N, rows)),
    )  # fmt: skip
    trial = Point(
        np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N, rows)), np.empty((N, rows)), np.empty((N, rows)),
    )  # fmt: skip
    duals = Duals(np.empty((N, rows)), np.empty((N, NU)), np.empty((N, NU)))
    stages = Stages(
        np.empty((N, NX, NX)), np.empty((N, NX, NU)), np.empty((N, M, NX)),
        np.empty((N + 1, NX)), np.empty((N, NU)), np.empty((N + 1, NX)),
        np.empty((N + 1, NX, NX)), np.empty((N, NU, NX)), np.empty((N, NU, NU)),
        np.empty((N + 1, NX)), np.empty((N, NU)), np.empty((N, rows)), np.empty((N, rows)),
    )  # fmt: skip
    step = Step(
        np.empty((N, NU, NX)), np.empty((N, NU)), np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N, rows)), np.empty((N, NU)), np.empty((N, NU)),
    )  # fmt: skip
    return point, trial, duals, stages, step


vector, matrix = float64[::1], float64[:, ::1]
PROBLEM = (
    vector, vector, vector, matrix, matrix, vector, float64, int64, float64,  # see InteriorPoint
    vector, vector, vector, int64,  # state, theta, action, whether u_0 is the action
)  # fmt: skip

"""A primal-dual interior point for a `Problem` whose work is linear in stages and rows.

The inputs are the variables and the states follow from them (single shooting). Each constraint
h(x, u) <= sigma of a stage is a *row*: with slack s = sigma - h it adds W sigma - mu log sigma - mu
log s to the objective, and its multiplier lam lies in (0, W). A hard row, or a bound of a state,
has a W that exceeds any multiplier, and is no part of the value.

Arrays of rows hold all stages one after the other: fixed rows, rows of lines of data, and sides of
the states' box. A row is *planned* where the plan can change it, *settled* at stage 0 where no plan
can, and else absent. Rows that are not planned stand in the barrier as h = -1 and change nothing.

From a start, one solve repeats the following while the barrier parameter mu falls:

1. `measure` a plan: h, and for it the best sigma and s in closed form;
2. `linearise`: from the last stage to the first, the costates p = L_x + A' p+ and the Hessian of
   the Lagrangian, with the curvature of the dynamics. The Hessian has the costates that step 6
   predicted (`remember`): p, their limit, depends wildly on the plan of an unstable model;
3. `residuals`: the violation of KKT. Stop if it is small; let mu fall if it is small beside mu;
4. `condense`: fold rows and bounds into the stages, one division each;
5. `factorise`: the Riccati recursion. Where some Q_uu is not positive definite, delta I is added
   to all of them and the recursion repeated;
6. `newton_step`: sweep forwards for the step, and find how far every variable stays inside bounds;
7. `search`: roll out along the feedback of 5, which holds an unstable model to its plan, and
   backtrack until the barrier function has fallen enough (Armijo).

Sources: the recursion, Rawlings, Mayne and Diehl (2017), section 8.8; barrier, fraction to the
boundary and inertia, Wächter and Biegler (2006); stage-wise elimination, Frison and Diehl (2020);
the feedback, Tassa, Mansard and Todorov (2014); a start with defects, Giftthaler et al. (2018).

numba compiles this file beside a `model` generated from CasADi expressions, whose sizes are
constants. Everything is inlined, and every buffer allocated in the function that is called: the
compiler then knows all sizes. Functions that allocate nothing are compiled without counting of
references (`_nrt`), which takes a fifth of the time, and must not return an array.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import float64, int64, njit

from . import model
from .codes import End, Start
from .model import FIXED, NTHETA, NU, NX, OWN, PER, SOFT, WIDTH

# numba takes plain numbers; a tuple below has one entry a start.
COLD, SHIFTED, NEAR, SAME, HELD = map(int, Start)
SOLVED, STALLED, LIMIT, BROKEN, SADDLE = map(int, End)
START_MU = (10.0, 1e-3, 1e-3, 1e-9, 10.0)  # the barrier parameter
PUSH = (1e-2, 1e-3, 1e-3, 1e-9, 1e-2)  # of its bounds' distance, by which an input starts inside

PLANNED, SETTLED = 1, 2  # kinds of rows, else absent
STRICT = 1e4  # W of hard rows, scaled: an exact penalty, so that no state is infeasible
STRICT_TO_SOFT = 100.0  # so many times the largest other W it is at least
DEAREST = 1e3  # W of rows of size 1 or more in sizes of the costs, beyond which digits are lost
DEARER = 1e6  # times the size of the costs, by which a problem is divided at most for that
ABSURD = 1e9  # no plan goes through such a state
GROWS = 3.0  # times the first state's distance from a plan: inputs leave it by more
NOTICED = 0.1  # and by more than this part of its largest state
WITHIN = 1.0 - 1e-5  # the most of its way to a bound that an input may go along the feedback
CAUTIOUS = 0.99  # the same of a start
CONVEX = 1e-3  # the first part of the largest curvature that makes the LQ problem of a start convex

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
FLAT = 1e-6  # curvature of the scaled problem that counts as none
INSIDE = 1e-12  # the part of W by which a multiplier starts inside (0, W)
ROUNDING = 1e-14  # of the barrier function, relative
ALMOST = 1.0 - 4e-16  # of W is the most for lam, or W - lam is rounded to 0
SHORTEST = 1e-10  # step that the search tries
RIGID = 1e-12  # barrier parameter of a solution that is differentiated

fast = {"contract", "arcp", "nsz", "reassoc", "afn"}  # not nnan, ninf: bad numbers must show
options: dict[str, Any] = {"error_model": "numpy", "fastmath": fast}
# To be called from machine code alone: a wrapper for Python takes a quarter of the compiling.
inner: dict[str, Any] = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
allocating = njit(**inner, **options)
merged = njit(inline="always", **options)  # no function by itself: compiled with each caller
inlined = njit(_nrt=False, **inner, **options)


class Task(NamedTuple):
    """The problem of one solve, scaled."""

    theta: np.ndarray  #: (NTHETA,)
    data: np.ndarray  #: (N + 1, OWN + lines WIDTH)
    lower: np.ndarray  #: of an input, (NU,)
    upper: np.ndarray  #: (NU,)
    sides: np.ndarray  #: of the states' box, state, sign and limit, sign (x - limit) <= 0, (B, 3)
    kind: np.ndarray  #: of the rows of each stage, (N + 1, rows)
    planned: np.ndarray  #: 1 or 0, (rows of all stages,)
    rate: np.ndarray  #: scaled gamma^i, (N + 1,)
    weights: np.ndarray  #: W, (rows of all stages,)
    first: int  #: the first stage with a free input, 1 if u_0 is given, else 0
    begin: int  #: the first stage with a planned row, 0 or 1
    rows: int  #: of a stage
    lines: int


class Point(NamedTuple):
    """An iterate."""

    x: np.ndarray  #: (N + 1, NX)
    u: np.ndarray  #: (N, NU)
    h: np.ndarray  #: (rows of all stages,), as all that follows
    sigma: np.ndarray
    slack: np.ndarray


class Duals(NamedTuple):
    """The multipliers of an iterate."""

    lam: np.ndarray  #: of the rows, in (0, W)
    below: np.ndarray  #: of the inputs' lower bounds, (N, NU)
    above: np.ndarray  #: (N, NU)


class Stages(NamedTuple):
    """Derivatives at an iterate, and their condensed form; parts with u are unused at stage N."""

    A: np.ndarray  #: d x+ / d x, (N, NX, NX)
    B: np.ndarray  #: d x+ / d u, (N, NX, NU)
    hx: np.ndarray  #: gradients of the rows but the sides, (rows of all stages, NX)
    hu: np.ndarray  #: (rows of all stages, NU)
    lx: np.ndarray  #: of the objective, (N + 1, NX)
    lu: np.ndarray  #: of the objective, and from `condense` on of the bounds' barrier, (N + 1, NU)
    px: np.ndarray  #: of lam' h, (N + 1, NX)
    pu: np.ndarray  #: (N + 1, NU)
    p: np.ndarray  #: costates, (N + 1, NX)
    gap: np.ndarray  #: added to dx_i by a step besides A dx + B du, 0 along a plan, (N + 1, NX)
    Q: np.ndarray  #: Hessian of the Lagrangian, (N + 1, NX, NX)
    S: np.ndarray  #: (N + 1, NU, NX)
    R: np.ndarray  #: (N + 1, NU, NU)
    q: np.ndarray  #: Newton's right-hand side, (N + 1, NX)
    r: np.ndarray  #: (N + 1, NU)
    off: np.ndarray  #: dlam = stiff (off + dh), (rows of all stages,)
    stiff: np.ndarray
    held: np.ndarray  #: lam of planned rows, 0 of others
    firm: np.ndarray  #: stiff, likewise
    pull: np.ndarray  #: lam + off stiff, likewise


class Step(NamedTuple):
    """A Newton step, the feedback u = k + K x that makes it, and the recursion's intermediates."""

    K: np.ndarray  #: (N, NU, NX)
    k: np.ndarray  #: (N, NU)
    x: np.ndarray  #: (N + 1, NX)
    u: np.ndarray  #: (N, NU)
    lam: np.ndarray  #: (rows of all stages,)
    below: np.ndarray
    above: np.ndarray
    p: np.ndarray  #: costates, (N + 1, NX)
    V: np.ndarray  #: Hessian and gradient of the cost to go, (N + 1, NX, NX)
    v: np.ndarray  #: (N + 1, NX)
    w: np.ndarray  #: v + V gap, (NX,)
    VA: np.ndarray  #: (NX, NX)
    VB: np.ndarray  #: (NX, NU)
    L: np.ndarray  #: (NU, NU)
    F: np.ndarray  #: (NU, NX)
    f: np.ndarray  #: (NU,)


@inlined
def roll(task, point):
    """The states that the inputs lead to from point.x[0]."""
    for i in range(len(point.u)):
        model.transition(point.x[i], point.u[i], task.theta, task.data[i], point.x[i + 1])


@inlined
def measure(task, point, mu):
    """Step 1: the objective and the barrier function of a plan."""
    x, u, h, last = point.x, point.u, point.h, len(point.u)
    objective = task.rate[last] * model.terminal_cost(x[last], task.theta, task.data[last])
    for i in range(last):
        objective += task.rate[i] * model.stage_cost(x[i], u[i], task.theta, task.data[i])
    for i in range(task.begin, last + 1):
        rows_of(task, x, u, i, h)
    for t in range(task.begin * task.rows, len(h)):
        h[t] = h[t] if task.planned[t] > 0.0 else -1.0
    centre(task, point, mu)
    return objective, objective + barrier(task, point, mu)


@inlined
def rows_of(task, x, u, i, h):
    """h of every row of a stage, planned or not."""
    t = task.rows * i
    model.measure_rows(x[i], u[min(i, len(u) - 1)], task.theta, task.data[i], h, t, task.lines)
    t += task.rows - len(task.sides)
    for j in range(len(task.sides)):
        h[t + j] = task.sides[j, 1] * (x[i, int(task.sides[j, 0])] - task.sides[j, 2])


@inlined
def centre(task, point, mu):
    """The sigma and slack that minimise each row's barrier while h = sigma - slack is given.

    With k = |h| W / mu they are mu / W times (2 + k + sqrt(k^2 + 4)) / 2 and its conjugate.
    """
    h, weights = point.h, task.weights
    for t in range(task.begin * task.rows, len(h)):
        unit = mu / weights[t]
        k = abs(h[t]) / unit
        twice = 2.0 + k + math.sqrt(k * k + 4.0)
        large, small = 0.5 * unit * twice, unit * twice / (twice - 2.0)
        point.sigma[t] = large if h[t] > 0.0 else small
        point.slack[t] = small if h[t] > 0.0 else large


@inlined
def barrier(task, point, mu):
    """The terms of rows and of the inputs' bounds in the barrier function."""
    u, sigma, slack = point.u, point.sigma, point.slack
    total, logs, product = 0.0, 0.0, 1.0
    for t in range(task.begin * task.rows, len(sigma)):
        total += task.weights[t] * sigma[t]
        unit = task.weights[t] / mu  # in such units a product cannot overflow
        product *= (unit * sigma[t]) * (unit * slack[t])
        if t % 8 == 7:  # one logarithm serves eight rows
            logs += math.log(product)
            product = 1.0
    logs += math.log(product)
    for i in range(task.first, len(u)):
        for a in range(NU):
            logs += math.log((u[i, a] - task.lower[a]) * (task.upper[a] - u[i, a]))
    return total - mu * logs


@inlined
def linearise(task, point, duals, stages, costates):
    """Step 2: derivatives of every stage, from the last to the first.

    The Lagrangian in the Hessian has the given costates, which may be `stages.p`.
    """
    x, u, p, last = point.x, point.u, stages.p, len(point.u)
    for t in range(task.begin * task.rows, len(point.h)):
        stages.held[t] = duals.lam[t] if task.planned[t] > 0.0 else 0.0
    clear(stages)
    for i in range(task.begin, last + 1):
        expand_rows(task, x, u, i, stages)
    model.expand_terminal(
        x[last], task.theta, task.data[last], task.rate[last:], stages.lx[last], stages.Q[last]
    )
    for a in range(NX):
        p[last, a] = stages.lx[last, a] + stages.px[last, a]
        stages.px[0, a] = 0.0  # x_0 is given
    for i in range(last - 1, -1, -1):
        model.expand_stage(
            x[i], u[i], task.theta, task.data[i], task.rate[i:], costates[i + 1],
            stages.A[i], stages.B[i], stages.lx[i], stages.lu[i],
            stages.Q[i], stages.S[i], stages.R[i],
        )  # fmt: skip
        for a in range(NX):
            total = stages.lx[i, a] + stages.px[i, a]
            for b in range(NX):
                total += stages.A[i, b, a] * p[i + 1, b]
            p[i, a] = total


@inlined
def clear(stages):
    """Zeros where the functions of `model` add."""
    stages.px[:] = 0.0
    stages.pu[:] = 0.0
    stages.Q[:] = 0.0
    stages.S[:] = 0.0
    stages.R[:] = 0.0


@inlined
def expand_rows(task, x, u, i, stages):
    """Gradients of a stage's rows, and the derivatives of held' h in the Lagrangian."""
    t, held = task.rows * i, stages.held
    model.expand_rows(
        x[i], u[min(i, len(u) - 1)], task.theta, task.data[i], held, stages.hx, stages.hu,
        stages.px[i], stages.pu[i], stages.Q[i], stages.S[i], stages.R[i], t, task.lines,
    )  # fmt: skip
    t += task.rows - len(task.sides)
    for j in range(len(task.sides)):
        stages.px[i, int(task.sides[j, 0])] += held[t + j] * task.sides[j, 1]


@inlined
def residuals(task, point, duals, stages, mu):
    """Step 3: Euclidean norms of KKT's violation, and the largest multiplier.

    Stationarity concerns the inputs; it holds in the states by construction. Complementarity is how
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
    lam, weights, sigma, slack = duals.lam, task.weights, point.sigma, point.slack
    for t in range(task.begin * task.rows, len(lam)):  # lam slack = mu = (W - lam) sigma
        low, high = lam[t] * slack[t] - mu, (weights[t] - lam[t]) * sigma[t] - mu
        if lam[t] >= ALMOST * weights[t]:
            high = 0.0
        complementarity += low * low + high * high
    return math.sqrt(stationarity), math.sqrt(complementarity), largest


@inlined
def input_gradient(stages, i, a):
    """The Lagrangian's derivative in input a of stage i, but for the bounds; before `condense`."""
    gradient = stages.lu[i, a] + stages.pu[i, a]
    for b in range(NX):
        gradient += stages.B[i, b, a] * stages.p[i + 1, b]
    return gradient


@inlined
def condense(task, point, duals, stages, mu):
    """Step 4: Newton's system without rows and bounds: q and r, and Q, S and R in place."""
    soften(task, point, duals, stages, mu)
    last = len(point.u)
    for i in range(task.first, last):
        for a in range(NU):
            low, high = 1.0 / (point.u[i, a] - task.lower[a]), 1.0 / (task.upper[a] - point.u[i, a])
            stages.lu[i, a] += mu * high - mu * low
            stages.R[i, a, a] += duals.below[i, a] * low + duals.above[i, a] * high
    begin_sides(stages)
    for i in range(task.begin, last + 1):
        fold(task, stages, i)


@inlined
def fold(task, stages, i):
    """Add pull' h of a stage's rows to q and r, and what is firm to the Hessian."""
    q, r, Q, S, R = stages.q[i], stages.r[i], stages.Q[i], stages.S[i], stages.R[i]
    firm, pull, t = stages.firm, stages.pull, task.rows * i
    model.condense_rows(firm, pull, stages.hx, stages.hu, q, r, Q, S, R, t, task.lines)
    t += task.rows - len(task.sides)
    for j in range(len(task.sides)):
        a = int(task.sides[j, 0])
        q[a] += pull[t + j] * task.sides[j, 1]
        Q[a, a] += firm[t + j]


@inlined
def soften(task, point, duals, stages, mu):
    """Eliminate the rows: Newton on lam slack = mu = (W - lam) sigma with h = sigma - slack."""
    lam, weights = duals.lam, task.weights
    for t in range(task.begin * task.rows, len(lam)):
        rest = weights[t] - lam[t]
        both = lam[t] * rest
        off = point.h[t] + mu * (rest - lam[t]) / both
        stiff = both / (point.slack[t] * rest + point.sigma[t] * lam[t])
        stages.off[t] = off
        stages.stiff[t] = stiff
        stages.firm[t] = stiff if task.planned[t] > 0.0 else 0.0
        stages.pull[t] = lam[t] + off * stiff if task.planned[t] > 0.0 else 0.0


@inlined
def begin_sides(stages):
    """q and r of the objective alone."""
    for i in range(len(stages.q)):
        for a in range(NX):
            stages.q[i, a] = stages.lx[i, a]
        for a in range(NU):
            stages.r[i, a] = stages.lu[i, a]


@inlined
def factorise(stages, delta, first, step):
    """Step 5: the Riccati recursion; false where Q_uu + delta I is not positive definite."""
    A, B, r, S, R = stages.A, stages.B, stages.r, stages.S, stages.R
    last = len(A)
    V, v, w, VA, VB = step.V, step.v, step.w, step.VA, step.VB
    L, F, f, gap = step.L, step.F, step.f, stages.gap
    for a in range(NX):
        v[last, a] = stages.q[last, a]
        for b in range(NX):
            V[last, a, b] = stages.Q[last, a, b]
    for i in range(last - 1, first - 1, -1):
        for a in range(NX):
            w[a] = v[i + 1, a]
            for b in range(NX):
                w[a] += V[i + 1, a, b] * gap[i + 1, b]
                VA[a, b] = 0.0
                for c in range(NX):
                    VA[a, b] += V[i + 1, a, c] * A[i, c, b]
            for b in range(NU):
                VB[a, b] = 0.0
                for c in range(NX):
                    VB[a, b] += V[i + 1, a, c] * B[i, c, b]
        for a in range(NU):
            f[a] = r[i, a]
            for c in range(NX):
                f[a] += B[i, c, a] * w[c]
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
            total = stages.q[i, a]
            for c in range(NX):
                total += A[i, c, a] * w[c]
            for c in range(NU):
                total += F[c, a] * step.k[i, c]
            v[i, a] = total
            for b in range(a + 1):
                total = stages.Q[i, a, b]
                for c in range(NX):
                    total += A[i, c, a] * VA[c, b]
                for c in range(NU):
                    total += F[c, a] * step.K[i, c, b]
                V[i, a, b] = total
                V[i, b, a] = total
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
def regularise(stages, first, step, least):
    """`factorise` with the first delta that will do: 0, or else from `least` on."""
    delta = 0.0
    while not factorise(stages, delta, first, step) and delta < DELTA_LARGEST:
        delta = DELTA_GROWS * delta if delta > 0.0 else least
    return delta


@inlined
def convex(stages, first, step, size):
    """`factorise` an LQ problem; where it is not convex, delta I is added to its Q and R."""
    added = 0.0
    while not factorise(stages, 0.0, first, step) and added < DELTA_LARGEST * size:
        more = max(CONVEX * size, DELTA_GROWS * added) - added
        added += more
        for i in range(len(stages.Q)):
            for a in range(NX):
                stages.Q[i, a, a] += more
            for a in range(NU):
                stages.R[i, a, a] += more


@inlined
def regulate(task, plan, stages, step, point):
    """Inputs for a model that falls over at rest: the plan of one LQ problem, held by its feedback.

    The problem is linearised with every stage at s, where the defects f(s, u) - s are gaps that the
    step closes; the model is then rolled out under u + k + K (x - s).
    """
    x, u, gap, last, size = plan.x, plan.u, stages.gap, len(plan.u), 0.0
    clear(stages)
    for i in range(last + 1):
        for a in range(NX):
            x[i, a] = point.x[0, a]
            stages.p[i, a] = 0.0
        for a in range(NU if i < last else 0):
            u[i, a] = point.u[i, a]
    model.expand_terminal(
        x[last], task.theta, task.data[last], task.rate[last:], stages.lx[last], stages.Q[last]
    )
    for i in range(last):
        model.expand_stage(
            x[i], u[i], task.theta, task.data[i], task.rate[i:], stages.p[i + 1],
            stages.A[i], stages.B[i], stages.lx[i], stages.lu[i],
            stages.Q[i], stages.S[i], stages.R[i],
        )  # fmt: skip
        model.transition(x[i], u[i], task.theta, task.data[i], gap[i + 1])
        for a in range(NX):
            gap[i + 1, a] -= x[i, a]
            size = max(size, abs(stages.Q[i, a, a]), abs(stages.Q[last, a, a]))
        for a in range(NU):
            size = max(size, abs(stages.R[i, a, a]))
    begin_sides(stages)
    convex(stages, task.first, step, size)
    gap[:] = 0.0
    follow(task, plan, step, 1.0, CAUTIOUS, point)


@inlined
def newton_step(task, point, duals, stages, mu, step):
    """Step 6: the step; the primal and the dual length that stay inside bounds; the descent."""
    sweep(task, stages, step)
    rows_along(task, stages, step)
    derivative = descent(task, point, stages, mu, step)
    scale_rows(task, stages, step)
    tau = max(TAU_MIN, 1.0 - max(mu, TAU_REST))
    primal, dual = bounds_along(task, point, duals, mu, step, tau)
    return primal, min(dual, inside_rows(task, duals, step, tau)), derivative


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
            total = stages.gap[i + 1, a]
            for b in range(NX):
                total += stages.A[i, a, b] * step.x[i, b]
            for b in range(NU):
                total += stages.B[i, a, b] * step.u[i, b]
            step.x[i + 1, a] = total


@inlined
def rows_along(task, stages, step):
    """dh of every row, in the place of its multiplier's step."""
    last, dh = len(step.u), step.lam
    for i in range(task.begin, last + 1):
        t = task.rows * i
        u = step.u[min(i, last - 1)]
        model.along_rows(stages.hx, stages.hu, step.x[i], u, dh, t, task.lines)
        t += task.rows - len(task.sides)
        for j in range(len(task.sides)):
            dh[t + j] = task.sides[j, 1] * step.x[i, int(task.sides[j, 0])]
    for t in range(task.begin * task.rows, len(dh)):
        dh[t] = dh[t] if task.planned[t] > 0.0 else 0.0


@inlined
def scale_rows(task, stages, step):
    """dlam of every row, in the place of dh."""
    for t in range(task.begin * task.rows, len(step.lam)):
        step.lam[t] = stages.stiff[t] * (stages.off[t] + step.lam[t])


@inlined
def inside_rows(task, duals, step, tau):
    """The largest step up to 1 that leaves every lam the share 1 - tau of its way to 0 or W."""
    lam, dlam, worst = duals.lam, step.lam, tau
    for t in range(task.begin * task.rows, len(lam)):
        ratio = abs(dlam[t]) / (lam[t] if dlam[t] < 0.0 else task.weights[t] - lam[t])
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
            du = step.u[i, a]
            low, high = point.u[i, a] - task.lower[a], task.upper[a] - point.u[i, a]
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
            total += stages.lu[i, a] * step.u[i, a]
    for t in range(task.begin * task.rows, len(step.lam)):
        total += mu / point.slack[t] * step.lam[t]
    return total


@inlined
def follow(task, plan, step, length, most, point):
    """Roll out u + length k + K (x - plan) from point.x[0].

    An input goes at most the part `most` of the way to its bounds.
    """
    for i in range(len(plan.u)):
        for a in range(NU):
            move = 0.0
            if i >= task.first:
                move = length * step.k[i, a]
                for b in range(NX):
                    move += step.K[i, a, b] * (point.x[i, b] - plan.x[i, b])
            low, high = plan.u[i, a] - task.lower[a], task.upper[a] - plan.u[i, a]
            point.u[i, a] = plan.u[i, a] + min(max(move, -most * low), most * high)
        model.transition(point.x[i], point.u[i], task.theta, task.data[i], point.x[i + 1])


@inlined
def search(task, point, trial, mu, step, length, total, derivative):
    """Step 7: find a `trial` that lowers the barrier function; objective, it and step, or nan."""
    while length > SHORTEST:
        follow(task, point, step, length, WITHIN, trial)
        objective, reached = measure(task, trial, mu)
        if reached <= total + ARMIJO * length * derivative + ROUNDING * abs(total):
            return objective, reached, length
        length *= BACKTRACKS
    return np.nan, np.nan, length


@inlined
def remember(stages, step, before, length):
    """Move the Hessian's costates along the step towards those of the linear-quadratic problem."""
    for i in range(1, len(step.v)):
        for a in range(NX):
            after = costate(step, i, a)
            step.p[i, a] = before[i, a] + length * (after - before[i, a])


@inlined
def costate(step, i, a):
    """p of the linear-quadratic problem after its step, i > 0."""
    p = step.v[i, a]
    for b in range(NX):
        p += step.V[i, a, b] * step.x[i, b]
    return p


@inlined
def advance(task, duals, step, length):
    """Move the multipliers along the step."""
    for i in range(len(duals.below)):
        for a in range(NU):
            duals.below[i, a] += length * step.below[i, a]
            duals.above[i, a] += length * step.above[i, a]
    for t in range(task.begin * task.rows, len(duals.lam)):
        most = ALMOST * task.weights[t]
        duals.lam[t] = min(duals.lam[t] + length * step.lam[t], most)


# Solutions are the vectors of `Ocp`: z has x_i, u_i and sigma_i of every stage, g the dynamics to
# x_{i+1} and the rows but the sides, and behind the first dynamics x_0 = s and u_0 = a. A solution
# is z, the multipliers of g, those of the bounds of z, and the gradient.


@inlined
def places(stages, lines, first):
    """Sizes of a stage in z and in g; where rows of stage 0, bounds and gradient are in a solution.

    Its u_0 is given where `first` is 1.
    """
    rows, slacks = FIXED + PER * lines, SOFT + PER * lines
    z, g = NX + NU + slacks, NX + rows
    size = stages * z - NU
    bounds = size + stages * g + first * NU
    return z, g, size + 2 * NX + first * NU, bounds, bounds + size


@inlined
def recall(task, start, solution, plan, old):
    """The plan and the multipliers of a warm start, from a stage later where that is shifted.

    The multiplier is -1 of a row that is not planned, and of every row at a cold start.
    """
    last, ahead, cold = len(plan.u), 1 if start == SHIFTED else 0, start in (COLD, HELD)
    first = 1 if len(solution) > places(last + 1, task.lines, 0)[4] else 0
    z_size, g_size, rows, bounds, _ = places(last + 1, task.lines, first)
    for i in range(last + 1):
        for a in range(NX):
            plan.x[i, a] = solution[min(i + ahead, last) * z_size + a]
        for j in range(task.rows):
            source, side = min(i + ahead, last), j - task.rows + len(task.sides)
            if task.kind[source, j] != PLANNED:
                source = i
            lam = -1.0
            if task.kind[source, j] == PLANNED and not cold:
                lam = solution[rows + source * g_size - (NX if source == last else 0) + j]
                if side >= 0:
                    nu = solution[bounds + source * z_size + int(task.sides[side, 0])]
                    lam = task.sides[side, 1] * nu
            old.lam[i * task.rows + j] = lam
    for i in range(last):
        z = min(i + ahead, last - 1) * z_size + NX
        for a in range(NU):
            plan.u[i, a] = solution[z + a]
            old.above[i, a] = 0.0 if cold else solution[bounds + z + a]
            old.below[i, a] = -old.above[i, a]


@inlined
def begin_inputs(task, point, state, action, start, inputs):
    """The inputs of a start, inside their bounds."""
    for a in range(NX):
        point.x[0, a] = state[a]
    for i in range(len(point.u)):
        for a in range(NU):
            low, high = task.lower[a], task.upper[a]
            push = PUSH[start] * min(1.0, high - low)
            point.u[i, a] = min(max(inputs[i, a], low + push), high - push)
            if i < task.first:
                point.u[i, a] = action[a]


@inlined
def strays(point, plan, ahead):
    """Whether the inputs of `point`, which `plan` receives, lead ever farther from its states."""
    last, apart, farthest, largest = len(point.u), 0.0, 0.0, 0.0
    for i in range(last + 1):
        for a in range(NX):
            largest = max(largest, abs(plan.x[i, a]))
            away = abs(point.x[i, a] - plan.x[i, a])
            if i == 0:
                apart = max(apart, away)
            if not away <= farthest and i + ahead <= last:
                farthest = away
        for a in range(NU if i < last else 0):
            plan.u[i, a] = point.u[i, a]
    return not farthest <= max(GROWS * apart, NOTICED * largest)


@merged
def task_of(theta, data, lower, upper, sides, kind, discount, weights, first):
    """The problem before `scale`."""
    count, rows = len(discount), len(weights) + len(sides)
    planned = (kind == PLANNED).astype(np.float64).reshape(-1)
    begin = 0 if (kind[0] == PLANNED).any() else 1
    lines = (data.shape[1] - OWN) // WIDTH if WIDTH > 0 else 0
    return Task(
        theta, data, lower, upper, sides, kind, planned, discount.copy(),
        np.empty(count * rows), first, begin, rows, lines,
    )  # fmt: skip


@inlined
def scale(task, point, weights, sizes):
    """Divide the problem by the size of its costs along the plan of a start, which is returned."""
    last, rate = len(point.u), task.rate
    factor = rate[last] * model.terminal_size(point.x[last], task.theta, task.data[last])
    for i in range(last):
        size = model.stage_size(point.x[i], point.u[i], task.theta, task.data[i])
        factor = max(factor, rate[i] * size)
    most = DEARER * factor
    model.size_rows(point.x[0], point.u[0], task.theta, task.data[0], sizes, 0, task.lines)
    for j in range(len(weights)):
        if weights[j] < np.inf:
            price = weights[j] * min(1.0, sizes[j])
            factor = max(factor, min(price / DEAREST, most))
    if not 0.0 < factor < np.inf:
        factor = 1.0
    strict = STRICT
    for j in range(len(weights)):
        if weights[j] < np.inf:
            strict = max(strict, STRICT_TO_SOFT * weights[j] / factor)
    for i in range(last + 1):
        rate[i] /= factor
        for j in range(task.rows):
            soft = j < len(weights) and weights[j] < np.inf
            task.weights[i * task.rows + j] = weights[j] * rate[i] if soft else strict
    return factor


@inlined
def begin_bounds(task, point, duals, old, mu, gain):
    """The bounds' multipliers: the warm start's, or central ones where these are larger."""
    for i in range(len(point.u)):
        for a in range(NU):
            below = mu / (point.u[i, a] - task.lower[a])
            above = mu / (task.upper[a] - point.u[i, a])
            free = i >= task.first
            duals.below[i, a] = max(gain * old.below[i, a], below) if free else 0.0
            duals.above[i, a] = max(gain * old.above[i, a], above) if free else 0.0


@inlined
def begin_rows(task, point, duals, old, mu, gain):
    """The rows' multipliers: central, or the warm start's unless these are nearer to 0 or W."""
    for t in range(task.begin * task.rows, len(duals.lam)):
        lam, weight = mu / point.slack[t], task.weights[t]
        if old.lam[t] >= 0.0:
            known = gain * old.lam[t]
            lam = max(known, lam) if point.h[t] < 0.0 else min(known, lam)
        duals.lam[t] = min(max(lam, INSIDE * weight), (1.0 - INSIDE) * weight)


@inlined
def recentre(task, point, duals, mu):
    """Multipliers that agree with the point: then Newton's step surely descends."""
    for i in range(len(point.u)):
        for a in range(NU):
            if i >= task.first:
                duals.below[i, a] = mu / (point.u[i, a] - task.lower[a])
                duals.above[i, a] = mu / (task.upper[a] - point.u[i, a])
    for t in range(task.begin * task.rows, len(duals.lam)):
        duals.lam[t] = min(mu / point.slack[t], ALMOST * task.weights[t])


@inlined
def iterate(task, point, trial, duals, stages, step, mu, objective, total, limit, tolerance):
    """Steps 2 to 7 until one of the ends: objective, iterations, end, error, delta and where.

    `where` is true if the last iterate stands in `trial`.
    """
    delta, iteration, polished, centred, ended, where = 0.0, 0, 0, False, LIMIT, False
    added, costates = 0.0, stages.p
    while True:
        linearise(task, point, duals, stages, costates)
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
            centre(task, point, mu)
            total = objective + barrier(task, point, mu)
        iteration += 1
        condense(task, point, duals, stages, mu)
        least = max(delta / DELTA_SHRINKS, DELTA_LEAST * largest)
        added = regularise(
            stages, task.first, step, least if delta > 0.0 else DELTA_FIRST * largest
        )
        delta = added if added > 0.0 else delta
        primal, dual, derivative = newton_step(task, point, duals, stages, mu, step)
        reached, reached_total, length = search(
            task, point, trial, mu, step, primal, total, derivative
        )
        if reached == reached:
            point, trial, where, centred = trial, point, not where, False
            objective, total = reached, reached_total
            advance(task, duals, step, dual)
            remember(stages, step, costates, length)
            costates = step.p
        elif centred:
            ended = SOLVED if error <= tolerance else STALLED
            break
        else:
            recentre(task, point, duals, mu)
            centred, costates = True, stages.p
    return objective, iteration, ended, error, added, where


@inlined
def settle(task, point, tie, h, size, held):
    """h of the rows of stage 0, and the multipliers of the soft ones that no plan can change."""
    x, u, theta, d = point.x[0], point.u[0], task.theta, task.data[0]
    rows_of(task, point.x, point.u, 0, h)
    model.size_rows(x, u, theta, d, size, 0, task.lines)
    for j in range(FIXED + PER * task.lines):
        if task.kind[0, j] == SETTLED:
            held[j] = task.weights[j] if h[j] > tie * size[j] else 0.0


@inlined
def write_solution(task, point, duals, stages, objective, factor, tie, out):
    """Write the solution in the order of `Ocp`, and the value's gradient: the kernel's Lagrangian.

    Returns the value, the largest violation of a hard row and the largest number in the plan.
    """
    last, held, h, sides = len(point.u), stages.held, point.h, FIXED + PER * task.lines
    z_size, g_size, rows, bounds, end = places(last + 1, task.lines, task.first)
    violation, largest = 0.0, 0.0
    settle(task, point, tie, h, stages.firm, held)
    value = factor * objective + model.initial_cost(point.x[0], task.theta, task.data[0])
    gradient = out[end:]
    gradient[:] = 0.0
    for i in range(last + 1):
        z, g = i * z_size, rows + i * g_size - (NX if i == last else 0)
        u, rate, data = point.u[min(i, last - 1)], task.rate[i:], task.data[i]
        for a in range(NX):
            out[z + a] = point.x[i, a]
            out[bounds + z + a] = 0.0
            largest = max(largest, abs(point.x[i, a]))
        if i < last:
            model.stage_theta(point.x[i], u, task.theta, data, rate, stages.p[i + 1], gradient)
            after = g - NX if i > 0 else g - 2 * NX - task.first * NU
            for a in range(NX):
                out[after + a] = -factor * stages.p[i + 1, a]
            for a in range(NU):
                out[z + NX + a] = u[a]
                out[bounds + z + NX + a] = factor * (duals.above[i, a] - duals.below[i, a])
        else:
            model.terminal_theta(point.x[i], task.theta, data, rate, gradient)
        model.theta_rows(point.x[i], u, task.theta, data, held, gradient, i * task.rows, task.lines)
        if i == 0:
            for a in range(NX):
                out[g - NX - task.first * NU + a] = -factor * stages.p[0, a]
            for a in range(task.first * NU):
                out[g - NU + a] = -factor * input_gradient(stages, 0, a)
        sigma = z + NX + (NU if i < last else 0)
        for j in range(task.rows):
            t = i * task.rows + j
            beyond = max(0.0, h[t]) if task.kind[i, j] in (PLANNED, SETTLED) else 0.0
            price = factor * held[t]
            if j >= sides:
                out[bounds + z + int(task.sides[j - sides, 0])] += task.sides[j - sides, 1] * price
            else:
                out[g + j] = price
            if j >= sides or SOFT <= j < FIXED:
                violation = max(violation, beyond)
                continue
            weight, k = factor * task.weights[t], sigma + (j if j < SOFT else SOFT + j - FIXED)
            value += weight * beyond
            out[k] = beyond
            out[bounds + k] = price - weight
    for a in range(NTHETA):
        gradient[a] *= factor
    model.initial_theta(point.x[0], task.theta, task.data[0], gradient)
    return value, violation, largest


@allocating
def allocate_point(N, every):
    """Space for an iterate."""
    return Point(
        np.empty((N + 1, NX)), np.empty((N, NU)), np.empty(every), np.empty(every), np.empty(every)
    )


@merged
def allocate(N, rows):
    """Space for an iterate, another, multipliers twice, derivatives and a step."""
    n, every = N + 1, (N + 1) * rows
    duals = Duals(np.empty(every), np.empty((N, NU)), np.empty((N, NU)))
    old = Duals(np.empty(every), np.empty((N, NU)), np.empty((N, NU)))
    stages = Stages(  # what is written at its nonzeros begins as zeros
        np.zeros((N, NX, NX)), np.zeros((N, NX, NU)),
        np.zeros((every, NX)), np.zeros((every, NU)),
        np.empty((n, NX)), np.empty((n, NU)), np.empty((n, NX)), np.empty((n, NU)),
        np.empty((n, NX)), np.zeros((n, NX)),
        np.empty((n, NX, NX)), np.empty((n, NU, NX)), np.empty((n, NU, NU)),
        np.empty((n, NX)), np.empty((n, NU)),
        np.empty(every), np.empty(every), np.zeros(every), np.empty(every), np.empty(every),
    )  # fmt: skip
    step = Step(
        np.empty((N, NU, NX)), np.empty((N, NU)), np.empty((n, NX)), np.empty((N, NU)),
        np.empty(every), np.empty((N, NU)), np.empty((N, NU)),
        np.empty((n, NX)), np.empty((n, NX, NX)), np.empty((n, NX)),
        np.empty(NX), np.empty((NX, NX)), np.empty((NX, NU)),
        np.empty((NU, NU)), np.empty((NU, NX)), np.empty(NU),
    )  # fmt: skip
    return allocate_point(N, every), allocate_point(N, every), duals, old, stages, step


@merged
def solve(
    data, lower, upper, sides, kind, discount, weights, tie, state, theta, action, fixed,
    start, limit, tolerance, inputs, warm_start, out,
):  # fmt: skip
    """Solve a problem from one start; see `riccati.Arguments` for the first arguments.

    Returns value, iterations, the end, the violation of hard rows, and the relative error; `out`
    receives z, lam and nu in the order of `Ocp`, as `warm_start` has them, and then the gradient.
    A cold start takes `inputs`, (N, NU), and a warm one `warm_start`. A plan with a state beyond
    `ABSURD` is none: its value is infinite.
    """
    task = task_of(theta, data, lower, upper, sides, kind, discount, weights, fixed)
    point, trial, duals, old, stages, step = allocate(len(discount) - 1, task.rows)
    mu, cold, ahead = START_MU[start], start in (COLD, HELD), 1 if start == SHIFTED else 0
    recall(task, start, warm_start, trial, old)
    begin_inputs(task, point, state, action, start, inputs if cold else trial.u)
    if start == HELD:
        regulate(task, trial, stages, step, point)
    else:
        roll(task, point)
    factor = scale(task, point, weights, stages.firm)
    gain = task.rate[0] / task.rate[ahead] / factor
    begin_bounds(task, point, duals, old, mu, gain)
    if not cold and strays(point, trial, ahead):
        measure(task, trial, mu)
        begin_rows(task, trial, duals, old, mu, gain)
        linearise(task, trial, duals, stages, stages.p)
        condense(task, trial, duals, stages, mu)
        regularise(stages, task.first, step, DELTA_FIRST)
        follow(task, trial, step, 0.0, WITHIN, point)
    for a in range(NX):
        trial.x[0, a] = state[a]
    objective, total = measure(task, point, mu)
    begin_rows(task, point, duals, old, mu, gain)
    objective, iterations, ended, error, added, where = iterate(
        task, point, trial, duals, stages, step, mu, objective, total, limit, tolerance
    )
    if where:
        point, trial = trial, point
    if ended == SOLVED and (cold or added > 0.0):  # no plan at a maximum or saddle is a solution
        condense(task, point, duals, stages, RIGID)
        if not factorise(stages, FLAT, task.first, step):
            ended = SADDLE
    value, violation, largest = write_solution(
        task, point, duals, stages, objective, factor, tie, out
    )
    if not largest <= ABSURD:
        value = np.inf
    return value, float(iterations), float(ended), violation, error


vector, matrix, tensor = float64[::1], float64[:, ::1], float64[:, :, ::1]
PROBLEM = (
    matrix, vector, vector, matrix, int64[:, ::1], vector, vector, float64,  # see `Arguments`
    vector, vector, vector, int64,  # state, theta, action, whether u_0 is the action
)  # fmt: skip

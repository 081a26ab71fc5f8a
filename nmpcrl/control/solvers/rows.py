"""The stages of a `Problem` for `kernel`: rows that may depend on the input, theta everywhere.

A row of a stage is *planned* where the plan can change it, *settled* at stage 0 where it cannot,
and absent elsewhere. What is not planned stands in the barrier as h = -1 and counts for nothing.
What is defined here takes the place of the functions of the same names in `kernel`, whose loop,
algebra of the barrier and Riccati recursion remain.
"""

from typing import NamedTuple

import numpy as np
from numba import float64, int64

from . import kernel
from .expressions import (
    NROWS,
    expand_last,
    expand_stage,
    initial_cost,
    initial_gradient,
    last_gradient,
    last_rows,
    path_rows,
    row_sizes,
    stage_cost,
    stage_gradient,
    steepest,
    terminal_cost,
    transition,
)
from .kernel import (
    ARMIJO,
    BACKTRACKS,
    COLD,
    INSIDE,
    ROUNDING,
    SHIFTED,
    SHORTEST,
    TAU_REST,
    Duals,
    Point,
    Step,
    add,
    barrier,
    centre,
    inlined,
    input_gradient,
    matrix,
    offsets,
    soften,
    vector,
)
from .model import NTHETA, NU, NX

PLANNED, SETTLED = 1, 2  # else absent
ABSURD = 1e9  # no plan goes through such a state
STEEP = 100.0  # slope of a stage at s beyond which it is scaled down to this, as by Ipopt
GROWS = 30.0  # times a deviation that a plan is left by before feedback has to hold it
SMALL = 1e-6  # deviation of which that is read
WITHIN = 1.0 - TAU_REST  # the most of its way to a bound that an input may go along the feedback


class Task(NamedTuple):
    """The problem of one solve, scaled."""

    theta: np.ndarray  # (NTHETA,)
    data: np.ndarray  # (N + 1, size)
    lower: np.ndarray  # of an input, (NU,)
    upper: np.ndarray  # (NU,)
    kind: np.ndarray  # of each row at each stage, (N + 1, NROWS)
    rate: np.ndarray  # scaled gamma^i, (N + 1,)
    weights: np.ndarray  # W, (N + 1, NROWS)
    first: int  # the first stage with a free input: 1 if u_0 is given, else 0
    held: np.ndarray  # (1,): whether the model grows, so that feedback has to hold it to a plan


class Stages(NamedTuple):
    """Derivatives at an iterate, and their condensed form."""

    A: np.ndarray  # d x+ / d x, (N, NX, NX)
    B: np.ndarray  # d x+ / d u, (N, NX, NU)
    hx: np.ndarray  # gradients of the rows, (N + 1, NROWS, NX)
    hu: np.ndarray  # (N + 1, NROWS, NU)
    lx: np.ndarray  # of the objective, (N + 1, NX)
    cu: np.ndarray  # (N, NU)
    lu: np.ndarray  # of the objective and lam' h, (N, NU)
    p: np.ndarray  # costates, (N + 1, NX)
    Q: np.ndarray  # Hessian of the Lagrangian, (N + 1, NX, NX)
    S: np.ndarray  # (N, NU, NX)
    R: np.ndarray  # (N, NU, NU)
    q: np.ndarray  # Newton's right-hand side, (N + 1, NX)
    r: np.ndarray  # (N, NU)
    off: np.ndarray  # dlam = stiff (off + dh), (N + 1, NROWS)
    stiff: np.ndarray


@inlined
def evaluate(task, point, mu):
    """Step 1 for point.x[0] and point.u; the objective and the barrier function."""
    for i in range(len(point.u)):
        transition(point.x[i], point.u[i], task.theta, task.data[i], point.x[i + 1])
    return measure(task, point, mu)


@inlined
def measure(task, point, mu):
    """The objective and the barrier function of a plan that is rolled out."""
    x, u, h, last = point.x, point.u, point.h, len(point.u)
    objective = 0.0
    for i in range(last):
        path_rows(x[i], u[i], task.theta, task.data[i], h[i])
        objective += task.rate[i] * stage_cost(x[i], u[i], task.theta, task.data[i])
    last_rows(x[last], task.theta, task.data[last], h[last])
    objective += task.rate[last] * terminal_cost(x[last], task.theta, task.data[last])
    for i in range(last + 1):
        for j in range(NROWS):
            if task.kind[i, j] != PLANNED:
                h[i, j] = -1.0
    centre(h.ravel(), task.weights.ravel(), mu, point.sigma.ravel(), point.slack.ravel())
    return objective, objective + barrier(task, point, mu)


@inlined
def hold(task, duals, i, held):
    """The multipliers of the planned rows of a stage."""
    for j in range(NROWS):
        held[j] = duals.lam[i, j] if task.kind[i, j] == PLANNED else 0.0


@inlined
def linearise(task, point, duals, stages):
    """Step 2: derivatives of every stage, from the last to the first."""
    x, u, p, last = point.x, point.u, stages.p, len(point.u)
    held = np.empty(NROWS)
    for i in range(last, -1, -1):
        rate, hx, hu = task.rate[i : i + 1], stages.hx[i], stages.hu[i]
        hold(task, duals, i, held)
        if i == last:
            expand_last(x[i], task.theta, task.data[i], rate, held, stages.lx[i], stages.Q[i], hx)
        else:
            expand_stage(
                x[i], u[i], task.theta, task.data[i], rate, p[i + 1], held,
                stages.A[i], stages.B[i], stages.lx[i], stages.cu[i],
                stages.Q[i], stages.S[i], stages.R[i], hx, hu,
            )  # fmt: skip
        for j in range(NROWS):
            if task.kind[i, j] != PLANNED or i == 0:  # x_0 is given
                for a in range(NX):
                    hx[j, a] = 0.0
            if task.kind[i, j] != PLANNED or i == last:
                for a in range(NU):
                    hu[j, a] = 0.0
        for a in range(NX):
            p[i, a] = stages.lx[i, a]
            for j in range(NROWS):
                p[i, a] += held[j] * hx[j, a]
        if i < last:
            for a in range(NX):
                for b in range(NX):
                    p[i, a] += stages.A[i, b, a] * p[i + 1, b]
            for a in range(NU):
                stages.lu[i, a] = stages.cu[i, a]
                for j in range(NROWS):
                    stages.lu[i, a] += held[j] * hu[j, a]


@inlined
def condense(task, point, duals, stages, mu):
    """Step 4: Newton's system without rows and bounds: q and r, and Q, S and R in place."""
    soften(
        point.h.ravel(), point.sigma.ravel(), point.slack.ravel(), duals.lam.ravel(),
        task.weights.ravel(), mu, stages.off.ravel(), stages.stiff.ravel(),
    )  # fmt: skip
    last = len(point.u)
    for i in range(last + 1):
        hx, hu = stages.hx[i], stages.hu[i]
        for a in range(NX):
            stages.q[i, a] = stages.lx[i, a]
        if i < last:
            for a in range(NU):
                stages.r[i, a] = stages.cu[i, a]
        for j in range(NROWS):
            stiff = stages.stiff[i, j]
            pull = duals.lam[i, j] + stages.off[i, j] * stiff
            for a in range(NX):
                stages.q[i, a] += pull * hx[j, a]
                for b in range(NX):
                    stages.Q[i, a, b] += stiff * hx[j, a] * hx[j, b]
            if i < last:
                for a in range(NU):
                    stages.r[i, a] += pull * hu[j, a]
                    for b in range(NX):
                        stages.S[i, a, b] += stiff * hu[j, a] * hx[j, b]
                    for b in range(NU):
                        stages.R[i, a, b] += stiff * hu[j, a] * hu[j, b]
    for i in range(task.first, last):
        for a in range(NU):
            low, high = 1.0 / (point.u[i, a] - task.lower[a]), 1.0 / (task.upper[a] - point.u[i, a])
            stages.r[i, a] += mu * high - mu * low
            stages.R[i, a, a] += duals.below[i, a] * low + duals.above[i, a] * high


@inlined
def rows_along(task, stages, step):
    """dh of every row, in the place of its multiplier's step."""
    last = len(step.u)
    for i in range(last + 1):
        for j in range(NROWS):
            total = 0.0
            for a in range(NX):
                total += stages.hx[i, j, a] * step.x[i, a]
            if i < last:
                for a in range(NU):
                    total += stages.hu[i, j, a] * step.u[i, a]
            step.lam[i, j] = total


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
    for i in range(len(step.lam)):
        for j in range(NROWS):
            total += mu / point.slack[i, j] * step.lam[i, j]
    return total


@inlined
def follow(task, plan, step, length, point):
    """Roll out u + length k + K dx from point.x[0]: the feedback holds a model to the plan.

    Source: Tassa, Mansard and Todorov (2014), there with bounds; here inputs stay inside them.
    """
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
    """Step 7; a model that grows is rolled out along the feedback, and not the inputs alone."""
    while length > SHORTEST:
        if task.held[0]:
            follow(task, point, step, length, trial)
            objective, reached = measure(task, trial, mu)
        else:
            for i in range(len(step.u)):
                for a in range(NU):
                    trial.u[i, a] = point.u[i, a] + length * step.u[i, a]
            objective, reached = evaluate(task, trial, mu)
        if reached <= total + ARMIJO * length * derivative + ROUNDING * abs(total):
            return objective, reached
        length *= BACKTRACKS
    return np.nan, np.nan


@inlined
def recall(task, start, warm_start, inputs, plan):
    """The states of a warm start, a stage later where it is shifted; its inputs are given."""
    last = len(inputs)
    for i in range(last + 1):
        at = offsets(task, min(i + (1 if start == SHIFTED else 0), last))[0]
        for a in range(NX):
            plan.x[i, a] = warm_start[at + a]
        for a in range(NU if i < last else 0):
            plan.u[i, a] = inputs[i, a]


@inlined
def grows(task, plan):
    """Whether a deviation of the first state becomes `GROWS` times as large along a plan."""
    moved, there, after = np.empty(NX), np.empty(NX), np.empty(NX)
    for b in range(NX):
        for a in range(NX):
            after[a] = SMALL if a == b else 0.0
        for i in range(len(plan.u)):
            for a in range(NX):
                moved[a] = plan.x[i, a] + after[a]
            transition(plan.x[i], plan.u[i], task.theta, task.data[i], there)
            transition(moved, plan.u[i], task.theta, task.data[i], after)
            for a in range(NX):
                after[a] -= there[a]
                if not abs(after[a]) <= GROWS * SMALL:
                    return True
    return False


@inlined
def scaled(theta, data, lower, upper, kind, discount, weights, factor, first, state):
    """The problem divided by a factor, and that: more than asked for where costs are steep at s."""
    still = np.empty(NU)
    for a in range(NU):
        still[a] = min(max(0.0, lower[a]), upper[a])
    slope = steepest(state, still, theta, data[0]) / STEEP
    factor = slope if factor < slope < np.inf else factor
    rate = np.empty(len(discount))
    scaled_weights = np.empty((len(discount), NROWS))
    for i in range(len(discount)):
        rate[i] = discount[i] / factor
        for j in range(NROWS):
            scaled_weights[i, j] = weights[j] * rate[i]
    held = np.zeros(1, np.int64)
    return Task(theta, data, lower, upper, kind, rate, scaled_weights, first, held), factor


@inlined
def slacks_of(task):
    """The number of slacks of a stage."""
    return NROWS


@inlined
def place_of_rows(task, stage, last):
    """Where the rows of a stage begin among the constraints of `Ocp`."""
    constraints = offsets(task, stage)[1] + (NX if stage < last else 0)
    return constraints + (NX + task.first * NU if stage == 0 else 0)


@inlined
def initialise_rows(task, point, duals, start, mu, factor, warm_start):
    """The rows' multipliers: central, or the warm start's unless these are nearer to 0 or W."""
    last = len(point.u)
    ahead = 1 if start == SHIFTED else 0
    gain = task.rate[0] / task.rate[ahead] / factor
    lam = offsets(task, last)[0] + NX + NROWS
    for i in range(last + 1):
        for j in range(NROWS):
            source = min(i + ahead, last)
            if task.kind[source, j] != PLANNED:
                source = i
            middle = mu / point.slack[i, j]
            if start != COLD and task.kind[source, j] == PLANNED:
                old = gain * warm_start[lam + place_of_rows(task, source, last) + j]
                middle = max(old, middle) if point.h[i, j] < 0.0 else min(old, middle)
            weight = task.weights[i, j]
            duals.lam[i, j] = min(max(middle, INSIDE * weight), (1.0 - INSIDE) * weight)


@inlined
def settle(task, point, tie, h, held):
    """h of the rows of stage 0, and the multipliers of those that no plan can change."""
    size = np.empty(NROWS)
    path_rows(point.x[0], point.u[0], task.theta, task.data[0], h)
    row_sizes(point.x[0], point.u[0], task.theta, task.data[0], size)
    for j in range(NROWS):
        if task.kind[0, j] == SETTLED:
            held[j] = task.weights[0, j] if h[j] > tie * size[j] else 0.0


@inlined
def write_solution(task, point, duals, stages, objective, factor, tie, out):
    """Write the solution in the order of `Ocp`, and the value's gradient: the kernel's Lagrangian.

    Returns the value and the largest number in the plan.
    """
    last = len(point.u)
    variables = offsets(task, last)[0] + NX + NROWS
    nu = variables + offsets(task, last)[1] + NROWS
    phi = nu + variables
    largest = 0.0
    gradient, held, h = np.empty(NTHETA), np.empty(NROWS), np.empty(NROWS)
    initial_gradient(point.x[0], task.theta, task.data[0], gradient)
    for a in range(NTHETA):
        out[phi + a] = gradient[a]
    value = factor * objective + initial_cost(point.x[0], task.theta, task.data[0])
    for i in range(last + 1):
        at, row = offsets(task, i)
        hold(task, duals, i, held)
        for j in range(NROWS):
            h[j] = point.h[i, j]
        if i == 0:
            settle(task, point, tie, h, held)
        for a in range(NX):
            out[at + a] = point.x[i, a]
            out[nu + at + a] = 0.0
            largest = max(largest, abs(point.x[i, a]))
        rate, data = task.rate[i : i + 1], task.data[i]
        if i < last:
            u, p = point.u[i], stages.p[i + 1]
            stage_gradient(point.x[i], u, task.theta, data, rate, p, held, gradient)
            for a in range(NX):
                out[variables + row + a] = -factor * p[a]
            for a in range(NU):
                out[at + NX + a] = u[a]
                out[nu + at + NX + a] = factor * (duals.above[i, a] - duals.below[i, a])
        else:
            last_gradient(point.x[i], task.theta, data, rate, held, gradient)
        add(out, phi, factor, gradient)
        if i == 0:
            row = variables + NX  # behind the dynamics
            for a in range(NX):
                out[row + a] = -factor * stages.p[0, a]
            for a in range(task.first * NU):
                out[row + NX + a] = -factor * input_gradient(stages, 0, a)
        row = variables + place_of_rows(task, i, last)
        at += NX + (NU if i < last else 0)
        for j in range(NROWS):
            weight = factor * task.weights[i, j]
            beyond = max(0.0, h[j]) if task.kind[i, j] > 0 else 0.0
            value += weight * beyond
            out[at + j] = beyond
            out[row + j] = factor * held[j]
            out[nu + at + j] = factor * held[j] - weight
    return value, largest


@inlined
def allocate(N):
    """Space for an iterate, a trial of the next one, multipliers, derivatives and a step."""
    point = Point(
        np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N + 1, NROWS)), np.empty((N + 1, NROWS)), np.empty((N + 1, NROWS)),
    )  # fmt: skip
    trial = Point(
        np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N + 1, NROWS)), np.empty((N + 1, NROWS)), np.empty((N + 1, NROWS)),
    )  # fmt: skip
    duals = Duals(np.empty((N + 1, NROWS)), np.empty((N, NU)), np.empty((N, NU)))
    stages = Stages(
        np.empty((N, NX, NX)), np.empty((N, NX, NU)),
        np.empty((N + 1, NROWS, NX)), np.empty((N + 1, NROWS, NU)),
        np.empty((N + 1, NX)), np.empty((N, NU)), np.empty((N, NU)), np.empty((N + 1, NX)),
        np.empty((N + 1, NX, NX)), np.empty((N, NU, NX)), np.empty((N, NU, NU)),
        np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N + 1, NROWS)), np.empty((N + 1, NROWS)),
    )  # fmt: skip
    step = Step(
        np.empty((N, NU, NX)), np.empty((N, NU)), np.empty((N + 1, NX)), np.empty((N, NU)),
        np.empty((N + 1, NROWS)), np.empty((N, NU)), np.empty((N, NU)),
    )  # fmt: skip
    return point, trial, duals, stages, step


for replaced in (
    evaluate, linearise, condense, rows_along, descent, search, slacks_of,
):  # fmt: skip
    setattr(kernel, replaced.__name__, replaced)  # before any of them is compiled

PROBLEM = (
    matrix, vector, vector, int64[:, ::1], vector, vector, float64, float64,  # see InteriorPoint
    vector, vector, vector, int64,  # state, theta, action, whether u_0 is the action
)  # fmt: skip

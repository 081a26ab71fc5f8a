"""The second derivative of the value of Eq. (2) in theta, times a vector, at a solution.

If theta moves along a direction w, the solution moves along (dx, du, dlam), which solves Newton's
system of `kernel` with another right-hand side: instead of KKT's violation, what w adds to it.

1. `linearise` and `condense` as there, with a barrier parameter so small that an active row or
   bound is all but rigid and any other is all but free;
2. `right_hand_side`: the Lagrangian's mixed derivatives in (x, u) and theta, along w, as q and r;
3. `factorise` and `sweep` as there;
4. `gradient_along`: the derivative of the gradient phi along (dx, du, dlam, w) is the product.

Source: the implicit function theorem at a solution of KKT, Nocedal and Wright (2006), Section 12.
"""

import numpy as np

from .kernel import add, inlined
from .model import (
    NTHETA,
    NU,
    NX,
    constraint,
    constraint_gradient,
    constraint_gradient_along,
    constraint_mixed_hessian,
    stage_gradient_along,
    stage_mixed_hessian,
    terminal_gradient_along,
    terminal_mixed_hessian,
)


@inlined
def right_hand_side(task, point, duals, stages, w):
    """Newton's right-hand side where theta moves along w: q, r and `off`, after `condense`."""
    q, obstacles, last = stages.q, len(task.discs), len(point.u)
    gradient, hx = np.empty(NTHETA), np.empty(NX)
    for i in range(last + 1):
        rate = task.rate[i]
        if i < last:
            stage_mixed_hessian(
                point.x[i], point.u[i], task.theta, task.target, w, q[i], stages.r[i]
            )
            for a in range(NU):
                stages.r[i, a] *= rate
        else:
            terminal_mixed_hessian(point.x[i], task.theta, task.target, w, q[i])
        for a in range(NX):
            q[i, a] *= rate
        if i == 0:
            continue
        for j in range(obstacles):
            constraint_gradient(point.x[i], task.theta, task.discs[j], gradient)
            constraint_mixed_hessian(point.x[i], task.theta, task.discs[j], w, hx)
            off = 0.0
            for a in range(NTHETA):
                off += gradient[a] * w[a]
            stages.off[i - 1, j] = off
            pull = stages.stiff[i - 1, j] * off
            for a in range(NX):
                q[i, a] += duals.lam[i - 1, j] * hx[a] + pull * stages.hx[i - 1, j, a]
        for j in range(len(task.sides)):
            stages.off[i - 1, obstacles + j] = 0.0


@inlined
def gradient_along(task, point, duals, step, slack_weight, factor, tie, w, out):
    """The derivative of phi along the step and w."""
    obstacles, last = len(task.discs), len(point.u)
    gradient = np.empty(NTHETA)
    for a in range(NTHETA):
        out[a] = 0.0
    for i in range(last + 1):
        rate, x, dx = factor * task.rate[i], point.x[i], step.x[i]
        if i < last:
            stage_gradient_along(x, point.u[i], task.theta, task.target, dx, step.u[i], w, gradient)
        else:
            terminal_gradient_along(x, task.theta, task.target, dx, w, gradient)
        add(out, 0, rate, gradient)
        for j in range(obstacles):
            if i > 0:
                multiplier, change = factor * duals.lam[i - 1, j], factor * step.lam[i - 1, j]
            else:
                inside = constraint(x, task.theta, task.discs[j]) > tie
                multiplier, change = (rate * slack_weight if inside else 0.0), 0.0
            constraint_gradient(x, task.theta, task.discs[j], gradient)
            add(out, 0, change, gradient)
            constraint_gradient_along(x, task.theta, task.discs[j], dx, w, gradient)
            add(out, 0, multiplier, gradient)

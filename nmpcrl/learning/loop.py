"""Algorithm 1 for the learners that are built in, an episode at a time, as numba compiles it.

`episode` compiles this file beside `updates`, once for all plants: `find`, `slopes`, the plant and
its cost are arguments. For WebAssembly the same text is compiled with the functions of one plant.
"""

from types import FunctionType

import numpy as np
from numba import float64, int64, njit, types

from nmpcrl.control.solvers.codes import End, Start

from .updates import (
    auxiliary_step,
    curvature_correction,
    dot,
    gradient_td_step,
    project,
    semi_gradient_step,
    td_error,
)

COLD, SHIFTED, _, SAME = map(int, Start)
SOLVED = int(End.SOLVED)
ABSURD = 1e24  # no value is larger
NUMBERS = (  # that a row of an episode begins with; state, action, features, theta and w follow
    "cost", "value", "next_value", "delta", "loss", "restarts", "violation", "iterations", "solves",
)  # fmt: skip
COUNT = len(NUMBERS)

plain = njit(error_model="numpy")
vector, matrix, tensor = float64[::1], float64[:, ::1], float64[:, :, ::1]
given = types.Array(float64, 1, "C", readonly=True)
PROBLEM = (matrix, vector, vector, matrix, int64[:, ::1], vector, vector, float64)  # `Arguments`
FIND = types.UniTuple(float64, 6)(
    *PROBLEM, vector, vector, vector, int64, tensor, tensor, int64, float64, vector, vector
)
SLOPES = types.boolean(
    *PROBLEM, vector, vector, vector, int64, vector, vector, matrix, matrix, vector
)
TRANSITION = types.void(given, given, vector)
CHARGE = float64(given, given)


SEMI_GRADIENT, GRADIENT_TD, EXACT = range(3)  # rules
flag = types.boolean
SIGNATURE = int64(
    *map(types.FunctionType, (FIND, SLOPES, TRANSITION, CHARGE)),
    *PROBLEM[:5], int64[:, ::1], *PROBLEM[5:], tensor, tensor, float64,
    int64, float64, float64,
    int64, float64, float64, vector, vector, flag, flag, flag,
    int64, int64, vector, vector, vector, vector, matrix, matrix,
)  # fmt: skip


def translated(function, **called):
    """A function of `updates` for numba, which takes no argument behind a star.

    `called` are compiled functions in the place of those that it calls.
    """
    code = function.__code__
    count = code.co_argcount + code.co_kwonlyargcount
    code = code.replace(co_argcount=count, co_kwonlyargcount=0)
    return plain(FunctionType(code, function.__globals__ | called, function.__name__))


_dot = translated(dot)
_td_error = translated(td_error)
_project = translated(project)
_semi_gradient_step = translated(semi_gradient_step)
_gradient_td_step = translated(gradient_td_step, dot=_dot)
_auxiliary_step = translated(auxiliary_step, dot=_dot)
_curvature_correction = translated(curvature_correction, dot=_dot)


@plain
def usable(numbers, largest):
    """Whether every number is finite and of size at most `largest`."""
    for k in range(len(numbers)):  # noqa: SIM110  numba compiles no generators
        if not abs(numbers[k]) <= largest:
            return False
    return True


@plain
def start_in(state, warm):
    """How a solve in `state` begins from a solution, whose numbers begin with its own state."""
    for k in range(len(state)):
        if state[k] != warm[k]:
            return SHIFTED
    return SAME


@plain
def carried(old, place, count, new):
    """Copy a solution, with `count` more multipliers at `place`, or -`count` of them left out."""
    new[:place] = old[:place]
    if count > 0:
        new[place : place + count] = 0.0
        new[place + count :] = old[place:]
    else:
        new[place:] = old[place - count :]


@njit(SLOPES, cache=True, error_model="numpy")
def no_slopes(
    data, lower, upper, sides, kind, discount, weights, tie,
    state, theta, action, fixed, solved, w, of_states, of_inputs, out,
):  # fmt: skip
    """For learners other than `EXACT`, which need no derivatives compiled."""
    return False


def episode(
    find, slopes, transition, charge,
    data, lower, upper, sides, kind, kind_fixed, discount, weights, tie, others, drawn, tolerance,
    place, farthest, largest,
    rule, alpha, beta, least, most, second, constrained, clipped,
    start, first, state, theta, w, warm, noise, rows,
):  # fmt: skip
    """The steps first, first + 1, ... of an episode, as `train` makes them.

    Args:
        find: of the plant's solver, for V(s) and Q(s, a).
        slopes: its derivatives, which `EXACT` calls.
        transition: x, u -> x+ of the environment.
        charge: x, u -> its cost.
        data: of a plan; from here to `tie` as in `riccati.Arguments`.
        kind_fixed: `kind` where u_0 is fixed.
        others: cold starts, as in `find`; `drawn` and `tolerance` likewise.
        place: where the multipliers of a fixed u_0 begin in a solution.
        farthest: the largest number of a state in which a plan may begin.
        largest: the largest number of theta and w.
        rule: `SEMI_GRADIENT`, `GRADIENT_TD` or `EXACT`.
        alpha: step size of theta.
        beta: step size of w.
        least: bounds of theta, (d,), as is `most`.
        second: whether a second solve values the next state; else nothing is learned.
        constrained: whether Q(s, a) is learned.
        clipped: whether actions are kept between `lower` and `upper`.
        start: the `Start` of the first solve.
        first: the first step.
        state: where it begins, (n,); this and the next three are left as the last step left them.
        theta: parameters, (d,).
        w: auxiliary weights, (d,).
        warm: z, lam and nu of the solution that the first solve begins with, u_0 being free.
        noise: of every step, scaled, (steps, m).
        rows: of every step `NUMBERS`, state, action, features, and theta and w after it.

    Returns:
        The first step that is not made. Behind it is the end of the episode, or weights with which
        no solver can be called, or a step in which a solve failed or the plant ran away.
    """
    n, m, d, split = len(state), len(lower), len(theta), len(warm)
    plan, successor, solution = np.empty(split + d), np.empty(split + d), np.empty(split)
    now, point = np.empty(split + m + d), np.empty(split + m)
    none, later, product, moved = np.zeros(m), np.empty(n), np.empty(d), np.empty(d)
    of_states, of_inputs = np.zeros((len(discount), n)), np.zeros((len(discount) - 1, m))
    gamma = discount[1]
    for t in range(first, len(noise)):
        value, iterations, end, violation, _, restarts = find(
            data, lower, upper, sides, kind, discount, weights, tie,
            state, theta, none, 0, others, drawn, start, tolerance, warm, plan,
        )  # fmt: skip
        if end != SOLVED or not value < ABSURD:
            return t
        solves, phi, action = 1, plan[split:], plan[n : n + m] + noise[t]
        if clipped:
            action = _project(action, lower, upper)  # departure E
        transition(state, action, later)
        cost = charge(state, action)
        if not usable(later, farthest):
            return t
        solution[:] = plan[:split]
        if constrained:
            carried(solution, place, m, point)
            value, taken, end, beyond, _, failed = find(
                data, lower, upper, sides, kind_fixed, discount, weights, tie,
                state, theta, action, 1, others, drawn, SAME, tolerance, point, now,
            )  # fmt: skip
            if end != SOLVED or not value < ABSURD:
                return t
            solves, iterations, restarts = 2, iterations + taken, restarts + failed
            violation, phi = max(violation, beyond), now[split + m :]
            carried(now[: split + m], place, -m, solution)
        next_value = delta = np.nan
        if second:
            next_value, taken, end, beyond, _, failed = find(
                data, lower, upper, sides, kind, discount, weights, tie,
                later, theta, none, 0, others, drawn, start_in(later, solution), tolerance,
                solution, successor,
            )  # fmt: skip
            if end != SOLVED or not next_value < ABSURD:
                return t
            solves, iterations, restarts = solves + 1, iterations + taken, restarts + failed
            violation = max(violation, beyond)
            delta = _td_error(cost, gamma, value, next_value)
            if rule == EXACT and not slopes(
                data, lower, upper, sides, kind_fixed if constrained else kind, discount, weights,
                tie, state, theta, action if constrained else none, int(constrained),
                now[: split + m] if constrained else plan[:split], w, of_states, of_inputs, product,
            ):  # fmt: skip
                return t
            if rule == SEMI_GRADIENT:
                moved = _semi_gradient_step(theta, delta, phi, alpha)
            else:
                moved = _gradient_td_step(theta, w, delta, phi, successor[split:], alpha, gamma)
            if rule == EXACT:
                moved = moved - alpha * _curvature_correction(delta, phi, w, product)
            if rule != SEMI_GRADIENT:
                w[:] = _auxiliary_step(w, delta, phi, beta)
            theta[:] = _project(moved, least, most)
        numbers = (
            cost, value, next_value, delta, np.nan, restarts, violation, iterations, float(solves),
        )  # fmt: skip
        rows[t, :COUNT] = np.array(numbers)
        at = COUNT
        for part in (state, action, phi, theta, w):
            rows[t, at : at + len(part)] = part
            at += len(part)
        state[:] = later
        warm[:] = successor[:split] if second else solution
        start = start_in(state, warm)
        if not usable(theta, largest) or not usable(w, largest):
            return t + 1
    return len(noise)

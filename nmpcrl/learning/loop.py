"""Algorithm 1 for the learners that are built in, an episode at a time, as numba compiles it.

`episode` compiles this file beside `updates`, once for all plants: `find`, `slopes`, the plant and
its cost are arguments. For WebAssembly the same text is compiled with the functions of one plant.
"""

import numpy as np
from numba import float64, int64, njit, types, void
from numba.extending import register_jitable

from nmpcrl.control.solvers.codes import End, Start

from . import updates
from .dense import ENTRIES, NET

SHIFTED, SAME = int(Start.SHIFTED), int(Start.SAME)
SOLVED = int(End.SOLVED)
ABSURD = 1e24  # no value is larger
COUNT = 9  # numbers that a row begins with, `episode.NUMBERS`

SEMI_GRADIENT, GRADIENT_TD, EXACT = range(3)  # rules
NOTHING, SECOND_SOLVE, NETWORK = range(3)  # values of the next state

plain = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
flag, vector, matrix, tensor = types.boolean, float64[::1], float64[:, ::1], float64[:, :, ::1]
given = types.Array(float64, 1, "C", readonly=True)
PROBLEM = (matrix, vector, vector, matrix, int64[:, ::1], vector, vector, float64)  # `Arguments`
FIND = types.UniTuple(float64, 6)(
    *PROBLEM, vector, vector, vector, int64, tensor, tensor, int64, float64, vector, vector
)
SLOPES = flag(*PROBLEM, vector, vector, vector, int64, vector, vector, vector, vector)
FUNCTIONS = (
    FIND, SLOPES, void(given, given, vector), float64(given, given, given),
    *(signature for _, signature in ENTRIES),
)  # fmt: skip
SIGNATURE = int64(
    *map(types.FunctionType, FUNCTIONS), types.Tuple(PROBLEM), types.Tuple(PROBLEM),
    tensor, tensor, float64, int64, int64, float64, float64,
    int64, float64, float64, vector, vector, int64, NET, NET,
    types.Tuple((flag, flag, flag, int64, int64, float64)),
    flag, flag, int64, int64, vector, vector, vector, vector, matrix, matrix,
)  # fmt: skip


for equation in (
    updates.dot, updates.td_error, updates.project, updates.semi_gradient_step,
    updates.gradient_td_step, updates.auxiliary_step, updates.curvature_correction,
):  # fmt: skip
    register_jitable(equation)  # which stays a function of Python


@plain
def copy(numbers, there):
    """Copy numbers without a check of shapes, for which a browser has no error."""
    for k in range(len(numbers)):
        there[k] = numbers[k]


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
def move(rule, theta, w, delta, phi, phi_next, product, alpha, beta, gamma):
    """The next theta; w moves in place, and `product` is the Hessian times w."""
    if rule == SEMI_GRADIENT:
        return updates.semi_gradient_step(theta, delta, phi, alpha)
    moved = updates.gradient_td_step(theta, w, delta, phi, phi_next, alpha, gamma)
    if rule == EXACT:
        moved = moved - alpha * updates.curvature_correction(delta, phi, w, product)
    copy(updates.auxiliary_step(w, delta, phi, beta), w)
    return moved


@plain
def imitated(remember, fit, predict, follow, net, target, imitation, example, value, query):
    """The value of `query`, the loss, and whether they count, as in `Imitation`."""
    _, gated, late, fits, every, rate = imitation
    found, loss = np.full(1, np.nan), np.nan
    by = target if every > 0 else net
    remember(net, example, value)
    known = by[3][1] > 0 or not gated
    if known and late:
        predict(by, query.reshape(1, -1), found)
    if net[3][0] >= net[7][1]:
        for _ in range(fits):
            loss = fit(net)
        if every > 0:
            follow(target, net, every, rate)
    if not late:
        known = by[3][1] > 0 or not gated
        if known:
            predict(by, query.reshape(1, -1), found)
    return found[0], loss if known else np.nan, known


def no_slopes(
    data, lower, upper, sides, kind, discount, weights, tie,
    state, theta, action, fixed, solved, w, of_action, out,
):  # fmt: skip
    return False


ABSENT = (  # for learners without an exact rule, or without a network
    no_slopes,
    lambda net, inputs, target: None,
    lambda net: np.nan,
    lambda net, inputs, values: None,
    lambda target, net, every, rate: None,
)


def episode(
    find, slopes,  # of the plant's solver, and its derivatives, which `EXACT` calls
    transition, charge,  # of the environment: x, u -> x+; x, u, data of stage 0 -> cost
    remember, fit, predict, follow,  # of `dense`
    problem, given_action,  # `riccati.Arguments` where u_0 is free, and where it is given
    others, drawn, tolerance,  # as in `find`
    place, next_input,  # where the multipliers of a given u_0 begin in a solution, and where u_1
    farthest, largest,  # numbers of a state in which a plan may begin, and of theta and w
    rule, alpha, beta,  # `SEMI_GRADIENT`, `GRADIENT_TD` or `EXACT`; step sizes of theta and w
    least, most,  # bounds of theta, (d,)
    bootstrap,  # `NOTHING`, which learns nothing, `SECOND_SOLVE` or `NETWORK`
    net, target,  # the network that learns, and the one that predicts, as in `dense`
    imitation,  # with_theta, gated, late, fits of `Imitation`; every and rate of `Target`, or 0
    constrained, clipped,  # whether Q(s, a) is learned, and whether actions keep to the bounds
    start, first,  # the `Start` of the first solve, and the first step
    state, theta, w,  # (n,), (d,) and (d,), which are left as after the last step; so is `warm`
    warm,  # z, lam and nu, u_0 being free, with which the first solve begins
    noise,  # of every step, scaled, (steps, m)
    rows,  # of every step `NUMBERS`, state, action, features, and theta and w after it
):  # fmt: skip
    """The steps first, first + 1, ... of an episode, as `train` makes them.

    Returns the first step that is not made. Behind it is the end of the episode, or weights with
    which no solver can be called, or a step in which a solve failed or the plant ran away.
    """
    n, m, d, split = len(state), noise.shape[1], len(theta), len(warm)
    plan, successor, solution = np.empty(split + d), np.empty(split + d), np.empty(split)
    now, none = np.empty(split + m + d), np.zeros(m)
    later, product, gamma = np.empty(n), np.empty(d), problem[5][1]
    inputs = n + m + (d if imitation[0] else 0)
    for t in range(first, len(noise)):
        value, iterations, end, violation, _, restarts = find(
            *problem, state, theta, none, 0, others, drawn, start, tolerance, warm, plan
        )
        if end != SOLVED or not value < ABSURD:
            return t
        solves, phi, action = 1, plan[split:], plan[n : n + m] + noise[t]
        if clipped:
            action = updates.project(action, problem[1], problem[2])  # departure E
        transition(state, action, later)
        cost = charge(state, action, problem[0][0])
        if not usable(later, farthest):
            return t
        copy(plan[:split], solution)
        if constrained:
            value, taken, end, beyond, _, failed = find(
                *given_action, state, theta, action, 1, others, drawn, SAME, tolerance, solution,
                now,
            )  # fmt: skip
            if end != SOLVED or not value < ABSURD:
                return t
            solves, iterations, restarts = 2, iterations + taken, restarts + failed
            violation, phi = max(violation, beyond), now[split + m :]
            copy(now[:place], solution)
            copy(now[place + m : split + m], solution[place:])
        next_value = loss = np.nan
        if bootstrap == SECOND_SOLVE:
            begin = start_in(later, solution)
            next_value, taken, end, beyond, _, failed = find(
                *problem, later, theta, none, 0, others, drawn, begin, tolerance, solution,
                successor,
            )  # fmt: skip
            if end != SOLVED or not next_value < ABSURD:
                return t
            solves, iterations, restarts = solves + 1, iterations + taken, restarts + failed
            violation = max(violation, beyond)
        formed = True
        if rule == EXACT and constrained:
            formed = slopes(
                *given_action, state, theta, action, 1, now[: split + m], w, none, product
            )
        elif rule == EXACT:
            formed = slopes(*problem, state, theta, none, 0, plan[:split], w, none, product)
        if not formed:
            return t
        known = bootstrap == SECOND_SOLVE
        if bootstrap == NETWORK:
            next_value, loss, known = imitated(
                remember, fit, predict, follow, net, target, imitation,
                np.concatenate((state, action, theta))[:inputs], value,
                np.concatenate((later, solution[next_input : next_input + m], theta))[:inputs],
            )  # fmt: skip
        delta = updates.td_error(cost, gamma, value, next_value)
        if known:
            moved = move(rule, theta, w, delta, phi, successor[split:], product, alpha, beta, gamma)
            copy(updates.project(moved, least, most), theta)
        numbers = (
            cost, value, next_value, delta, loss, restarts, violation, iterations, float(solves),
        )  # fmt: skip
        copy(numbers, rows[t])
        at = COUNT
        for part in (state, action, phi, theta, w):
            copy(part, rows[t, at:])
            at += len(part)
        copy(later, state)
        copy(successor[:split] if bootstrap == SECOND_SOLVE else solution, warm)
        start = start_in(state, warm)
        if not usable(theta, largest) or not usable(w, largest):
            return t + 1
    return len(noise)

"""What is called from outside Python of the solver of a `Problem`: see `entries`.

`codegen.browser` compiles this file beside `kernel`, `rows`, a `model` with its `expressions`, and
a `settled` of everything that is fixed. States, inputs and solutions are in the problem's units.
"""

import numpy as np
from numba import carray, float64, int32, njit, types

from .codes import End, Start
from .expressions import stage_cost as cost_of_stage
from .expressions import transition
from .model import NTHETA, NU, NX
from .points import carried, equal, lengths, plain
from .rows_slopes import slopes
from .rows_solve import solve
from .settled import (
    COLD_LIMIT,
    DATA,
    DISCOUNT,
    FACTOR,
    INPUTS,
    KIND,
    LOWER,
    RANDOM_INPUTS,
    ROWS,
    SIZES,
    STATES,
    THETA,
    THETA_LOWER,
    THETA_UPPER,
    TIE,
    UPPER,
    WARM_LIMIT,
    WEIGHTS,
    N,
)

COLD, SHIFTED, NEAR, SAME = map(int, Start)
SOLVED, UNKNOWN = int(End.SOLVED), -1
WARM, NEARER, STANDING, RANDOM = range(4)  # the starts in their order; random ones to the end

address = types.CPointer(float64)


@plain
def divided(vector, by):
    """A vector in other units."""
    new = np.empty(len(by))
    for k in range(len(by)):
        new[k] = vector[k] / by[k]
    return new


@plain
def sizes_of(fixed):
    """The units of z, lam and nu: one after the other without and with a given u_0."""
    z, lam = lengths(N, ROWS, 0)
    free = 2 * z + lam
    return SIZES[free:] if fixed else SIZES[:free]


@njit(
    int32(address, address, address, address, int32, int32, address, float64, address, address),
    error_model="numpy",
)
def nmpc_solve(
    data, state, theta, action, fixed, warm_fixed, warm_start, tolerance, out, report
):  # fmt: skip
    """V(s), or Q(s, a) if u_0 is fixed, by the starts of `Compiled` in their order.

    The first cold start that is solved counts, as with `Riccati(starts=1)`. Data are of all
    stages, (N + 1, size). `warm_start`, `report` and what is returned are as in `entries`; there
    is no box that could be violated.
    """
    z, lam = lengths(N, ROWS, fixed)
    state_, report_ = divided(carray(state, NX), STATES), carray(report, 5)
    action_ = divided(carray(action, NU), INPUTS)
    result = carray(out, 2 * z + lam + NTHETA)
    standing, point, begin = np.zeros(2 * z + lam), np.zeros(2 * z + lam), COLD
    if warm_fixed != UNKNOWN:
        _, old_lam = lengths(N, ROWS, warm_fixed)
        old = divided(carray(warm_start, 2 * z + old_lam), sizes_of(warm_fixed))
        point = carried(N, ROWS, fixed, warm_fixed, old)
        begin = SAME if equal(state_, old) else SHIFTED
    restarts, end = -1, UNKNOWN
    for attempt in range(RANDOM + len(RANDOM_INPUTS)):
        start, limit = COLD, COLD_LIMIT
        if attempt < STANDING:
            if begin == COLD or (attempt == NEARER and begin == SHIFTED):
                continue
            start, limit = (NEAR if attempt == NEARER else begin), WARM_LIMIT
        else:
            point = standing
            for i in range(N if attempt >= RANDOM else 0):
                for a in range(NU):
                    point[i * (NX + NU + ROWS) + NX + a] = RANDOM_INPUTS[attempt - RANDOM, i, a]
        restarts += 1
        value, iterations, ended, violation, error = solve(
            carray(data, DATA.shape), LOWER.copy(), UPPER.copy(), KIND[fixed].copy(),
            DISCOUNT.copy(), WEIGHTS.copy(), FACTOR, TIE,
            state_, carray(theta, NTHETA), action_, fixed,
            start, limit, tolerance, point, result,
        )  # fmt: skip
        report_[0], report_[1], report_[2] = value, iterations, restarts
        report_[3], report_[4] = violation, error
        end = int(ended)
        if end == SOLVED and value < np.inf:
            break
        end = UNKNOWN if end == SOLVED else end
    sizes = sizes_of(fixed)
    for k in range(len(sizes)):
        result[k] *= sizes[k]
    return end


@njit(
    int32(address, address, address, address, int32, address, address, address, address, address),
    error_model="numpy",
)
def nmpc_slopes(data, state, theta, action, fixed, solution, vector, states, inputs, out):
    """The Hessian of the value times a vector, and a weighted sum of the plan, in theta.

    Their sum, to be precise: one of the two is zeros. The weights are of shape (N + 1, NX) and
    (N, NU), the vector and what comes out (NTHETA,). Returns 0 at no strict minimum.
    """
    z, lam = lengths(N, ROWS, fixed)
    point = divided(carray(solution, 2 * z + lam), sizes_of(fixed))
    weights, weights_u = carray(states, (N + 1, NX)).copy(), carray(inputs, (N, NU)).copy()
    for i in range(N + 1):
        for a in range(NX):
            weights[i, a] *= STATES[a]
        for a in range(NU if i < N else 0):
            weights_u[i, a] *= INPUTS[a]
    return slopes(
        carray(data, DATA.shape), LOWER.copy(), UPPER.copy(), KIND[fixed].copy(), DISCOUNT.copy(),
        WEIGHTS.copy(), FACTOR, TIE, divided(carray(state, NX), STATES), carray(theta, NTHETA),
        divided(carray(action, NU), INPUTS), fixed, point, carray(vector, NTHETA),
        weights, weights_u, carray(out, NTHETA),
    )  # fmt: skip


@njit(int32(address, address, address, address, address), error_model="numpy")
def model_step(data, state, action, theta, out):
    """The state that the model predicts; data are of one stage."""
    later = carray(out, NX)
    transition(
        divided(carray(state, NX), STATES), divided(carray(action, NU), INPUTS),
        carray(theta, NTHETA), carray(data, DATA.shape[1]), later,
    )  # fmt: skip
    for a in range(NX):
        later[a] *= STATES[a]
    return 0


@njit(float64(address, address, address, address), error_model="numpy")
def stage_cost(data, state, action, theta):
    """What the problem charges for a stage, undiscounted; data are of one stage."""
    return cost_of_stage(
        divided(carray(state, NX), STATES), divided(carray(action, NU), INPUTS),
        carray(theta, NTHETA), carray(data, DATA.shape[1]),
    )  # fmt: skip


@njit(int32(address), error_model="numpy")
def nmpc_sizes(out):
    """States, inputs, parameters, horizon, rows, data of a stage; numbers of z, and of lam."""
    sizes, (z, lam) = carray(out, 8), lengths(N, ROWS, 0)
    sizes[0], sizes[1], sizes[2], sizes[3], sizes[4] = NX, NU, NTHETA, N, ROWS
    sizes[5], sizes[6], sizes[7] = DATA.shape[1], z, lam
    return 0


@njit(int32(address, address, address, address, address, address), error_model="numpy")
def nmpc_defaults(data, theta, theta_lower, theta_upper, lower, upper):
    """Data of all stages, where theta starts, its bounds, and those of the inputs."""
    known = carray(data, DATA.shape)
    for i in range(N + 1):
        for k in range(DATA.shape[1]):
            known[i, k] = DATA[i, k]
    for to, of in ((theta, THETA), (theta_lower, THETA_LOWER), (theta_upper, THETA_UPPER)):
        there = carray(to, NTHETA)
        for k in range(NTHETA):
            there[k] = of[k]
    least, most = carray(lower, NU), carray(upper, NU)
    for a in range(NU):
        least[a], most[a] = LOWER[a] * INPUTS[a], UPPER[a] * INPUTS[a]
    return 0


EXPORTS = (nmpc_solve, nmpc_slopes, model_step, stage_cost, nmpc_sizes, nmpc_defaults)

"""What is called of the solver from outside Python: pointers and plain numbers, no arrays.

`codegen.browser` compiles this file beside `kernel`, `hessian`, a `model` of the plant and a
`charge` of the task, and exports each function of `EXPORTS`. An array is a pointer to its first
number, in C order. Its shape follows from N, the horizon, M, the number of obstacles, and B, the
number of sides of the box on the state; the problem's arguments are those of `InteriorPoint`. A
solution's numbers are z, lam and nu in the order of `Ocp`, and then the gradient of the value.
"""

import numpy as np
from numba import carray, float64, int32, njit, types

from .charge import COLD_LIMIT, DISCS, LONGEST, RANDOM_INPUTS, WARM_LIMIT, charge
from .codes import End, Start
from .hessian_times import hessian_times
from .model import NTHETA, NU, NX, transition
from .points import carried, equal, lengths
from .solve import solve

COLD, SHIFTED, NEAR, SAME = map(int, Start)
SOLVED, UNKNOWN = int(End.SOLVED), -1
WARM, NEARER, STANDING, RANDOM = range(4)  # the starts in their order; random ones to the end
ELSEWHERE = (1e9, 1e9, 1.0)  # a disc that costs nothing

address = types.CPointer(float64)
PROBLEM = (
    int32, int32, int32,  # N, M, B
    address, address, address,  # target (NX,), lower and upper (NU,)
    address, address, address,  # discs (M, 3), sides (B, 3), discount (N + 1,)
    float64, int32, float64,  # slack_weight, soft_box, tie
    address, address, address, int32,  # state (NX,), theta (NTHETA,), action (NU,), fixed
)  # fmt: skip


@njit(int32(*PROBLEM, int32, address, float64, address, address), error_model="numpy")
def nmpc_solve(
    N, M, B, target, lower, upper, discs, sides, discount, slack_weight, soft_box, tie,
    state, theta, action, fixed, warm_fixed, warm_start, tolerance, out, report,
):  # fmt: skip
    """V(s), or Q(s, a) if u_0 is fixed, by the starts of `InteriorPoint` in their order.

    `warm_start` holds another solution's numbers, and `warm_fixed` whether its u_0 was fixed, or
    -1 if there is none. `report` receives the value, the iterations of the last start, the
    restarts, the violation of the box and the relative error. Returns the `End`, or -1 for a
    problem with more obstacles or a longer horizon than `charge` provides for.
    """
    if M > DISCS or N > LONGEST:
        return UNKNOWN
    z, lam = lengths(N, M, fixed)
    state_, report_ = carray(state, NX), carray(report, 5)
    standing, point, begin = np.zeros(2 * z + lam), np.zeros(2 * z + lam), COLD
    if warm_fixed != UNKNOWN:
        _, old_lam = lengths(N, M, warm_fixed)
        old = carray(warm_start, 2 * z + old_lam)
        point = carried(N, M, fixed, warm_fixed, old)
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
                    point[i * (NX + NU + M) + NX + a] = RANDOM_INPUTS[attempt - RANDOM, i, a]
        restarts += 1
        value, iterations, ended, violation, error = solve(
            carray(target, NX), carray(lower, NU), carray(upper, NU), carray(discs, (M, 3)),
            carray(sides, (B, 3)), carray(discount, N + 1), slack_weight, soft_box, tie,
            state_, carray(theta, NTHETA), carray(action, NU), fixed,
            start, limit, tolerance, point, carray(out, 2 * z + lam + NTHETA),
        )  # fmt: skip
        report_[0], report_[1], report_[2] = value, iterations, restarts
        report_[3], report_[4] = violation, error
        end = int(ended)
        if end == SOLVED:
            break
    return end


@njit(int32(*PROBLEM, address, address, address), error_model="numpy")
def nmpc_hessian_times(
    N, M, B, target, lower, upper, discs, sides, discount, slack_weight, soft_box, tie,
    state, theta, action, fixed, solution, vector, out,
):  # fmt: skip
    """The Hessian of the value in theta, times a vector (NTHETA,); 0 at no strict minimum."""
    z, lam = lengths(N, M, fixed)
    return hessian_times(
        carray(target, NX), carray(lower, NU), carray(upper, NU), carray(discs, (M, 3)),
        carray(sides, (B, 3)), carray(discount, N + 1), slack_weight, soft_box, tie,
        carray(state, NX), carray(theta, NTHETA), carray(action, NU), fixed,
        carray(solution, 2 * z + lam), carray(vector, NTHETA), carray(out, NTHETA),
    )  # fmt: skip


@njit(int32(address, address, address), error_model="numpy")
def plant_step(state, action, out):
    """The state one period later, Eq. (18)."""
    transition(carray(state, NX), carray(action, NU), carray(out, NX))
    return 0


@njit(float64(int32, address, address, address, address), error_model="numpy")
def stage_cost(M, discs, target, state, action):
    """The RL stage cost, Eq. (20); obstacles that are not there lie where they cost nothing.

    nan where there are more than `charge` provides for.
    """
    if M > DISCS:
        return np.nan
    around, there = np.empty((DISCS, 3)), carray(discs, (M, 3))
    for j in range(DISCS):
        for k in range(3):
            around[j, k] = there[j, k] if j < M else ELSEWHERE[k]
    return charge(carray(state, NX), carray(action, NU), carray(target, NX), around)


EXPORTS = (nmpc_solve, nmpc_hessian_times, plant_step, stage_cost)

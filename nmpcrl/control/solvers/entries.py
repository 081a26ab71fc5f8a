"""What other hosts than Python call: pointers and plain numbers, no arrays.

`control.browser` compiles this file beside the `model` of a problem and exports each function of
`EXPORTS`. An array is a pointer to its first number, in C order. A problem is one array, as
`control.browser.packed` writes it; states, inputs and solutions are in the units in which it is
solved. A solution's numbers are z, lam and nu in the order of `Ocp`, and then the gradient.
"""

import numpy as np
from numba import carray, float64, int32, njit, types

from . import model
from .find import find
from .kernel import COLD, SAME, SHIFTED, SOLVED, allocating, places
from .model import FIXED, NTHETA, NU, NX, OWN, PER, WIDTH
from .slopes import slopes

UNKNOWN = -1
HEAD = 6  # numbers in front of a problem's arrays

address = types.CPointer(float64)
AT = (address, address, address, address, int32)  # problem, state, theta, action, fixed


@allocating
def unpacked(problem, fixed):
    """`riccati.Arguments`, the cold starts that are compared, and those that come last."""
    head = carray(problem, HEAD)
    N, lines, sides = int(head[0]), int(head[1]), int(head[2])
    others, drawn = int(head[3]), int(head[4])
    rows, width = FIXED + PER * lines, OWN + WIDTH * lines
    sizes = (
        (N + 1) * width, NU, NU, 3 * sides, 2 * (N + 1) * (rows + sides), N + 1, rows,
        others * N * NU, drawn * N * NU,
    )  # fmt: skip
    at = np.full(len(sizes) + 1, HEAD)
    for k in range(len(sizes)):
        at[k + 1] = at[k] + sizes[k]
    numbers = carray(problem, at[-1])
    kinds = numbers[at[4] : at[5]].reshape(2, N + 1, rows + sides)
    given = (
        numbers[at[0] : at[1]].reshape(N + 1, width),
        numbers[at[1] : at[2]],
        numbers[at[2] : at[3]],
        numbers[at[3] : at[4]].reshape(sides, 3),
        kinds[fixed].astype(np.int64),
        numbers[at[5] : at[6]],
        numbers[at[6] : at[7]],
        head[5],
    )
    compared = numbers[at[7] : at[8]].reshape(others, N, NU)
    return given, compared, numbers[at[8] : at[9]].reshape(drawn, N, NU)


@allocating
def places_in(given, fixed):
    """`kernel.places` of a problem: last, the length of a solution without its gradient."""
    data, discount = given[0], given[5]
    lines = (data.shape[1] - OWN) // WIDTH if WIDTH > 0 else 0
    return places(len(discount), lines, fixed)


@njit(int32(*AT, int32, address, float64, address, address), error_model="numpy")
def nmpc_solve(
    problem, state, theta, action, fixed, warm_fixed, warm_start, tolerance, out, report
):
    """V(s), or Q(s, a) if u_0 is fixed: `find`.

    `warm_start` holds another solution's numbers, and `warm_fixed` whether its u_0 was fixed, or
    -1 if there is none. `report` receives the value, the iterations, the starts that failed, the
    violation of hard rows and the relative error. Returns the `End`, or -1 for an infinite value.
    """
    given, others, drawn = unpacked(problem, fixed)
    size = places_in(given, fixed)[-1]
    state_, report_, begin = carray(state, NX), carray(report, 5), COLD
    point = np.zeros(size)
    if warm_fixed != UNKNOWN:
        point, begin = carray(warm_start, places_in(given, warm_fixed)[-1]), SAME
        for a in range(NX):
            if state_[a] != point[a]:
                begin = SHIFTED
    value, iterations, end, violation, error, failed = find(
        *given, state_, carray(theta, NTHETA), carray(action, NU), fixed,
        others, drawn, begin, tolerance, point, carray(out, size + NTHETA),
    )  # fmt: skip
    report_[0], report_[1], report_[2] = value, iterations, failed
    report_[3], report_[4] = violation, error
    return int(end) if end != SOLVED or value < np.inf else UNKNOWN


@njit(int32(*AT, address, address, address, address), error_model="numpy")
def nmpc_slopes(problem, state, theta, action, fixed, solution, vector, of_action, out):
    """The Hessian of the value times a vector, plus the gradient of a weighted sum of u_0.

    The weights are of shape (NU,), the vector and `out` (NTHETA,). Returns 0 at no strict minimum.
    """
    given, _, _ = unpacked(problem, fixed)
    return slopes(
        *given, carray(state, NX), carray(theta, NTHETA), carray(action, NU), fixed,
        carray(solution, places_in(given, fixed)[-1]), carray(vector, NTHETA),
        carray(of_action, NU), carray(out, NTHETA),
    )  # fmt: skip


@njit(int32(address, address, address, address, address), error_model="numpy")
def model_step(problem, state, theta, action, out):
    """The state that the model predicts with the data of stage 0."""
    data = unpacked(problem, 0)[0][0]
    model.transition(
        carray(state, NX), carray(action, NU), carray(theta, NTHETA), data[0], carray(out, NX)
    )
    return 0


@njit(float64(address, address, address, address), error_model="numpy")
def stage_cost(problem, state, theta, action):
    """l of the problem with the data of stage 0, undiscounted."""
    data = unpacked(problem, 0)[0][0]
    return model.stage_cost(carray(state, NX), carray(action, NU), carray(theta, NTHETA), data[0])


EXPORTS = (nmpc_solve, nmpc_slopes, model_step, stage_cost)

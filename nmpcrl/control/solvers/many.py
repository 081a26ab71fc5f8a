"""Many solves of a `Problem`, for which its `find` is an argument: compiled once for all problems.

It holds no lock of Python's (`nogil`), so that threads solve beside each other.
"""

from numba import float64, int64, njit, types, void

vector, matrix, tensor = float64[::1], float64[:, ::1], float64[:, :, ::1]
REST = (vector, vector, matrix, int64[:, ::1], vector, vector, float64)  # `Arguments` but the data
FIND = types.UniTuple(float64, 6)(
    matrix, *REST, vector, vector, vector, int64, tensor, tensor, int64, float64, vector, vector
)
SIGNATURE = void(
    types.FunctionType(FIND), types.Tuple(REST), int64, tensor, tensor, float64,
    int64, int64, tensor, matrix, matrix, matrix, int64[::1], matrix, matrix, matrix,
)  # fmt: skip


@njit(SIGNATURE, cache=True, nogil=True, error_model="numpy")
def many(
    find, rest, fixed, others, drawn, tolerance,
    first, end,  # the rows that are solved here
    data, states, thetas, actions, starts, points,  # a row a solve; one row of data may serve all
    out, report,  # what `find` writes and returns
):  # fmt: skip
    """Call `find` for each row; see there for the arguments."""
    for k in range(first, end):
        found = find(
            data[min(k, len(data) - 1)], *rest, states[k], thetas[k], actions[k], fixed,
            others, drawn, starts[k], tolerance, points[min(k, len(points) - 1)], out[k],
        )  # fmt: skip
        for j in range(6):
            report[k, j] = found[j]

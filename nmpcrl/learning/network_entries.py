"""The functions of `dense` for hosts of WebAssembly, where a network is addresses of arrays.

`browser` compiles this file beside `dense`.
"""

import numpy as np
from numba import carray, float32, float64, int32, int64, njit, types, uint64

from .dense import at_addresses, fit, predict, remember

singles, numbers, places, counts, states = map(
    types.CPointer, (float32, float64, int32, int64, uint64)
)
# The arrays of a `NET` with the rate among them, the length of an input, and the capacity
NETWORK = (singles, singles, places, counts, states, numbers, float64, counts, int32, int32)


@njit(int32(*NETWORK, numbers, float64))
def network_remember(
    weights, examples, order, known, draw, scales, rate, sizes, inputs, capacity, row, target
):
    """Store one example."""
    net = at_addresses(weights, examples, order, known, draw, scales, rate, sizes, inputs, capacity)
    remember(net, carray(row, inputs), target)
    return 0


@njit(float64(*NETWORK))
def network_fit(weights, examples, order, known, draw, scales, rate, sizes, inputs, capacity):
    """Make one step of Adam; the loss before it, or nan where examples are too few."""
    return fit(
        at_addresses(weights, examples, order, known, draw, scales, rate, sizes, inputs, capacity)
    )


@njit(float64(*NETWORK, numbers))
def network_predict(
    weights, examples, order, known, draw, scales, rate, sizes, inputs, capacity, row
):
    """The value of one input."""
    net = at_addresses(weights, examples, order, known, draw, scales, rate, sizes, inputs, capacity)
    value = np.empty(1)
    predict(net, carray(row, (1, inputs)), value)
    return value[0]


EXPORTS = (network_remember, network_fit, network_predict)

"""The network of `network` for hosts other than Python: its fit and its prediction, on pointers.

`browser` compiles this file. Everything is in single precision, as torch has it; sums run in
another order than torch's. A vector of all weights, or of what belongs to each of them, has the
layout of `network`: a matrix (in + 1, out) a layer, whose last row is the bias. Rows of inputs end
in a one. The hidden layers have ReLU, whose zeros are skipped.
"""

import math

import numpy as np
from numba import carray, float32, float64, int32, njit, types

single = types.CPointer(float32)
plain = njit(error_model="numpy")

BETA1, BETA2, EPSILON = 0.9, 0.999, 1e-8  # of Adam, as in torch


@plain
def matrices(vector, inputs, hidden):
    """The three matrices of a vector."""
    second = (inputs + 1) * hidden
    third = second + (hidden + 1) * hidden
    return (
        vector[:second].reshape(inputs + 1, hidden),
        vector[second:third].reshape(hidden + 1, hidden),
        vector[third : third + hidden + 1].reshape(hidden + 1, 1),
    )


@plain
def multiply(x, W, out):
    """The first columns of `out` = x W, without the zeros of x and four rows of W at a time."""
    rows, count = x.shape
    width = W.shape[1]
    kept = np.empty(count, np.int32)  # the columns of x that are not zero in a row
    for r in range(rows):
        some = 0
        for i in range(count):
            kept[some] = i
            some += x[r, i] != 0
        for j in range(width):
            out[r, j] = np.float32(0)
        whole = some - some % 4
        for k in range(0, whole, 4):
            p, q, s, t = kept[k], kept[k + 1], kept[k + 2], kept[k + 3]
            a, b, c, d = x[r, p], x[r, q], x[r, s], x[r, t]
            for j in range(width):
                out[r, j] = out[r, j] + a * W[p, j] + b * W[q, j] + c * W[s, j] + d * W[t, j]
        for k in range(whole, some):
            p = kept[k]
            a = x[r, p]
            for j in range(width):
                out[r, j] += a * W[p, j]


@plain
def rectify(out, width):
    """ReLU of the first columns, in place."""
    for r in range(len(out)):
        for j in range(width):
            out[r, j] = max(out[r, j], np.float32(0))


@plain
def forward(x, first, second, third, W1, W2, W3):
    """The output of each row is the first column of `third`."""
    multiply(x, W1, first)
    rectify(first, W1.shape[1])
    multiply(first, W2, second)
    rectify(second, W2.shape[1])
    multiply(second, W3, third)


@plain
def backward(d, W, out, before):
    """The derivative in the output of the layer before, which is `out`, from d: d W', where > 0."""
    hidden, width = W.shape[0] - 1, W.shape[1]
    turned = np.empty((width, hidden), np.float32)
    for i in range(hidden):
        for j in range(width):
            turned[j, i] = W[i, j]
    multiply(d, turned, before)
    for r in range(len(before)):
        for i in range(hidden):
            if out[r, i] <= 0:
                before[r, i] = np.float32(0)


@plain
def descend(weights, gradient, mean, square, rate, fits):
    """Adam's step number `fits`, in the order of operations of torch's fused kernel."""
    step = np.float32(rate / (1 - BETA1**fits))
    root = np.float32(math.sqrt(1 - BETA2**fits))
    new, kept, added = np.float32(1 - BETA1), np.float32(BETA2), np.float32(1 - BETA2)
    epsilon = np.float32(EPSILON)
    for k in range(len(weights)):
        g = gradient[k]
        mean[k] += new * (g - mean[k])
        square[k] = square[k] * kept + added * g * g
        weights[k] -= step * mean[k] / (np.float32(math.sqrt(square[k])) / root + epsilon)


@njit(
    float64(int32, int32, int32, single, single, single, single, float64, int32),
    error_model="numpy",
)
def network_fit(inputs, hidden, batch, rows, weights, mean, square, rate, fits):
    """One Adam step, in place, number `fits` from 1 on; its loss before the step, Eq. (10).

    `rows` are (batch, inputs + 2): an input, a one, and the target.
    """
    count = (inputs + 1) * hidden + (hidden + 1) * hidden + hidden + 1
    drawn = carray(rows, (batch, inputs + 2))
    x = np.empty((batch, inputs + 1), np.float32)
    for r in range(batch):
        for i in range(inputs + 1):
            x[r, i] = drawn[r, i]
    there = carray(weights, (count,))
    W1, W2, W3 = matrices(there, inputs, hidden)
    first = np.ones((batch, hidden + 1), np.float32)
    second = np.ones((batch, hidden + 1), np.float32)
    d3 = np.empty((batch, 1), np.float32)
    forward(x, first, second, d3, W1, W2, W3)
    loss, share = 0.0, np.float32(2 / batch)
    for r in range(batch):
        error = d3[r, 0] - drawn[r, inputs + 1]
        loss += np.float64(error) ** 2
        d3[r, 0] = share * error
    d2, d1 = np.empty((batch, hidden), np.float32), np.empty((batch, hidden), np.float32)
    backward(d3, W3, second, d2)
    backward(d2, W2, first, d1)
    gradient = np.empty(count, np.float32)
    dW1, dW2, dW3 = matrices(gradient, inputs, hidden)
    multiply(second.T, d3, dW3)
    multiply(first.T, d2, dW2)
    multiply(x.T, d1, dW1)
    descend(there, gradient, carray(mean, (count,)), carray(square, (count,)), rate, fits)
    return loss / batch


@njit(float64(int32, int32, single, single), error_model="numpy")
def network_predict(inputs, hidden, row, weights):
    """The value of one input, which ends in a one."""
    count = (inputs + 1) * hidden + (hidden + 1) * hidden + hidden + 1
    W1, W2, W3 = matrices(carray(weights, (count,)), inputs, hidden)
    first, second = np.ones((1, hidden + 1), np.float32), np.ones((1, hidden + 1), np.float32)
    third = np.empty((1, 1), np.float32)
    forward(carray(row, (1, inputs + 1)), first, second, third, W1, W2, W3)
    return float(third[0, 0])


EXPORTS = (network_fit, network_predict)

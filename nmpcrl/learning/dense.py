"""The network of Eqs. (10) and (11) as machine code: examples, mini-batches, fits, predictions.

numba compiles this text for `network.QNetwork`, beside the loop of Algorithm 1, and to WebAssembly.
Every function takes a network as one tuple, a `NET`:

- weights, float32 (4, count): of all layers, their gradient, and Adam's two moments;
- examples, float32 (capacity, inputs + 1): inputs and target, divided by their scales;
- order, int32 (capacity,): the examples' numbers, shuffled; a mini-batch comes first;
- counts, int64 (2,): examples remembered since the start, and fits;
- draw, uint64 (1,): state of the generator of the mini-batches;
- scales, float64 (inputs + 1,): of the inputs and the target;
- rate, float64: of Adam;
- sizes, int64 (4,): neurons in a hidden layer, examples in a mini-batch, examples remembered at
  most, and 1 where the hidden layers have tanh instead of ReLU.

A layer is a matrix (in + 1, out) whose last row is the bias; the third is a vector. A copy of the
arrays continues with the same bits.
"""

import math
from typing import Any

import numpy as np
from numba import float32, float64, int32, int64, njit, types, uint64, void

fast = {"contract", "arcp", "nsz", "reassoc", "afn"}
options: dict[str, Any] = {"error_model": "numpy", "fastmath": fast}
# Inlined into `fit`, which makes the buffers: the compiler then knows that no two overlap.
inner: dict[str, Any] = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
inlined = njit(**inner, **options)
NET = types.Tuple((
    float32[:, ::1], float32[:, ::1], int32[::1], int64[::1], uint64[::1], float64[::1], float64,
    int64[::1],
))  # fmt: skip
vector, matrix = (types.Array(float64, axes, "C", readonly=True) for axes in (1, 2))

ZERO, ONE = np.float32(0), np.float32(1)
BETA1, BETA2, EPSILON = 0.9, 0.999, 1e-8  # of Adam, as in torch
# tanh(x) = x P(x x) / Q(x x) in single precision, and 1 beyond END: the coefficients of Eigen
END = np.float32(7.90531110763549805)
P = tuple(map(np.float32, (
    -2.76076847742355e-16, 2.00018790482477e-13, -8.60467152213735e-11, 5.12229709037114e-08,
    1.48572235717979e-05, 6.37261928875436e-04, 4.89352455891786e-03,
)))  # fmt: skip
Q = tuple(map(np.float32, (
    1.19825839466702e-06, 1.18534705686654e-04, 2.26843463243900e-03, 4.89352518554385e-03,
)))  # fmt: skip


@inlined
def multiply(A, B, C):
    """C += A B, four rows of A and four of B at a time."""
    rows, count = A.shape
    width, whole, fours = B.shape[1], rows - rows % 4, count - count % 4
    for r in range(0, whole, 4):
        for k in range(0, fours, 4):
            a0, a1, a2, a3 = A[r, k], A[r, k + 1], A[r, k + 2], A[r, k + 3]
            b0, b1, b2, b3 = A[r + 1, k], A[r + 1, k + 1], A[r + 1, k + 2], A[r + 1, k + 3]
            c0, c1, c2, c3 = A[r + 2, k], A[r + 2, k + 1], A[r + 2, k + 2], A[r + 2, k + 3]
            d0, d1, d2, d3 = A[r + 3, k], A[r + 3, k + 1], A[r + 3, k + 2], A[r + 3, k + 3]
            for j in range(width):
                p, q, s, t = B[k, j], B[k + 1, j], B[k + 2, j], B[k + 3, j]
                C[r, j] += a0 * p + a1 * q + a2 * s + a3 * t
                C[r + 1, j] += b0 * p + b1 * q + b2 * s + b3 * t
                C[r + 2, j] += c0 * p + c1 * q + c2 * s + c3 * t
                C[r + 3, j] += d0 * p + d1 * q + d2 * s + d3 * t
        for k in range(fours, count):
            for i in range(r, r + 4):
                for j in range(width):
                    C[i, j] += A[i, k] * B[k, j]
    for r in range(whole, rows):
        for k in range(count):
            for j in range(width):
                C[r, j] += A[r, k] * B[k, j]


@inlined
def layers(weights, inputs, hidden):
    """The layers in a vector of all weights."""
    second, third = (inputs + 1) * hidden, (inputs + hidden + 2) * hidden
    return (
        weights[:second].reshape(inputs + 1, hidden),
        weights[second:third].reshape(hidden + 1, hidden),
        weights[third : third + hidden + 1],
    )


@inlined
def activate(x, tanh):
    """ReLU, or tanh."""
    if not tanh:
        return max(x, ZERO)
    x = min(max(x, -END), END)
    p, q = P[0], Q[0]
    for a in P[1:]:
        p = p * x * x + a
    for a in Q[1:]:
        q = q * x * x + a
    return x * p / q


@inlined
def hidden_layer(x, W, tanh, y):
    """Compute the layer's output y for the rows x."""
    for r in range(len(y)):
        for j in range(y.shape[1]):
            y[r, j] = W[-1, j]
    multiply(x, W[:-1], y)
    for r in range(len(y)):
        for j in range(y.shape[1]):
            y[r, j] = activate(y[r, j], tanh)


@inlined
def forward(x, weights, hidden, tanh, y1, y2, values):
    """Compute the outputs of the hidden layers and the value, for the rows x."""
    W1, W2, W3 = layers(weights, x.shape[1], hidden)
    hidden_layer(x, W1, tanh, y1)
    hidden_layer(y1, W2, tanh, y2)
    for r in range(len(x)):
        value = W3[hidden]
        for j in range(hidden):
            value += y2[r, j] * W3[j]
        values[r] = value


@inlined
def differentiate(x, y, d, tanh, dW):
    """Compute the loss's derivative dW in a layer from d, that in its output y.

    In place, d becomes the derivative in x W.
    """
    dW[:] = ZERO
    for r in range(len(d)):
        for j in range(d.shape[1]):
            if tanh:
                d[r, j] *= ONE - y[r, j] * y[r, j]
            else:
                d[r, j] = d[r, j] if y[r, j] > ZERO else ZERO
            dW[-1, j] += d[r, j]
    multiply(x.T, d, dW[:-1])


@inlined
def backward(x, weights, hidden, tanh, y1, y2, e):
    """Compute the gradient weights[1] from e, the loss's derivative in each value."""
    _, W2, W3 = layers(weights[0], x.shape[1], hidden)
    dW1, dW2, dW3 = layers(weights[1], x.shape[1], hidden)
    d1, d2 = np.zeros_like(y1), np.empty_like(y2)
    dW3[:] = ZERO
    for r in range(len(x)):
        for j in range(hidden):
            dW3[j] += e[r] * y2[r, j]
            d2[r, j] = e[r] * W3[j]
        dW3[hidden] += e[r]
    differentiate(y1, y2, d2, tanh, dW2)
    multiply(d2, W2[:-1].T.copy(), d1)
    differentiate(x, y1, d1, tanh, dW1)


@inlined
def descend(weights, rate, fits):
    """Make Adam's step number `fits`."""
    step = np.float32(rate / (1 - BETA1**fits))
    root = np.float32(math.sqrt(1 - BETA2**fits))
    new, kept, added = np.float32(1 - BETA1), np.float32(BETA2), np.float32(1 - BETA2)
    for k in range(weights.shape[1]):
        g = weights[1, k]
        mean = weights[2, k] + new * (g - weights[2, k])
        square = weights[3, k] * kept + added * g * g
        weights[2, k], weights[3, k] = mean, square
        weights[0, k] -= step * mean / (math.sqrt(square) / root + np.float32(EPSILON))


@inlined
def uniform(draw):
    """The next number of splitmix64 (Steele, Lea and Flood 2014), in [0, 1)."""
    draw[0] += np.uint64(0x9E3779B97F4A7C15)
    z = draw[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.float64((z ^ (z >> np.uint64(31))) >> np.uint64(12)) * 2.0**-52


@njit(**options)
def remember(net, inputs, target):
    """Store one example, in place of the oldest where as many are remembered as may be.

    Raises:
        IndexError: the arrays have no room for it.
    """
    _, examples, order, counts, _, scales, _, sizes = net
    at, count = counts[0] % sizes[2], len(inputs)
    if at >= len(examples):
        raise IndexError("no room for another example")
    for i in range(count):
        examples[at, i] = inputs[i] / scales[i]
    examples[at, count] = target / scales[count]
    if counts[0] == at:
        order[at] = at
    counts[0] += 1


@njit(**options)
def fit(net):
    """Make one step of Adam on a mini-batch drawn without replacement, Eq. (10).

    Returns the loss before the step, or nan where there are too few examples for a mini-batch.
    """
    weights, examples, order, counts, draw, scales, rate, sizes = net
    hidden, batch, tanh = sizes[0], sizes[1], sizes[3] != 0
    count, inputs = min(counts[0], sizes[2]), examples.shape[1] - 1
    if count < batch:
        return np.nan
    x, e = np.empty((batch, inputs), np.float32), np.empty(batch, np.float32)
    y1, y2 = np.empty((batch, hidden), np.float32), np.empty((batch, hidden), np.float32)
    for r in range(batch):
        at = r + int(uniform(draw) * (count - r))
        order[r], order[at] = order[at], order[r]
        for i in range(inputs):
            x[r, i] = examples[order[r], i]
    forward(x, weights[0], hidden, tanh, y1, y2, e)
    loss = 0.0
    for r in range(batch):
        error = e[r] - examples[order[r], inputs]
        loss += np.float64(error) ** 2
        e[r] = error * np.float32(2 / batch)
    backward(x, weights, hidden, tanh, y1, y2, e)
    counts[1] += 1
    descend(weights, rate, counts[1])
    return loss / batch * scales[inputs] ** 2


@njit(**options)
def predict(net, inputs, values):
    """Compute the value of each row of inputs, Eq. (11)."""
    weights, scales, hidden, tanh = net[0], net[5], net[7][0], net[7][3] != 0
    rows, count = inputs.shape
    x, found = np.empty((rows, count), np.float32), np.empty(rows, np.float32)
    y1, y2 = np.empty((rows, hidden), np.float32), np.empty((rows, hidden), np.float32)
    for r in range(rows):
        for i in range(count):
            x[r, i] = inputs[r, i] / scales[i]
    forward(x, weights[0], hidden, tanh, y1, y2, found)
    for r in range(rows):
        values[r] = found[r] * scales[count]


@njit(**options)
def follow(target, net, every, rate):
    """Count a step, and at each `every`-th move the weights of `target` a part of the way to `net`.

    The counts of a target are its steps, and the fits that its weights have seen.
    """
    near, far, share = target[0][0], net[0][0], np.float32(rate)
    target[3][0] += 1
    if target[3][0] % every == 0:
        target[3][1] = net[3][1]
        for k in range(len(near)):
            near[k] = share * far[k] + (ONE - share) * near[k]


ENTRIES = (
    (remember, void(NET, vector, float64)),
    (fit, float64(NET)),
    (predict, void(NET, matrix, float64[::1])),
    (follow, void(NET, NET, int64, float64)),
)

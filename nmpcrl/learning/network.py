"""The network that imitates the NMPC's value. The only home of torch."""

import sys
import threading
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from nmpcrl import Vector

torch.set_num_threads(1)  # matrices this small only get slower with more

KEPT = 256  # rows: room for more predictions at once is made anew
DRAWING = threading.Lock()  # torch draws first weights from one generator a process

# In place, and its slope from what it made; that of a ReLU is its output's sign.
Activation = tuple[Callable[[Tensor], Tensor], Callable[[Tensor], Tensor]]
ACTIVATIONS: dict[str, Activation] = {
    "relu": (Tensor.relu_, Tensor.sign),
    "tanh": (Tensor.tanh_, lambda y: 1 - y * y),
}


class Predictor:
    """What some weights predict: inputs - 64 - 64 - 1."""

    def __init__(
        self,
        weights: Tensor,
        gradient: Tensor,
        widths: tuple[int, ...],
        activation: Activation,
        scales: tuple[Vector | float, float],
    ) -> None:
        """Look at the weights, which may change.

        Args:
            weights: of all layers, in one vector.
            gradient: as long; for who fits them.
            widths: of the inputs and of each layer.
            activation: of the hidden layers.
            scales: what inputs and target are divided by.
        """
        self._weights, self._gradient, self._widths = weights, gradient, widths
        self._activation = activation
        self._input_scale, self._target_scale = scales
        self._matrices = _matrices(weights, widths), _matrices(gradient, widths)
        self._one = self._layers(_ones(1, widths[0] + 1))  # predicts a single value
        self._rooms = {1: self._one}  # by the number of rows; of few, which are asked for often
        self.fitted = False  # whether the weights know of a fit

    def predict(self, inputs: Vector) -> Vector:
        """The value of one input (k,) or of many (..., k); the result drops the last axis."""
        *shape, k = inputs.shape
        rows = inputs.reshape(-1, k)
        layers = self._room(len(rows))
        layers[0].x.numpy()[:, :-1] = rows / self._input_scale
        value = _forward(layers, self._activation[0]).numpy().astype(float)
        return value.reshape(shape) * self._target_scale

    def _room(self, rows: int) -> "Layers":
        """Layers for so many rows, which are kept if they are small: to make them takes longer."""
        if rows in self._rooms:
            return self._rooms[rows]
        layers = self._layers(_ones(rows, self._widths[0] + 1))
        if rows <= KEPT:
            self._rooms[rows] = layers
        return layers

    def _layers(self, x: Tensor) -> "Layers":
        """The three layers, with room for the rows of `x`."""
        (W1, W2, W3), (dW1, dW2, dW3) = self._matrices
        first = _Layer(x, W1, dW1)
        second = _Layer(first.y, W2, dW2)
        return first, second, _Layer(second.y, W3, dW3)


class QNetwork(Predictor):
    """Inputs - 64 - 64 - 1 with ReLU, trained by Adam on a growing replay buffer: Eq. (10).

    Learns in place. Activation, initialisation (torch's own), no normalisation, an unlimited buffer
    and one mini-batch a step are this package's reading: the paper names none, and the options
    read it otherwise.  # departure H

    Backpropagation is written out, in place and without autograd: on matrices this small, modules
    and `torch.optim` take longer than the arithmetic.
    """

    def __init__(
        self,
        inputs: int,
        rng: np.random.Generator,
        learning_rate: float = 1e-2,
        batch: int = 128,
        hidden: int = 64,
        capacity: int = 1024,
        *,
        activation: str = "relu",
        memory: int | None = None,
        scales: tuple[Vector | float, float] = (1.0, 1.0),
    ) -> None:
        """Draw the weights and make room.

        Args:
            inputs: length of an input vector; 5 for (s, a), 14 for (s, a, theta) of the robot.
            rng: draws the weights and the mini-batches; torch's global generator is left alone.
            learning_rate: zeta, of Adam.
            batch: n, the size of a mini-batch; no fit before the buffer holds as many.
            hidden: neurons in each of the two hidden layers.
            capacity: room in the buffer at the start; it doubles when full.
            activation: of the hidden layers, "relu" or "tanh".
            memory: how many of the latest examples are kept; all by default.
            scales: what inputs (one number, or one each) and target are divided by inside.
        """
        if activation not in ACTIVATIONS:
            raise ValueError(f"activation = {activation!r} must be one of {', '.join(ACTIVATIONS)}")
        if memory is not None and memory < batch:
            raise ValueError(f"memory = {memory} must hold at least a batch of {batch}")
        self._memory = memory or sys.maxsize
        self._rng = rng
        self._learning_rate = learning_rate
        self._buffer = np.ones((capacity, inputs + 2), np.float32)  # rows of input, 1, target
        self._seen = 0  # examples so far
        self._drawn = np.ones((batch, inputs + 2), np.float32)  # the rows of a fit
        widths = (inputs, hidden, hidden, 1)
        weights = _first_weights(widths, seed=int(rng.integers(2**63)))
        gradient, self._mean, self._square = torch.zeros(3, len(weights), dtype=torch.float32)
        self._fits = torch.zeros((), dtype=torch.float32)
        super().__init__(weights, gradient, widths, ACTIVATIONS[activation], scales)
        self._batch = self._layers(torch.from_numpy(self._drawn[:, :-1]))  # looks at those rows

    def __len__(self) -> int:
        """How many examples are remembered."""
        return min(self._seen, self._memory)

    @property
    def ready(self) -> bool:
        """Whether the buffer holds a mini-batch, line 12 of Algorithm 1."""
        return self._seen >= len(self._drawn)

    def remember(self, inputs: Vector, target: float) -> None:
        """Store one example; `inputs` has the length given at the start."""
        at = self._seen % self._memory
        if at == len(self._buffer):
            self._buffer = np.concatenate([self._buffer, np.ones_like(self._buffer)])
        row = self._buffer[at]
        row[:-2], row[-1] = inputs / self._input_scale, target / self._target_scale
        self._seen += 1

    def fit(self) -> float:
        """One Adam step on a mini-batch drawn without replacement; its loss before the step."""
        batch = len(self._drawn)
        if not self.ready:
            raise ValueError(f"{len(self)} examples are too few for a batch of {batch}")
        rows = self._rng.choice(len(self), batch, replace=False)
        self._buffer.take(rows, axis=0, out=self._drawn, mode="clip")
        activate, slope = self._activation
        error = _forward(self._batch, activate).numpy() - self._drawn[:, -1:]
        _backward(self._batch, slope, torch.from_numpy(2 / batch * error))
        self._descend()
        self.fitted = True
        return float(np.vdot(error, error)) / batch * self._target_scale**2

    def _descend(self) -> None:
        """Adam: the kernel under torch.optim.Adam(fused=True), whose way there takes 100 us."""
        self._fits += 1
        torch._fused_adam_(
            [self._weights],
            [self._gradient],
            [self._mean],
            [self._square],
            [],
            [self._fits],
            lr=self._learning_rate,
            beta1=0.9,
            beta2=0.999,
            eps=1e-8,
            weight_decay=0.0,
            amsgrad=False,
            maximize=False,
        )


class Target(Predictor):
    """A copy of a network that predicts in its place, and follows it.

    It begins with the network's first weights, as in Mnih et al. (2015), and every so many steps
    goes a part of the way to its present ones.  # departure I
    """

    def __init__(self, network: QNetwork, *, every: int = 1, rate: float = 1.0) -> None:
        """Copy the weights.

        Args:
            network: which is followed.
            every: how many calls of `follow` move the copy once.
            rate: the part of the way; 1 for all of it.
        """
        weights, scales = network._weights.clone(), (network._input_scale, network._target_scale)
        gradient = torch.zeros_like(weights)
        super().__init__(weights, gradient, network._widths, network._activation, scales)
        self._network, self._every, self._rate, self._steps = network, every, rate, 0

    def follow(self) -> None:
        """Count a step in which the network was fitted, and move where it is time."""
        self._steps += 1
        if self._steps % self._every == 0:
            self._weights.lerp_(self._network._weights, self._rate)
            self.fitted = self._network.fitted


class _Layer:
    """out = x W for many rows x at once; each ends in a one, so that W ends in the bias."""

    def __init__(self, x: Tensor, W: Tensor, dW: Tensor) -> None:
        """Make room and every view: a view made at each use would take as long as its use.

        Args:
            x: rows, shape (rows, in + 1); the `y` of the layer before.
            W: weights, shape (in + 1, out).
            dW: where `differentiate` leaves the loss's derivative in W.
        """
        self.x, self.W, self.dW = x, W, dW
        self.y = _ones(len(x), W.shape[1] + 1)
        self.out = self.y[:, :-1]
        self._x_transposed, self._W_transposed = x.T, W[:-1].T

    def forward(self) -> Tensor:
        """Compute `out` from `x`."""
        return torch.mm(self.x, self.W, out=self.out)

    def backward(self, d: Tensor) -> Tensor:
        """The loss's derivative in x, from d, that in `out`."""
        return torch.mm(d, self._W_transposed)

    def differentiate(self, d: Tensor) -> None:
        """Compute `dW` from d, the loss's derivative in `out`."""
        torch.mm(self._x_transposed, d, out=self.dW)


Layers = tuple[_Layer, _Layer, _Layer]


def _forward(layers: Layers, activate: Callable[[Tensor], Tensor]) -> Tensor:
    first, second, third = layers
    activate(first.forward())
    activate(second.forward())
    return third.forward()


def _backward(layers: Layers, slope: Callable[[Tensor], Tensor], d3: Tensor) -> None:
    """Compute every layer's `dW` from d3, the loss's derivative in the output."""
    first, second, third = layers
    d2 = third.backward(d3).mul_(slope(second.out))
    d1 = second.backward(d2).mul_(slope(first.out))
    for layer, d in zip(layers, (d1, d2, d3), strict=True):
        layer.differentiate(d)


def _ones(*shape: int) -> Tensor:
    """In single precision, whatever a program has made torch's default."""
    return torch.ones(shape, dtype=torch.float32)


def _first_weights(widths: tuple[int, ...], seed: int) -> Tensor:
    """What torch draws for linear layers of these widths, in one vector."""
    with DRAWING, torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        layers = [torch.nn.Linear(*pair, dtype=torch.float32) for pair in pairwise(widths)]
    matrices = [torch.cat([layer.weight.T, layer.bias[None]]) for layer in layers]
    return torch.cat([matrix.flatten() for matrix in matrices]).detach()


def _matrices(vector: Tensor, widths: tuple[int, ...]) -> list[Tensor]:
    """The parts of a vector of all weights, as one matrix (in + 1, out) a layer."""
    shapes = [(k + 1, out) for k, out in pairwise(widths)]
    parts = vector.split([rows * columns for rows, columns in shapes])
    return [part.view(shape) for part, shape in zip(parts, shapes, strict=True)]

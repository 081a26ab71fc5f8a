"""The network that imitates the NMPC's value. The only home of torch."""

import sys
import threading
from collections.abc import Callable, Iterable
from copy import deepcopy
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor

from nmpcrl import Vector

KEPT = 256  # rows: room for more predictions at once is made anew
DRAWING = threading.Lock()  # torch draws first weights from one generator a process


def _tanh_slope(y: Tensor, out: Tensor) -> Tensor:
    return torch.mul(y, y, out=out).neg_().add_(1)


# In place, and its slope from what it made, put into `out`; that of a ReLU is its output's sign.
Activation = tuple[Callable[[Tensor], Tensor], Callable[..., Tensor]]
ACTIVATIONS: dict[str, Activation] = {
    "relu": (Tensor.relu_, torch.sign),
    "tanh": (Tensor.tanh_, _tanh_slope),
}


class OneThread:
    """Within it torch computes with one thread; after it, with as many as the program had chosen.

    More threads make matrices this small slower, and may change last bits.
    """

    def __enter__(self) -> None:
        self._before = torch.get_num_threads()
        torch.set_num_threads(1)

    def __exit__(self, *_: object) -> None:
        torch.set_num_threads(self._before)


class Predictor:
    """What some weights predict: inputs - 64 - 64 - 1."""

    _views: tuple[str, ...] = ("_matrices", "_rooms")  # of the weights, and made anew in a copy

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
        self.fitted = False  # whether the weights know of a fit
        self._view()

    def _view(self) -> None:
        """Make what looks at the weights."""
        self._matrices = [_matrices(one, self._widths) for one in (self._weights, self._gradient)]
        self._rooms = dict[int, _Room]()  # by the number of rows; of few, which are asked for often

    def __getstate__(self) -> dict[str, Any]:
        """All but the views, which would look at the original."""
        return {name: value for name, value in vars(self).items() if name not in self._views}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._view()

    def predict(self, inputs: Vector) -> Vector:
        """The value of one input (k,) or of many (..., k); the result drops the last axis."""
        *shape, k = inputs.shape
        rows = inputs.reshape(-1, k)
        room = self._room(len(rows))
        np.divide(rows, self._input_scale, out=room.inputs, casting="same_kind")
        with OneThread():
            room.forward()
        return room.values.astype(float).reshape(shape) * self._target_scale

    def _room(self, rows: int) -> "_Room":
        """Room for so many rows, which is kept if they are few: to make it takes longer."""
        if rows in self._rooms:
            return self._rooms[rows]
        room = self._room_of(_ones(rows, self._widths[0] + 1))
        if rows <= KEPT:
            self._rooms[rows] = room
        return room

    def _room_of(self, x: Tensor) -> "_Room":
        """The three layers, with room for the rows of `x`."""
        return _Room(x, zip(*self._matrices, strict=True), self._activation)


class QNetwork(Predictor):
    """Inputs - 64 - 64 - 1 with ReLU, trained by Adam on a growing replay buffer: Eq. (10).

    Learns in place; a copy, or what is read from a pickle, goes on as the original would.
    Activation, initialisation (torch's own), no normalisation, an unlimited buffer and one
    mini-batch a step are this package's reading: the paper names none, and the options read it
    otherwise.  # departure H

    Backpropagation is written out, in place and without autograd: on matrices this small, modules
    and `torch.optim` take longer than the arithmetic.
    """

    _views = (*Predictor._views, "_count", "_batch", "_targets", "_error")

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

    def _view(self) -> None:
        super()._view()
        self._count = self._fits.numpy()  # that very number
        self._batch = self._room_of(torch.from_numpy(self._drawn[:, :-1]))  # looks at those rows
        self._targets = self._drawn[:, -1:]
        self._error = np.empty_like(self._targets)

    def __copy__(self) -> "QNetwork":
        """A deep one: two networks cannot learn in the same weights."""
        return deepcopy(self)

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
        with OneThread():
            self._batch.forward()
            error = np.subtract(self._batch.values, self._targets, out=self._error)
            np.multiply(2 / batch, error, out=self._batch.slopes)
            self._batch.backward()
            self._descend()
        self.fitted = True
        return float(np.vdot(error, error)) / batch * self._target_scale**2

    def _descend(self) -> None:
        """Adam: the kernel under torch.optim.Adam(fused=True), whose way there takes 100 us."""
        self._count += 1
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
        self.d, self._slope = torch.empty(2, *self.out.shape, dtype=torch.float32)
        self._x_transposed, self._W_transposed = x.T, W[:-1].T

    def forward(self) -> Tensor:
        """Compute `out` from `x`."""
        return torch.mm(self.x, self.W, out=self.out)

    def backward(self, before: "_Layer", slope: Callable[..., Tensor]) -> None:
        """Compute the `d` of the layer before, where `d` is the loss's derivative in `out`."""
        torch.mm(self.d, self._W_transposed, out=before.d)
        before.d.mul_(slope(before.out, out=before._slope))

    def differentiate(self) -> None:
        """Compute `dW` from `d`."""
        torch.mm(self._x_transposed, self.d, out=self.dW)


class _Room:
    """The layers for some rows, and what NumPy sees of them."""

    def __init__(
        self, x: Tensor, matrices: Iterable[tuple[Tensor, Tensor]], activation: Activation
    ) -> None:
        """Make room.

        Args:
            x: the rows.
            matrices: W and dW of each layer.
            activation: of all layers but the last.
        """
        self._activate, self._slope = activation
        self._layers: list[_Layer] = []
        for W, dW in matrices:
            self._layers.append(_Layer(x, W, dW))
            x = self._layers[-1].y
        self._pairs = [*pairwise(self._layers)]
        first, last = self._layers[0], self._layers[-1]
        self.inputs, self.values = first.x.numpy()[:, :-1], last.out.numpy()
        self.slopes = last.d.numpy()  # the loss's derivative in the values

    def forward(self) -> None:
        """Compute `values` from `inputs`."""
        *hidden, last = self._layers
        for layer in hidden:
            self._activate(layer.forward())
        last.forward()

    def backward(self) -> None:
        """Compute every layer's `dW` from `slopes`."""
        for before, layer in reversed(self._pairs):
            layer.backward(before, self._slope)
        for layer in self._layers:
            layer.differentiate()


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

"""The network that imitates the NMPC's value: its arrays, and torch's definition of the same."""

import threading
from copy import deepcopy
from functools import cache
from importlib.resources import files
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control.codegen.jit import load

if TYPE_CHECKING:
    from torch import Tensor, nn, optim

TEXT = files(__package__).joinpath("dense.py").read_text("utf-8")
NOTICE = "Compiling the network (once on this machine, a few seconds) ..."
COMPILED = """from numba import njit

from . import dense

entries = remember, fit, predict, follow = [
    njit(signature, cache=True, **dense.options)(function.py_func)
    for function, signature in dense.ENTRIES
]
"""
ACTIVATIONS = ("relu", "tanh")
WEIGHTS, EXAMPLES, ORDER, COUNTS, DRAW, SCALES, RATE, SIZES = range(8)  # in a network's tuple
UNLIMITED = 2**62  # examples
DRAWING = threading.Lock()  # torch draws first weights from one generator a process


def in_torch(inputs: int, hidden: int = 64, activation: str = "relu") -> "nn.Sequential":
    """The network in torch, with new weights."""
    from torch import float32, nn

    between = {"relu": nn.ReLU, "tanh": nn.Tanh}[activation]
    first = nn.Linear(inputs, hidden, dtype=float32)
    second = nn.Linear(hidden, hidden, dtype=float32)
    third = nn.Linear(hidden, 1, dtype=float32)
    return nn.Sequential(first, between(), second, between(), third, nn.Flatten(0))


def fit_in_torch(model: "nn.Module", adam: "optim.Adam", x: "Tensor", q: "Tensor") -> float:
    """One step of Adam on a mini-batch of inputs x and targets q, Eq. (10); the loss before it."""
    loss = ((model(x) - q) ** 2).mean()
    adam.zero_grad()
    loss.backward()
    adam.step()
    return float(loss.detach())


def weights_of(model: "nn.Sequential") -> NDArray[np.float32]:
    """All weights of the network in torch, in the order of `dense`."""
    arrays = [each.numpy() for each in model.state_dict().values()]
    pairs = zip(arrays[::2], arrays[1::2], strict=True)
    return np.concatenate([np.vstack([weight.T, bias]).ravel() for weight, bias in pairs])


def _first_weights(inputs: int, hidden: int, seed: int) -> NDArray[np.float32]:
    """The weights that torch draws after `torch.manual_seed(seed)`."""
    import torch

    with DRAWING, torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return weights_of(in_torch(inputs, hidden))


@cache
def machine_code() -> ModuleType:
    """The functions of `dense`, compiled."""
    return load("network", {"__init__": COMPILED, "dense": TEXT}, NOTICE)


class Predictor:
    """Weights that predict a value."""

    net: tuple[Any, ...]  #: the arrays of `dense`

    @property
    def weights(self) -> NDArray[np.float32]:
        """The weights of all layers in one vector, which may be written to."""
        weights: NDArray[np.float32] = self.net[WEIGHTS][0]
        return weights

    @property
    def fitted(self) -> bool:
        """Whether the weights have seen a fit."""
        return bool(self.net[COUNTS][1])

    @property
    def inputs(self) -> int:
        """The length of an input vector."""
        return len(self.net[SCALES]) - 1

    def predict(self, inputs: Vector) -> Vector:
        """The value of one input (k,) or of many (..., k); the result drops the last axis."""
        rows = self._rows(inputs)
        values = np.empty(len(rows))
        machine_code().predict(self.net, rows, values)
        return values.reshape(inputs.shape[:-1])

    def _rows(self, inputs: Vector) -> Matrix:
        """Inputs as a matrix with one row each."""
        if inputs.shape[-1] != self.inputs:
            raise ValueError(f"inputs of length {inputs.shape[-1]} must have length {self.inputs}")
        return np.ascontiguousarray(inputs, float).reshape(-1, self.inputs)


class QNetwork(Predictor):
    """Inputs - 64 - 64 - 1 with ReLU, trained by Adam on a growing replay buffer: Eq. (10).

    `in_torch` and `fit_in_torch` define it; `dense` computes the same several times as fast. It
    learns in place. A copy, or one from a pickle, continues with the bits of the original.
    Activation, initialisation (torch's own), no normalisation, an unlimited buffer and one
    mini-batch a step are this package's reading: the paper names none, and the options read it
    otherwise.  # departure H
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
            rng: draws two seeds, of the weights and of the mini-batches.
            learning_rate: zeta, of Adam.
            batch: n, the size of a mini-batch; no fit before the buffer holds as many.
            hidden: neurons in each of the two hidden layers.
            capacity: examples for which there is room at the start; it doubles when full.
            activation: of the hidden layers, "relu" or "tanh".
            memory: how many of the latest examples are kept; all by default.
            scales: divisors of the inputs (one number, or one each) and of the target.
        """
        if activation not in ACTIVATIONS:
            raise ValueError(f"activation = {activation!r} must be one of {', '.join(ACTIVATIONS)}")
        if memory is not None and memory < batch:
            raise ValueError(f"memory = {memory} must hold at least a batch of {batch}")
        seed, draw = (int(rng.integers(2**63)) for _ in range(2))
        first = _first_weights(inputs, hidden, seed)
        self.net = (
            np.stack([first, *np.zeros((3, len(first)), np.float32)]),
            np.zeros((capacity, inputs + 1), np.float32),
            np.zeros(capacity, np.int32),
            np.zeros(2, np.int64),
            np.array([draw], np.uint64),
            np.append(np.broadcast_to(scales[0], inputs), scales[1]).astype(float),
            float(learning_rate),
            np.array([hidden, batch, memory or UNLIMITED, activation == "tanh"], np.int64),
        )

    def __copy__(self) -> "QNetwork":
        """A deep one: two networks cannot learn in the same weights."""
        return deepcopy(self)

    def __len__(self) -> int:
        """How many examples are remembered."""
        return int(min(self.net[COUNTS][0], self.net[SIZES][2]))

    @property
    def ready(self) -> bool:
        """Whether the buffer holds a mini-batch, line 12 of Algorithm 1."""
        return len(self) >= int(self.net[SIZES][1])

    def reserve(self, count: int) -> None:
        """Make room in `net` for so many further examples."""
        weights, examples, order, counts, *rest = self.net
        needed = min(counts[0] + count, rest[-1][2])
        while len(order) < needed:
            examples, order = (np.concatenate([each, each]) for each in (examples, order))
        self.net = (weights, examples, order, counts, *rest)

    def remember(self, inputs: Vector, target: float) -> None:
        """Store one example."""
        (row,) = self._rows(inputs)
        self.reserve(1)
        machine_code().remember(self.net, row, target)

    def fit(self) -> float:
        """One Adam step on a mini-batch drawn without replacement; its loss before the step."""
        if not self.ready:
            batch = self.net[SIZES][1]
            raise ValueError(f"{len(self)} examples are too few for a batch of {batch}")
        return float(machine_code().fit(self.net))


class Target(Predictor):
    """A copy of a network that predicts in its place, and follows it.

    It begins with the network's first weights, as in Mnih et al. (2015).  # departure I
    """

    def __init__(self, network: QNetwork, *, every: int = 1, rate: float = 1.0) -> None:
        """At each `every`-th call of `follow` it moves the part `rate` of the way to `network`."""
        weights, examples, order, counts, *rest = network.net
        empty = (examples[:0].copy(), order[:0].copy(), np.zeros_like(counts))
        self.net = (weights[:1].copy(), *empty, *rest)
        self.network, self.every, self.rate = network, every, rate

    def follow(self) -> None:
        """Count a step in which the network was fitted, and move where it is time."""
        machine_code().follow(self.net, self.network.net, self.every, self.rate)

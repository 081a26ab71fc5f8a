"""The network that imitates the NMPC's value. The only home of torch."""

import numpy as np
import torch

from nmpcrl import Vector

torch.set_num_threads(1)  # matrices this small only get slower with more


class QNetwork:
    """Inputs - 64 - 64 - 1 with ReLU, trained by Adam on a growing replay buffer: Eq. (10).

    Learns in place. Activation, initialisation (torch's own), no normalisation, an unlimited buffer
    and one mini-batch a step are this package's reading: the paper names none.  # departure H
    """

    def __init__(
        self,
        inputs: int,
        rng: np.random.Generator,
        learning_rate: float = 1e-2,
        batch: int = 128,
        hidden: int = 64,
        capacity: int = 1024,
    ) -> None:
        """Draw the weights and make room.

        Args:
            inputs: length of an input vector; 5 for (s, a), 14 for (s, a, theta) of the robot.
            rng: draws the weights and the mini-batches; torch's global generator is left alone.
            learning_rate: zeta, of Adam.
            batch: n, the size of a mini-batch; no fit before the buffer holds as many.
            hidden: neurons in each of the two hidden layers.
            capacity: room in the buffer at the start; it doubles when full.
        """
        self._rng = rng
        self._batch = batch
        self._size = 0
        self._inputs = torch.empty(capacity, inputs)
        self._targets = torch.empty(capacity, 1)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(int(rng.integers(2**63)))
            self._model = torch.nn.Sequential(
                torch.nn.Linear(inputs, hidden),
                torch.nn.ReLU(),
                torch.nn.Linear(hidden, hidden),
                torch.nn.ReLU(),
                torch.nn.Linear(hidden, 1),
            )
        self._adam = torch.optim.Adam(self._model.parameters(), lr=learning_rate, fused=True)
        self._loss = torch.nn.MSELoss()

    def __len__(self) -> int:
        """How many examples are remembered."""
        return self._size

    @property
    def ready(self) -> bool:
        """Whether the buffer holds a mini-batch: line 12 of Algorithm 1."""
        return self._size >= self._batch

    def remember(self, inputs: Vector, target: float) -> None:
        """Store one example; `inputs` has the length given at the start."""
        if self._size == len(self._targets):
            self._inputs = torch.cat([self._inputs, torch.empty_like(self._inputs)])
            self._targets = torch.cat([self._targets, torch.empty_like(self._targets)])
        self._inputs[self._size] = torch.from_numpy(inputs)
        self._targets[self._size] = target
        self._size += 1

    def fit(self) -> float:
        """One Adam step on a mini-batch drawn without replacement; its loss before the step."""
        if not self.ready:
            raise ValueError(f"{self._size} examples are too few for a batch of {self._batch}")
        drawn = torch.from_numpy(self._rng.choice(self._size, self._batch, replace=False))
        self._adam.zero_grad()
        loss = self._loss(self._model(self._inputs[drawn]), self._targets[drawn])
        loss.backward()
        self._adam.step()
        return loss.item()

    @torch.inference_mode()
    def predict(self, inputs: Vector) -> Vector:
        """The value of one input (k,) or of many (..., k); the result drops the last axis."""
        tensor = torch.as_tensor(inputs, dtype=torch.float32)
        return self._model(tensor).squeeze(-1).numpy().astype(float)

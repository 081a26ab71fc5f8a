"""Differences between the plant and the model: a `Fault`, and the `Body` that has it.

A fault is a map of the inputs, a drift, or noise of the measurement. A body without faults moves as
the paper's robot to the last bit. A lag is a state that the controller does not measure.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Plant, differential_drive
from nmpcrl.study.parameters import ParameterError

BASE = 0.5  # [m] between the wheels: the robot's diameter


@dataclass(frozen=True)
class Fault:
    """A difference between body and model; the defaults are the model.

    Raises:
        ParameterError: a share lies outside [0, 1], or a time or deviation below 0.
    """

    grip: float = 1.0  # share of the speed that arrives
    lag: float = 0.0  # [s], time constant of both inputs
    bias: float = 0.0  # [rad/s], added to the turn rate
    drift: tuple[float, float] = (0.0, 0.0)  # [m/s]
    slip: float = 0.0  # each wheel loses a share drawn from U(0, slip) for an episode
    noise: tuple[float, float, float] = (0.0, 0.0, 0.0)  # deviations of the measured state

    def __post_init__(self) -> None:
        if not (0 <= self.grip <= 1 and 0 <= self.slip <= 1):
            raise ParameterError(f"grip = {self.grip} and slip = {self.slip} must lie in [0, 1]")
        if self.lag < 0 or min(self.noise) < 0:
            raise ParameterError(f"lag = {self.lag} and noise = {self.noise} must be 0 or more")

    def draw(self, rng: np.random.Generator) -> "Body":
        """The body of an episode."""
        shares = 1 - rng.uniform(0, self.slip, 2) if self.slip else np.ones(2)
        return Body(self, wheels(*shares) @ np.diag([self.grip, 1.0]))

    @property
    def model(self) -> dict[str, Matrix]:
        """Gain, bias and drift before an episode, as parameters of a learned model."""
        mean = 1 - self.slip / 2
        gain = np.diag([mean * self.grip, mean])
        return {"gain": gain, "bias": np.array(self.bias), "drift": np.array(self.drift)}


NONE = Fault()
FAULTS: Mapping[str, Fault] = {
    "speed": Fault(grip=0.8),
    "lag": Fault(lag=0.4),
    "turn": Fault(bias=0.15),
    "drift": Fault(drift=(0.0, 0.08)),
    "slip": Fault(slip=0.4),
    "noise": Fault(noise=(0.05, 0.05, 0.05)),
}


def wheels(right: float, left: float) -> Matrix:
    """The matrix from given to actual (speed, turn rate), by the share that each wheel turns."""
    both, apart = (right + left) / 2, right - left
    return np.array([[both, apart * BASE / 4], [apart / BASE, both]])


class Body:
    """The robot of one episode, with the inputs that lag as a state."""

    def __init__(self, fault: Fault, gain: Matrix) -> None:
        """Begin at rest."""
        self._fault, self._gain, self._applied = fault, gain, np.zeros(2)
        self._follows = 1 - np.exp(-robot().period / fault.lag) if fault.lag else 1.0
        self._shift = robot().period * np.array([*fault.drift, 0.0])
        self._bias = np.array([0.0, fault.bias])

    def step(self, state: Vector, action: Vector) -> Vector:
        """The true state a period later."""
        if self._follows < 1:
            self._applied = self._applied + self._follows * (action - self._applied)
            action = self._applied
        return robot().step(state, self._gain @ action + self._bias) + self._shift

    def measure(self, state: Vector, rng: np.random.Generator) -> Vector:
        """The state with noise."""
        return state + rng.normal(0.0, self._fault.noise) if any(self._fault.noise) else state


@cache
def robot() -> Plant:
    """The paper's robot; its step is compiled once."""
    return differential_drive()

"""Differences between the plant and the model of the paper's robot."""

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
    """A difference between plant and model; `Fault()` steps as the robot does, to the last bit."""

    grip: float = 1.0  #: share of the speed that arrives
    lag: float = 0.0  #: [s], time constant of both inputs, whose state is not measured
    bias: float = 0.0  #: [rad/s], added to the turn rate
    drift: tuple[float, float] = (0.0, 0.0)  #: [m/s]
    slip: float = 0.0  #: each wheel loses a share drawn from U(0, slip) for an episode
    noise: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: deviations of the measured state

    def __post_init__(self) -> None:
        if not (0 <= self.grip <= 1 and 0 <= self.slip <= 1):
            raise ParameterError(f"grip = {self.grip} and slip = {self.slip} must lie in [0, 1]")
        if self.lag < 0 or min(self.noise) < 0:
            raise ParameterError(f"lag = {self.lag} and noise = {self.noise} must be 0 or more")

    def gain(self, rng: np.random.Generator) -> Matrix:
        """The matrix of an episode from given to actual (speed, turn rate)."""
        right, left = 1 - rng.uniform(0, self.slip, 2) if self.slip else np.ones(2)
        both, apart = (right + left) / 2, right - left
        wheels: Matrix = np.array([[both, apart * BASE / 4], [apart / BASE, both]])
        return wheels @ np.diag([self.grip, 1.0])

    def follow(self, before: Vector, action: Vector) -> Vector:
        """The inputs that lag behind an action, one period after `before`."""
        if not self.lag:
            return action
        share = float(1 - np.exp(-robot().period / self.lag))
        return before + share * (action - before)

    def step(self, state: Vector, inputs: Vector) -> Vector:
        """The state one period later, under actual inputs."""
        shift = robot().period * np.array([*self.drift, 0.0])
        return robot().step(state, inputs + np.array([0.0, self.bias])) + shift

    def measure(self, state: Vector, rng: np.random.Generator) -> Vector:
        """The state with noise."""
        return state + rng.normal(0.0, self.noise) if any(self.noise) else state

    @property
    def model(self) -> dict[str, Matrix]:
        """Gain, bias and drift in the mean over episodes, as parameters of a learned model."""
        mean = 1 - self.slip / 2
        gain = np.diag([mean * self.grip, mean])
        return {"gain": gain, "bias": np.array(self.bias), "drift": np.array(self.drift)}


NONE = Fault()
FAULTS: Mapping[str, Fault] = {
    "speed": Fault(grip=0.8), "lag": Fault(lag=0.4), "turn": Fault(bias=0.15),
    "drift": Fault(drift=(0.0, 0.08)), "slip": Fault(slip=0.4), "noise": Fault(noise=(0.05,) * 3),
}  # fmt: skip


@cache
def robot() -> Plant:
    """The paper's robot; its step is compiled once."""
    return differential_drive()

"""A controller that needs no solver: its value is linear in theta, so all has a closed form."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from nmpcrl.learning import Transition


@dataclass
class LinearController:
    """V_theta(s) = phi(s)' theta, and a plan that is easy to recognise."""

    gamma: float = 0.9
    calls: list = field(default_factory=list)  # (state, theta, guess) of every solve

    def solve(self, state, theta, guess=None, action=None):
        self.calls.append((state, theta, guess))
        phi = np.asarray(state, float)
        return SimpleNamespace(
            state=phi,
            theta=theta.copy(),
            value=float(phi @ theta),
            features=phi,
            action=np.array([0.1, 0.2]),
            next_action=np.array([0.3, 0.4]),
        )


@dataclass
class RecordingNetwork:
    """Keeps what it is told and answers `answer`."""

    batch: int = 3
    answer: float = 7.0
    remembered: list = field(default_factory=list)  # (inputs, target)
    asked: list = field(default_factory=list)
    fits: int = 0

    @property
    def ready(self):
        return len(self.remembered) >= self.batch

    def remember(self, inputs, target):
        self.remembered.append((inputs, target))

    def fit(self):
        assert self.ready
        self.fits += 1
        return 0.25

    def predict(self, inputs):
        self.asked.append(inputs)
        return np.array(self.answer)


@pytest.fixture
def controller() -> LinearController:
    """A linear value function with gamma = 0.9."""
    return LinearController()


@pytest.fixture
def network() -> RecordingNetwork:
    """A network that is ready after three examples and always answers 7."""
    return RecordingNetwork()


@pytest.fixture
def transition(controller):
    """From one state to another under a linear controller, as `train` would hand it over."""

    def build(theta, state=(1.0, 2.0, 3.0), after=(0.5, 0.0, -1.0), cost=4.0) -> Transition:
        state, after = np.array(state, float), np.array(after, float)
        solution = controller.solve(state, theta)
        controller.calls.clear()
        return Transition(state, np.array([-0.6, 1.0]), cost, after, solution)

    return build

"""Controllers and networks that need no solver: value, features and Hessian in closed form."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Ipopt, Nmpc, Parameter, Problem
from nmpcrl.learning import Transition, Weights
from nmpcrl.study import paper


@dataclass
class LinearController:
    """V_theta(s) = phi(s)' theta, and a plan that is easy to recognise."""

    gamma: float = 0.9
    calls: list = field(default_factory=list)  # (state, theta, warm_start, action) of every solve
    products: list = field(default_factory=list)  # (solution, vector) of every Hessian product
    curvature = 0.0  # of V in s'theta

    def solve(self, state, theta, warm_start=None, action=None):
        self.calls.append((state, theta, warm_start, action))
        state = np.asarray(state, float)
        return SimpleNamespace(
            state=state,
            theta=theta.copy(),
            value=self.value(state, theta),
            features=self.features(state, theta),
            action=np.array([0.1, 0.2]),
            next_action=np.array([0.3, 0.4]),
        )

    def value_hessian_times(self, solution, vector):
        self.products.append((solution, vector))
        return self.curvature * solution.state * (solution.state @ vector)

    def value(self, state, theta):
        return float(state @ theta)

    def features(self, state, theta):
        return state


class QuadraticController(LinearController):
    """V_theta(s) = (s' theta)^2: the simplest value that is curved in theta."""

    curvature = 2.0

    def value(self, state, theta):
        return float(state @ theta) ** 2

    def features(self, state, theta):
        return 2 * (state @ theta) * state


@dataclass
class RecordingNetwork:
    """Records its examples and predicts `answer`."""

    batch: int = 3
    answer: float = 7.0
    remembered: list = field(default_factory=list)  # (inputs, target)
    asked: list = field(default_factory=list)
    fits: int = 0

    @property
    def ready(self):
        return len(self.remembered) >= self.batch

    @property
    def fitted(self):
        return self.fits > 0

    def remember(self, inputs, target):
        self.remembered.append((inputs, target))

    def fit(self):
        assert self.ready
        self.fits += 1
        return 0.25 * self.fits

    def predict(self, inputs):
        self.asked.append(inputs)
        return np.array(self.answer)


controller = pytest.fixture(lambda: LinearController(), name="controller")
quadratic = pytest.fixture(lambda: QuadraticController(), name="quadratic")
network = pytest.fixture(lambda: RecordingNetwork(), name="network")


@pytest.fixture
def weights() -> Weights:
    """theta = (1, 0.5, -1) and w = (0.1, 0, 0.2)."""
    return Weights(np.array([1.0, 0.5, -1.0]), np.array([0.1, 0.0, 0.2]))


@pytest.fixture
def transition(controller):
    """From one state to another as `train` would hand it over; the controller is linear."""

    def build(theta, *, cost=4.0, controller=controller) -> Transition:
        state, after = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.0, -1.0])
        solution = controller.solve(state, theta)
        controller.calls.clear()
        return Transition(state, np.array([-0.6, 1.0]), cost, after, solution)

    return build


@pytest.fixture(scope="session")
def robot() -> Nmpc:
    """The paper's controller."""
    return paper.nmpc()


@pytest.fixture(scope="session")
def tank() -> Nmpc:
    """A level that is raised at the price of its stage; its gain is learned, within bounds."""
    problem = Problem(
        states=1, inputs=1, horizon=3, gamma=0.9, lower=-1, upper=1, data={"price": 0.1},
        theta={"gain": Parameter(0.5, 0.2, 0.6), "V0": Parameter(0.0, -10, 10)},
        model=lambda x, u, th, d: 0.9 * x + th["gain"] * u - 0.1 * x**2,
        stage=lambda x, u, th, d: ca.sumsqr(x - 1) + 0.1 * ca.sumsqr(u) + d["price"] * u,
        initial=lambda x, th, d: th["V0"],
    )  # fmt: skip
    return Nmpc(problem, solver=Ipopt())

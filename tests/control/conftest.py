"""The paper's controller with each solver, and drawn problems of it."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.study import paper

# Where theta is drawn from: around what learning visits, all of it positive.
THETA_LOW = np.array([0.3, 0.3, 0.02, 0.02, 0.02, 0.3, 0.3, 0.05, 0.0])
THETA_HIGH = np.array([2.0, 2.0, 0.5, 0.5, 0.5, 2.0, 2.0, 0.5, 0.4])
TIE = 1e-2  # a start this close to an obstacle's boundary has a kink within finite differences

Draw = Callable[..., Iterator[tuple[Vector, Vector]]]


@pytest.fixture(scope="session", params=SOLVERS)
def solver(request) -> str:
    """Each solver in turn."""
    return request.param


@pytest.fixture(scope="session")
def controllers() -> dict[str, Nmpc]:
    """The paper's controller with each solver."""
    return {name: paper.nmpc(solver=name) for name in SOLVERS}


@pytest.fixture
def robot(controllers, solver) -> Nmpc:
    """The paper's controller, with each solver in turn."""
    return controllers[solver]


@pytest.fixture
def fatrop(controllers) -> Nmpc:
    """The paper's controller with the default solver."""
    return controllers["fatrop"]


@pytest.fixture
def theta() -> Vector:
    """theta_init of Table I."""
    return np.array(paper.THETA_INIT)


@pytest.fixture
def draw() -> Draw:
    """Drawn (state, theta) of the robot, in the box and not on an obstacle's boundary."""

    def problems(count: int, seed: int) -> Iterator[tuple[Vector, Vector]]:
        rng, task = np.random.default_rng(seed), paper.task()
        while count:
            state = rng.uniform([-3, -3, -np.pi], [9, 9, np.pi])
            theta = rng.uniform(THETA_LOW, THETA_HIGH)
            if np.abs(task.overlap(state) + theta[-1]).min() > TIE:
                count -= 1
                yield state, theta

    return problems

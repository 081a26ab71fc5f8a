"""Short runs of learners, noise for them, and finite differences."""

from collections.abc import Callable
from typing import Any

import numpy as np

from nmpcrl.control import Nmpc
from nmpcrl.learning import Exploration, Learner, Step, Weights, train
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)


def noise(episodes: int, steps: int, inputs: int = 2, *, deviation: float = 1.0) -> Exploration:
    """Normal noise that does not decay."""
    shape, rng = (episodes, steps, inputs), np.random.default_rng(0)
    return Exploration.draw(rng, shape, deviation=deviation, decay_rate=1.0)


def run(learner: Learner, nmpc: Nmpc, explore: Exploration, **how: Any) -> list[Step]:
    """The steps of a run from THETA, or from the first theta of a `Problem`."""
    theta = THETA if nmpc.task else nmpc.problem.theta
    weights = Weights(theta, np.full(len(theta), paper.W_INIT))
    return list(train(learner, nmpc, weights, explore, **how))


def differences(function: Callable[[Any], Any], at: Any, h: float = 1e-4) -> Any:
    """Central differences, one row a component of `at`."""
    return np.array([(function(at + e) - function(at - e)) / (2 * h) for e in h * np.eye(len(at))])

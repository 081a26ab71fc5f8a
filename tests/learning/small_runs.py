"""Short runs of learners: the paper's first theta, noise, and the steps of `train` as a list."""

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

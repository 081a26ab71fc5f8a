"""The closed loop without noise, by which theta is judged."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc
from nmpcrl.learning.baselines import frozen
from nmpcrl.learning.environment import stream
from nmpcrl.learning.episode import episodes
from nmpcrl.learning.learners import Weights
from nmpcrl.learning.training import Exploration


@dataclass(frozen=True, eq=False)
class Rollout:
    """The closed loop from the start without noise."""

    states: Matrix  #: s_0, ..., s_K; fewer where it ended or failed, shape (<= K + 1, n)
    actions: Matrix  #: shape (<= K + 1, m)
    costs: Vector  #: RL stage costs, shape (<= K + 1,)
    failure: str = ""  #: what the solver said, if it failed, or where the plant went

    @property
    def cost(self) -> float:
        """Sum of the RL stage cost, t = 0, ..., K; infinite where the rollout failed."""
        return np.inf if self.failure else float(self.costs.sum())


def evaluate(
    controller: Nmpc,
    theta: Vector,
    steps: int,
    *,
    rng: np.random.Generator | int = 0,
    **environment: Any,
) -> Rollout:
    """Follow the policy of theta, Eq. (4), from the start and without noise.

    A failed solve, or a plant that runs away to where no plan can begin, ends the rollout, which
    then says so and costs infinitely much.

    Args:
        controller: as in `train`.
        theta: NMPC parameters, shape (d,).
        steps: K + 1, the most states that are visited.
        rng: as in `train`, but an int gives other numbers.
        environment: `plant`, `start` and `data`, as in `train`.
    """
    if not isinstance(controller, Nmpc):
        raise ValueError(f"controller = {controller!r} must be an Nmpc")
    silent = Exploration(np.zeros((1, steps, controller.m)))
    (found,) = episodes(
        frozen(controller), controller, Weights(theta), silent, rng=stream(rng, 2), **environment
    )
    acted = ~np.isnan(found.columns["action"]).any(axis=1)  # all but a failed solve
    states, actions, costs = (found.columns[name][acted] for name in ("state", "action", "cost"))
    return Rollout(states, actions, costs, found.failure)

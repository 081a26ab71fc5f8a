"""The closed loop without noise, by which theta is judged."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Plant, SolverError
from nmpcrl.control.policy import Data, forecasts
from nmpcrl.learning.environment import (
    GymnasiumEnv,
    StepFunction,
    environment,
    nmpc_of,
    stream,
    unusable,
)


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
    controller: Any,
    theta: Vector,
    steps: int,
    *,
    plant: Plant | StepFunction | GymnasiumEnv | None = None,
    start: Any = None,
    data: Data | None = None,
    rng: np.random.Generator | int = 0,
) -> Rollout:
    """Follow the policy of theta, Eq. (4), from the start and without noise.

    A failed solve, or a plant that runs away to where no plan can begin, ends the rollout, which
    then says so and costs infinitely much.

    Args:
        controller: acts: an `Nmpc`, or an object with `solve(state, theta, plan before)`, whose
            result has an `action`. One that holds an `Nmpc` has the environment of that by default.
        theta: NMPC parameters, shape (d,).
        steps: K + 1, the most states that are visited.
        plant: as in `train`, like `start`, `data` and `rng`, of which an int gives other numbers.
    """
    nmpc, rng = nmpc_of(controller), stream(rng, 2)
    around = environment(nmpc, plant, start, data)
    state, plan, failure = around.start(rng), None, ""
    states, actions, costs = [], [], []
    ahead = forecasts(data, nmpc.horizon if nmpc else 0)
    for t in range(steps):
        try:
            plan = controller.solve(state.copy(), theta, plan, **ahead(t))
        except SolverError as error:
            failure = str(error)
            break
        states.append(state)
        actions.append(np.array(plan.action, float))
        state, cost, end, cut = around.step(state, actions[-1], rng)
        costs.append(cost)
        failure = unusable(state, cost, nmpc, end=end)
        if failure or end or cut:
            break
    inputs = nmpc.m if nmpc else actions[0].size if actions else 0
    return Rollout(
        np.reshape(states, (-1, state.size)), np.reshape(actions, (-1, inputs)), np.array(costs),
        failure,
    )  # fmt: skip

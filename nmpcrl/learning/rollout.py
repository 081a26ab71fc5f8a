"""The closed loop without noise, by which theta is judged."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc, Plant, SolverError
from nmpcrl.learning.environment import (
    Data,
    GymnasiumEnv,
    StepFunction,
    environment,
    forecasts,
    ran_away,
)


@dataclass(frozen=True, eq=False)
class Rollout:
    """The closed loop from the start without noise."""

    states: Matrix  # s_0, ..., s_K; fewer where it ended or failed, shape (<= K + 1, n)
    actions: Matrix  # shape (<= K + 1, m)
    costs: Vector  # RL stage costs, shape (<= K + 1,)
    failure: str = field(default="")  # what the solver said, if it failed, or where the plant went

    @property
    def cost(self) -> float:
        """Sum of the RL stage cost, t = 0, ..., K; infinite where the rollout failed."""
        return np.inf if self.failure else float(self.costs.sum())


def nmpc_of(controller: Any) -> Nmpc | None:
    """The `Nmpc` that a controller is or has among its attributes; None where there is none."""
    near = [controller, *getattr(controller, "__dict__", {}).values()]
    return next((one for one in near if isinstance(one, Nmpc)), None)


def stream(rng: np.random.Generator | int, key: int) -> np.random.Generator:
    """A generator as it is; of an int one whose numbers `default_rng` of that int does not draw."""
    if isinstance(rng, int | np.integer):
        rng = np.random.SeedSequence(int(rng), spawn_key=(key,))  # type: ignore[assignment]
    return np.random.default_rng(rng)


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
        plant: the environment, as in `train`; the plant that plans if absent.
        start: a state or rng -> state; the task's if absent.
        data: of a `Problem` at each time, as in `train`.
        rng: for a plant or a start that draws, as in `train`, with other numbers of the same int.
    """
    nmpc, rng = nmpc_of(controller), stream(rng, 2)
    around = environment(nmpc, plant, start)
    state, plan, failure = around.start(rng), None, ""
    states, actions, costs = [], [], []
    ahead = forecasts(data, nmpc.horizon if nmpc else 0)
    for t in range(steps):
        known = {"data": ahead(t)} if ahead else {}
        try:
            plan = controller.solve(state.copy(), theta, plan, **known)
        except SolverError as error:
            failure = str(error)
            break
        states.append(state)
        actions.append(np.array(plan.action, float))
        state, cost, end, cut = around.step(state, actions[-1], rng)
        costs.append(cost)
        failure = ran_away(state, nmpc, end=end)
        if failure or end or cut:
            break
    inputs = nmpc.m if nmpc else actions[0].size if actions else 0
    return Rollout(
        states=np.reshape(states, (-1, state.size)),
        actions=np.reshape(actions, (-1, inputs)),
        costs=np.array(costs),
        failure=failure,
    )

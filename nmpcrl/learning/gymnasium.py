"""Our environments as Gymnasium's, for agents that know nothing of an NMPC."""

from typing import TYPE_CHECKING, Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.learning.environment import environment, state_of

if TYPE_CHECKING:
    from gymnasium import Env


def as_gymnasium(
    nmpc: Nmpc, *, plant: Any = None, start: Any = None, steps: int | None = None
) -> "Env[Vector, Vector]":
    """The environment of an NMPC as a `gymnasium.Env`, whose reward is minus the cost.

    `plant` and `start` are those of `train`; after `steps` an episode is truncated. Gymnasium comes
    with the extra `nmpcrl[gymnasium]`.
    """
    import gymnasium

    around = environment(nmpc, plant, start)
    box: Any = gymnasium.spaces.Box

    class NmpcEnv(gymnasium.Env[Vector, Vector]):
        """The start, the steps, the costs and the ends of `train`."""

        metadata = {"render_modes": []}  # noqa: RUF012 as Gymnasium has it

        def __init__(self) -> None:
            self.observation_space = box(-np.inf, np.inf, (nmpc.n,), float)
            self.action_space = box(nmpc.lower, nmpc.upper, dtype=float)

        def reset(
            self, *, seed: int | None = None, options: dict[str, Any] | None = None
        ) -> tuple[Vector, dict[str, Any]]:
            super().reset(seed=seed)
            self.state, self.time = around.start(self.np_random), 0
            return self.state.copy(), {}

        def step(self, action: Vector) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
            given = np.array(action, float).reshape(nmpc.m)
            later, cost, end, cut = around.step(self.state, given, self.np_random)
            self.state = state_of("plant returned", later, nmpc.n)
            self.time += 1
            return self.state.copy(), -cost, end, cut or self.time == steps, {}

    return NmpcEnv()

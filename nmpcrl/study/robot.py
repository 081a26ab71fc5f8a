"""The paper's robot as a task for Gymnasium.

`Policy(paper.nmpc(layout), paper.THETA_INIT)` acts by the first three observations.
"""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from nmpcrl import Vector
from nmpcrl.study import geometry, paper
from nmpcrl.study.drawn import TUNE
from nmpcrl.study.faults import robot
from nmpcrl.study.geometry import FARTHEST, Centres
from nmpcrl.study.moving import Motion, centres, charge, still
from nmpcrl.study.parameters import refused, whole


def centres_of(layout: Any) -> Centres:
    """The centres [m] of a layout of the paper, of `TUNE`, or in any other form."""
    return geometry.centres_of(layout, paper.LAYOUTS | TUNE, "A to F and T01 to T60")


class RobotEnv(gymnasium.Env[Vector, Vector]):
    """`nmpcrl/Robot-v0`: go to the target and around the obstacles of a layout.

    Observed are x [m], y [m], heading [rad], and the centres x, y of each obstacle [m]. The reward
    is minus Eq. (20). An episode never terminates. Only layouts are drawn, so the same actions in
    the same layout give the same rewards.
    """

    def __init__(
        self, layout: Any = None, *, motions: Sequence[Motion] = (), steps: int = paper.STEPS
    ) -> None:
        """Choose the layout and the number of steps after which an episode is truncated.

        A layout is A to F, T01 to T60, or centres; by default each reset draws one of `TUNE`. With
        `motions`, the layout has their first centres.
        """
        self.plant, self._steps = robot(), whole(1, 10_000).check("steps", steps)
        self._fixed, self._motions = None if layout is None else centres_of(layout), motions
        first = self._fixed or next(iter(TUNE.values()))
        speed, turn = self.plant.upper * self.plant.period * steps
        reach = np.r_[speed, speed, turn, np.full(2 * len(first), FARTHEST)]
        middle = np.r_[paper.START, np.zeros(2 * len(first))]
        self.observation_space = Box(middle - reach, middle + reach, dtype=np.float64)
        self.action_space = Box(self.plant.lower, self.plant.upper, dtype=np.float64)
        self.task = paper.task(first)
        self.states: list[Vector] = []  # of the episode so far

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, dict[str, Any]]:
        """Begin an episode; `options={"layout": ...}` chooses a layout of as many obstacles."""
        super().reset(seed=seed)
        asked = (options or {}).get("layout")
        layout = self._fixed if asked is None else centres_of(asked)
        if layout is None:
            layout = TUNE[str(self.np_random.choice([*TUNE]))]
        count = len(self.task.obstacles)
        if len(layout) != count:
            raise refused("layout", asked, f"one of {count} obstacles, which are observed")
        self.task = paper.task(layout)
        self.states = [self.task.start]
        self._at = centres(self._motions or still(layout), np.arange(self._steps + 1))
        return self._observation(), {"layout": layout}

    def step(self, action: Vector) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Move for one period; an action outside the bounds is clipped."""
        if not self.states or len(self.states) > self._steps:
            raise gymnasium.error.ResetNeeded("call reset first: no episode goes on")
        given = np.asarray(action, float)
        if given.shape != (self.plant.m,) or not np.isfinite(given).all():
            raise refused("action", action, "two finite numbers, speed and turn rate")
        state, applied = self.states[-1], self.plant.clip(given)
        cost = charge(state, applied, self._at[len(self.states) - 1])
        self.states.append(self.plant.step(state, applied))
        over = len(self.states) > self._steps
        distance = self.task.distance(self.states[-1])
        return self._observation(), -cost, False, over, {"distance": distance}

    def _observation(self) -> Vector:
        return np.concatenate([self.states[-1], self._at[len(self.states) - 1].ravel()])

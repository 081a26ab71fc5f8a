"""The tuning of the NMPC as a task for Gymnasium, `nmpcrl/Tune-v0`: one episode a step.

An action is a change of theta; the step is a rollout of the robot without noise under the changed
theta. Observed are theta, the centres of the obstacles and the cost of the last rollout. The reward
is minus that cost, in parts of theta_init's.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from nmpcrl import Vector
from nmpcrl.analysis.policy_search import LOWER, SCALE, UPPER
from nmpcrl.learning.rollout import Persistent, evaluate
from nmpcrl.study import paper
from nmpcrl.study.geometry import FARTHEST
from nmpcrl.study.parameters import refused, whole
from nmpcrl.study.population import TUNE
from nmpcrl.study.robot import centres_of, task_of

ROLLOUTS = 50  # of an episode, that of theta_init included
MOST_ROLLOUTS = 10_000
CHANGE = 0.1  # of theta at most, in `SCALE`s a step
WORST = 10.0  # what a rollout counts at most, in parts of theta_init's; a failed one counts it


class TuneEnv(gymnasium.Env[Vector, Vector]):
    """`nmpcrl/Tune-v0`: lower the cost of the robot by changing theta."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self, layout: Any = None, *, rollouts: int = ROLLOUTS, render_mode: str | None = None
    ) -> None:
        """Choose the layout.

        Args:
            layout: as `RobotEnv` takes it.
            rollouts: an episode is truncated after so many, of which theta_init's is the first.
            render_mode: None.

        Raises:
            ParameterError: an argument is not what it may be.
        """
        if render_mode is not None:
            raise refused("render_mode", render_mode, "None: there is nothing to see")
        self.render_mode = None
        self._rollouts = whole(2, MOST_ROLLOUTS).check("rollouts", rollouts)
        self._fixed = None if layout is None else centres_of(layout)
        walls = np.full(2 * len(self._fixed or next(iter(TUNE.values()))), FARTHEST)
        self.observation_space = Box(
            np.r_[LOWER / SCALE, -walls, 0.0], np.r_[UPPER / SCALE, walls, WORST], dtype=np.float64
        )
        self.action_space = Box(-1.0, 1.0, SCALE.shape, np.float64)
        self.theta, self._made = np.array(paper.THETA_INIT), 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, dict[str, Any]]:
        """Begin with theta_init, and with a rollout of it."""
        super().reset(seed=seed)
        drawn = TUNE[str(self.np_random.choice([*TUNE]))] if self._fixed is None else self._fixed
        self._centres = drawn
        self._controller = Persistent(paper.controller(task_of(drawn)))
        self.theta, self._made = np.array(paper.THETA_INIT), 0
        self._initial = self._rollout()
        return self._observation(1.0), {"layout": drawn, "cost": self._initial, "rollouts": 1}

    def step(self, action: Vector) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Change theta, within the box of the searches, and make a rollout.

        Raises:
            gymnasium.error.ResetNeeded: no episode has begun, or its rollouts are made.
            ParameterError: the action is not nine finite numbers.
        """
        if not 0 < self._made < self._rollouts:
            raise gymnasium.error.ResetNeeded("call reset first: no episode goes on")
        given = np.asarray(action, float)
        if given.shape != SCALE.shape or not np.isfinite(given).all():
            raise refused("action", action, f"{SCALE.size} finite numbers, one a parameter")
        change = CHANGE * np.clip(given, -1, 1) * SCALE
        self.theta = np.clip(self.theta + change, LOWER, UPPER)
        cost = self._rollout()
        part = min(cost / self._initial, WORST)
        info = {"cost": cost, "theta": self.theta.copy(), "rollouts": self._made}
        return self._observation(part), -part, False, self._made == self._rollouts, info

    def _rollout(self) -> float:
        self._made += 1
        return evaluate(self._controller, self.theta, paper.STEPS).cost

    def _observation(self, part: float) -> Vector:
        return np.concatenate([self.theta / SCALE, np.ravel(self._centres), [part]])

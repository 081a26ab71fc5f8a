"""The paper's robot as a task for Gymnasium, `nmpcrl/Robot-v0`, and the NMPC as its policy.

Observed are the pose of the robot and the centres of the obstacles. The reward is minus Eq. (20).
An episode never terminates; it is truncated after K + 1 = 130 steps. Only layouts are drawn, so the
same actions in the same layout give the same rewards.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from nmpcrl import Matrix, Vector
from nmpcrl.control import Solution, Task
from nmpcrl.learning.rollout import Persistent
from nmpcrl.study import geometry, paper
from nmpcrl.study.drawn import TUNE
from nmpcrl.study.faults import robot
from nmpcrl.study.geometry import FARTHEST, Centres
from nmpcrl.study.moving import Motion, centres, charge
from nmpcrl.study.parameters import ParameterError, refused, whole

NAMED = paper.LAYOUTS | TUNE  # layouts by name, without those to judge on
STEPS = whole(1, 10_000)  # of an episode
MODES = (None, "rgb_array")
FRAMES = 10  # a second

task_of = lru_cache(maxsize=256)(paper.task_among)  # the cost of a task is compiled


def centres_of(layout: Any) -> Centres:
    """The centres of a layout's obstacles [m].

    Raises:
        ParameterError: the layout is neither one of `NAMED` nor centres of obstacles.
    """
    try:
        return geometry.centres_of(layout, NAMED)
    except ParameterError:
        text = f"one of A to F and T01 to T60, or {geometry.CENTRES}"
        raise refused("layout", layout, text) from None


class RobotEnv(gymnasium.Env[Vector, Vector]):
    """`nmpcrl/Robot-v0`: go to the target and around the obstacles of a layout.

    Observed are x [m], y [m], heading [rad], and the centres x, y of each obstacle [m].
    """

    metadata: dict[str, Any] = {"render_modes": [*MODES[1:]], "render_fps": FRAMES}  # noqa: RUF012

    def __init__(
        self,
        layout: Any = None,
        *,
        motions: Sequence[Motion] = (),
        steps: int = paper.STEPS,
        render_mode: str | None = None,
        draw: Callable[[Task, Matrix], Any] | None = None,
    ) -> None:
        """Choose the layout.

        Args:
            layout: A to F, T01 to T60, or the centres of obstacles; one of the 60 of `TUNE` is
                drawn at each reset if absent.
            motions: of moving obstacles, whose first centres are the layout.
            steps: of an episode, which is truncated then.
            render_mode: None or "rgb_array".
            draw: (task, states so far) -> pixels; `gymnasium.make` passes one.

        Raises:
            ParameterError: an argument has a value that is not allowed.
        """
        if render_mode not in MODES:
            raise refused("render_mode", render_mode, f"one of {', '.join(map(str, MODES))}")
        self.render_mode, self._draw, self.plant = render_mode, draw, robot()
        self._steps = STEPS.check("steps", steps)
        self._fixed = None if layout is None else centres_of(layout)
        first = self._fixed or next(iter(TUNE.values()))
        speed, turn = self.plant.upper * self.plant.period * steps
        reach = np.r_[speed, speed, turn, np.full(2 * len(first), FARTHEST)]
        middle = np.r_[paper.START, np.zeros(2 * len(first))]
        self.observation_space = Box(middle - reach, middle + reach, dtype=np.float64)
        self.action_space = Box(self.plant.lower, self.plant.upper, dtype=np.float64)
        self.task, self._count = task_of(first), len(first)
        self.states: list[Vector] = []  # of the episode so far
        self._at = centres(motions, np.arange(steps + 1)) if motions else None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, dict[str, Any]]:
        """Begin an episode; `options={"layout": ...}` chooses its layout.

        Raises:
            ParameterError: the layout is unknown, or has another number of obstacles.
        """
        super().reset(seed=seed)
        asked = (options or {}).get("layout")
        layout = self._fixed if asked is None else centres_of(asked)
        if layout is None:
            layout = TUNE[str(self.np_random.choice([*TUNE]))]
        if len(layout) != self._count:
            raise refused("layout", asked, f"one of {self._count} obstacles, which are observed")
        self.task = task_of(layout)
        self.states = [self.task.start]
        return self._observation(), {"layout": layout}

    def step(self, action: Vector) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Move for one period; an action outside the bounds is clipped.

        Raises:
            gymnasium.error.ResetNeeded: no episode has begun, or it is over.
            ParameterError: the action is not two finite numbers.
        """
        if not self.states or len(self.states) > self._steps:
            raise gymnasium.error.ResetNeeded("call reset first: no episode goes on")
        given = np.asarray(action, float)
        if given.shape != (self.plant.m,) or not np.isfinite(given).all():
            raise refused("action", action, "two finite numbers, speed and turn rate")
        state, applied = self.states[-1], self.plant.clip(given)
        if self._at is None:
            cost = float(self.task.stage_cost(state, applied))
        else:
            cost = charge(state, applied, self._at[len(self.states) - 1])
        self.states.append(self.plant.step(state, applied))
        distance = self.task.distance(self.states[-1])
        over = len(self.states) > self._steps
        return self._observation(), -cost, False, over, {"distance": distance}

    def render(self) -> Any:
        """The layout and the path so far, shape (height, width, 3); None without a render mode.

        Raises:
            ParameterError: the environment has no `draw`.
        """
        if self.render_mode is None:
            return None
        if self._draw is None:
            raise ParameterError('make it with gymnasium.make("nmpcrl/Robot-v0"), which can draw')
        return self._draw(self.task, np.array(self.states or [self.task.start]))

    def _observation(self) -> Vector:
        x, y, _ = self.task.discs
        at = np.column_stack([x, y]) if self._at is None else self._at[len(self.states) - 1]
        return np.concatenate([self.states[-1], at.ravel()])


class NmpcPolicy:
    """The NMPC as a policy of `RobotEnv`; the last plan in a layout is the warm start."""

    def __init__(self, theta: Vector | None = None, **options: Any) -> None:
        """Set theta, shape (9,), by default theta_init, and options of `paper.controller`."""
        self.theta = np.array(paper.THETA_INIT if theta is None else theta, float)
        self._options = options
        self._centres: Centres = ()
        self._plan: Solution | None = None

    def reset(self) -> None:
        """Forget the last plan."""
        self._plan = None

    def __call__(self, observation: Vector) -> Vector:
        """The first input of the plan.

        Raises:
            SolverError: the solver found no plan, from a standing start either.
        """
        state, rest = observation[:3], observation[3:].reshape(-1, 2).tolist()
        centres = tuple((x, y) for x, y in rest)
        if centres != self._centres:
            task = task_of(centres)
            self._controller = Persistent(paper.controller(task, **self._options))
            self._centres = centres
            self.reset()
        self._plan = self._controller.solve(state, self.theta, self._plan)
        return self._plan.action

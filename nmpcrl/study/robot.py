"""The paper's robot as a public task for Gymnasium, `nmpcrl/Robot-v0`, and the NMPC as its policy.

What it observes is where it is and where the obstacles are. Its reward is minus Eq. (20). It never
terminates; it is truncated after K + 1 = 130 steps. Nothing is drawn but layouts, so that the same
actions in the same layout give the same rewards.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from nmpcrl import Matrix, Vector
from nmpcrl.control import Plant, Solution, Task, differential_drive
from nmpcrl.learning.rollout import Persistent
from nmpcrl.study import geometry, paper
from nmpcrl.study.drawn import TUNE
from nmpcrl.study.geometry import CENTRES, FARTHEST, Centres
from nmpcrl.study.moving import Motion, centres, charge
from nmpcrl.study.parameters import ParameterError, refused, whole

NAMED = paper.LAYOUTS | TUNE  # what a layout may be called; those to judge on have no name here
MOST_STEPS = 10_000  # of an episode
FRAMES = 10  # a second, where an episode is shown
Draw = Callable[[Task, Matrix], Any]  # (task, states so far) -> pixels


def centres_of(layout: Any) -> Centres:
    """Where the obstacles of a layout stand [m].

    Raises:
        ParameterError: it is neither one of `NAMED` nor centres of obstacles.
    """
    try:
        return geometry.centres_of(layout, NAMED)
    except ParameterError:
        raise refused("layout", layout, f"one of A to F and T01 to T60, or {CENTRES}") from None


@lru_cache(maxsize=256)
def task_of(centres: Centres) -> Task:
    """The task in a layout, made once, since its cost is compiled."""
    return paper.task_among(centres)


@lru_cache(maxsize=1)
def robot() -> Plant:
    """The paper's robot, made once, since its step is compiled."""
    return differential_drive()


class RobotEnv(gymnasium.Env[Vector, Vector]):
    """`nmpcrl/Robot-v0`: go to the target and around the obstacles of a layout.

    Observed are x [m], y [m], heading [rad], and the centres x, y of each obstacle [m].
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": FRAMES}  # noqa: RUF012

    def __init__(
        self,
        layout: Any = None,
        *,
        motions: Sequence[Motion] = (),
        steps: int = paper.STEPS,
        render_mode: str | None = None,
        draw: Draw | None = None,
    ) -> None:
        """Choose the layout.

        Args:
            layout: A to F, T01 to T60, or the centres of obstacles; one of the 60 of `TUNE` is
                drawn at each reset if absent.
            motions: of the obstacles, where they move; the layout has then their first centres.
            steps: after so many an episode is truncated.
            render_mode: None or "rgb_array".
            draw: makes the pixels; `gymnasium.make` brings it.

        Raises:
            ParameterError: an argument is not what it may be.
        """
        modes = self.metadata["render_modes"]
        if render_mode not in (None, *modes):
            raise refused("render_mode", render_mode, f"None or one of {', '.join(modes)}")
        self.render_mode, self._draw, self.plant = render_mode, draw, robot()
        self._steps = whole(1, MOST_STEPS).check("steps", steps)
        self._fixed = None if layout is None else centres_of(layout)
        self._count = len(self._fixed or next(iter(TUNE.values())))
        lower, upper = self._reach()
        self.observation_space = Box(lower, upper, dtype=np.float64)
        self.action_space = Box(self.plant.lower, self.plant.upper, dtype=np.float64)
        self.task = task_of(self._fixed or next(iter(TUNE.values())))
        self.states: list[Vector] = []  # of the episode so far
        self._at = centres(motions, np.arange(self._steps + 1)) if motions else None

    def _reach(self) -> tuple[Vector, Vector]:
        """How far the robot gets in an episode, and where obstacles may stand."""
        speed, turn = self.plant.upper * self.plant.period * self._steps
        reach, walls = np.array([speed, speed, turn]), np.full(2 * self._count, FARTHEST)
        start = np.array(paper.START)
        return np.r_[start - reach, -walls], np.r_[start + reach, walls]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, dict[str, Any]]:
        """Begin an episode; `options={"layout": ...}` chooses its layout.

        Raises:
            ParameterError: the layout is none, or has another number of obstacles.
        """
        super().reset(seed=seed)
        asked = (options or {}).get("layout")
        if asked is not None:
            layout = centres_of(asked)
        elif self._fixed is not None:
            layout = self._fixed
        else:
            layout = TUNE[str(self.np_random.choice([*TUNE]))]
        if len(layout) != self._count:
            raise refused("layout", asked, f"one of {self._count} obstacles, which are observed")
        self.task = task_of(layout)
        self.states = [self.task.start]
        return self._observation(), {"layout": layout}

    def step(self, action: Vector) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """One period; an action outside the bounds is clipped.

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
        cost = self._cost(state, applied)
        self.states.append(self.plant.step(state, applied))
        distance = self.task.distance(self.states[-1])
        over = len(self.states) > self._steps
        return self._observation(), -cost, False, over, {"distance": distance}

    def render(self) -> Any:
        """The layout and the way so far, shape (height, width, 3); None without a render mode.

        Raises:
            ParameterError: nothing was given that draws.
        """
        if self.render_mode is None:
            return None
        if self._draw is None:
            raise ParameterError('make it with gymnasium.make("nmpcrl/Robot-v0"), which can draw')
        return self._draw(self.task, np.array(self.states or [self.task.start]))

    def _cost(self, state: Vector, action: Vector) -> float:
        if self._at is not None:
            return charge(state, action, self._at[len(self.states) - 1])
        return float(self.task.stage_cost(state, action))

    def _observation(self) -> Vector:
        x, y, _ = self.task.discs
        at = np.column_stack([x, y]) if self._at is None else self._at[len(self.states) - 1]
        return np.concatenate([self.states[-1], at.ravel()])


class NmpcPolicy:
    """The NMPC with some theta as a policy of `RobotEnv`: observation -> action.

    It keeps its last plan as a warm start, and forgets it with `reset` and in another layout. A
    failed solve is tried from a standing start, too, and then raised.
    """

    def __init__(self, theta: Vector | None = None, **options: Any) -> None:
        """Keep theta.

        Args:
            theta: NMPC parameters, shape (9,); theta_init if absent.
            options: of `paper.controller`, such as the horizon.
        """
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
            SolverError: no plan was found.
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

"""The robot in one place, whose every episode counts: what an entry of the suite is given."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Task
from nmpcrl.learning import Exploration, Learner, Rollout, Step, Weights, train
from nmpcrl.learning.rollout import Persistent, evaluate
from nmpcrl.study import paper
from nmpcrl.study.geometry import Centres
from nmpcrl.study.motions import Motion, centres, extrapolated
from nmpcrl.study.storage.refusal import Refusal
from nmpcrl.study.world import TASK, World, controller

Policy = Callable[[Vector], Vector]  # observation of `nmpcrl/Robot-v0` -> action


class OverBudget(Refusal):
    """An episode was begun for which there was no budget."""


class Robot:
    """One layout and a budget of episodes, with noise or without.

    An episode counts from its first step on, whether it is trained on, confirms something or is a
    tuner's: by `train`, by `rollout` and `cost`, or as a reset of `env`.
    """

    motions: tuple[Motion, ...] = ()  # of the obstacles, if they move

    def __init__(self, centres: Centres, budget: int, seed: int) -> None:
        """Nothing is spent.

        Args:
            centres: of the obstacles [m].
            budget: episodes that may be begun.
            seed: of all that an entry draws; two with the same seed do the same.
        """
        self.centres, self.budget, self.seed = centres, budget, seed
        self.rng = np.random.default_rng(seed)
        self.task: Task = paper.task_among(centres)
        self.controller = Persistent(paper.controller(self.task))
        self.begun = 0  # episodes; more than the budget where an entry has tried to begin more

    @property
    def left(self) -> int:
        """Episodes that may still be begun."""
        return max(self.budget - self.begun, 0)

    def train(
        self, learner: Learner, weights: Weights, explore: Exploration, *, constrained: bool = False
    ) -> Iterator[Step]:
        """`learning.train` with this robot.

        Raises:
            OverBudget: an episode is not to be had.
            Diverged: as `learning.train`.
        """
        return train(
            learner, self.controller, weights, explore, constrained=constrained, **self._place()
        )

    def rollout(self, theta: Vector) -> Rollout:
        """`learning.evaluate`: an episode without noise under the policy of theta.

        Raises:
            OverBudget: it is not to be had.
        """
        return evaluate(self.controller, theta, paper.STEPS, **self._place())

    def cost(self, theta: Vector) -> float:
        """The summed cost of `rollout`; infinite where a solve failed."""
        return self.rollout(theta).cost

    def env(self) -> Any:
        """`nmpcrl/Robot-v0` in this place, whose every reset counts.

        Raises:
            OverBudget: when it is reset and an episode is not to be had.
        """
        from nmpcrl.study.robot import RobotEnv  # and Gymnasium, which not all entries need

        robot = self

        class Counted(RobotEnv):
            """The environment, which asks before it begins."""

            def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
                robot._begin()
                return super().reset(seed=seed, options={"layout": robot.centres})

        return Counted(self.centres, motions=self.motions)

    def _place(self) -> dict[str, Any]:
        """What `train` and `evaluate` take of where the robot is; episodes are counted."""
        return {"start": self._begin}

    def _begin(self, _: Any = None) -> Vector:
        """The start of an episode, once it is counted."""
        self.begun += 1
        if self.begun > self.budget:
            raise OverBudget(f"episode {self.begun} was begun with a budget of {self.budget}")
        return self.task.start


class AmongMoving(Robot):
    """A scenario of obstacles that move, planned with the velocity seen since the step before.

    `centres` are those at the start, and `task` has no obstacle.
    """

    def __init__(self, motions: Sequence[Motion], budget: int, seed: int) -> None:
        """Nothing is spent; as `Robot`, but with the motions of the obstacles."""
        first = centres(motions, 0)[0].tolist()
        self.centres, self.motions = tuple((x, y) for x, y in first), tuple(motions)
        self.budget, self.seed, self.begun = budget, seed, 0
        self.rng, self.task = np.random.default_rng(seed), TASK
        self.controller = controller(len(self.motions))

    def _place(self) -> dict[str, Any]:
        world = World(self.motions, extrapolated)

        def begin(rng: np.random.Generator) -> Vector:
            self._begin()
            return world.begin(rng)

        return {**world.environment, "start": begin}

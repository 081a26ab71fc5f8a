"""What the policy of an agent costs while it is trained, in one layout or in many at once.

Each run is kept by itself, so that an interrupted call goes on.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nmpcrl.analysis import judgements
from nmpcrl.analysis.agents import agent
from nmpcrl.analysis.kept import Kept
from nmpcrl.analysis.suite import Policy, Robot, followed
from nmpcrl.study import paper
from nmpcrl.study.geometry import Centres
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.provenance import installed
from nmpcrl.study.robot import RobotEnv

EPOCH = 1  # raised by hand where an edit of agents or of this changes a number
LIBRARY = "stable-baselines3"
THERE, AWAY = "a", "-"  # a letter a layout: whether the robot arrives


@dataclass(frozen=True)
class Curve:
    """What one training came to."""

    initial: list[float]  # J of theta_init in each layout that it is judged in
    costs: list[list[float]]  # at each checkpoint in each of those layouts
    arrived: list[str]  # at each checkpoint, a letter a layout
    episodes: int  # begun
    steps: int  # of the robot
    seconds: float  # of processor time, judging included


def curve(
    entry: str,
    trained_in: Mapping[str, Centres],
    judged_in: Mapping[str, Centres],
    checkpoints: Sequence[int],
    seed: int,
) -> Curve:
    """Train an agent, and judge it without noise at each checkpoint.

    Args:
        entry: "SAC", or with something set.
        trained_in: layouts, one of which is drawn for each episode.
        judged_in: layouts.
        checkpoints: episodes, rising.
        seed: of all that is drawn.

    Raises:
        NoAgents: stable-baselines3 is not installed.
    """
    began = time.process_time()
    robots = [Robot(centres, 1 + len(checkpoints), seed) for centres in judged_in.values()]
    initial = [robot.cost(np.array(paper.THETA_INIT)) for robot in robots]
    costs, arrived, at = [], [], None
    layouts = [*trained_in.values()]
    for at in agent(entry).trained(RobotEnv(layouts[0]), layouts, checkpoints, seed):
        judged = [_judged(robot, at.policy) for robot in robots]
        costs.append([cost for cost, _ in judged])
        arrived.append("".join(THERE if there else AWAY for _, there in judged))
    assert at
    taken = time.process_time() - began
    return Curve(initial, costs, arrived, at.episodes, at.steps, taken)


def _judged(robot: Robot, policy: Policy) -> tuple[float, bool]:
    """The cost of a rollout, and whether it ends at the target."""
    rollout = followed(robot, policy)
    return rollout.cost, bool(robot.task.distance(rollout.states[-1]) <= ARRIVED)


def depends_on() -> dict[str, Any]:
    """All that the numbers depend on, beside what is wanted."""
    library = installed(LIBRARY)
    return {**judgements.depends_on(), "agents": EPOCH, LIBRARY: library}


KEPT: Kept[Curve] = Kept("agents", Curve, lambda: depends_on())

"""Collisions of a robot with moving obstacles, and how crowded a scenario is."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import paper
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.moving import CLEARANCE, TASK, Motion, World, centres, inside

GRID = 0.1  # [m], of the points at which crowding is counted


class Contacts(NamedTuple):
    """Contacts of a robot with obstacles."""

    inside: int  # states in an obstacle
    collisions: int  # times that an obstacle was entered


@dataclass(frozen=True, eq=False)
class Encounters:
    """A rollout without noise on the action, by its true states."""

    states: Matrix  # true ones, shape (<= K + 2, 3)
    cost: float  # infinite where a solve failed
    contacts: Contacts
    arrived: bool


def count(states: Matrix, motions: Sequence[Motion]) -> Contacts:
    """Count the states in an obstacle, and the entries."""
    there = inside(states, motions)
    entered = there[1:] & ~there[:-1]
    return Contacts(int(there.any(axis=1).sum()), int(entered.sum() + there[:1].sum()))


def judged(nmpc: Nmpc, theta: Vector, world: World, seed: int = 0) -> Encounters:
    """An episode of the policy of theta in a world; the seed is of the world's noise."""
    rng = np.random.default_rng(seed)  # the published draws
    rollout = evaluate(nmpc, theta, paper.STEPS, rng=rng, **world.environment)
    states = np.array(world.states[: len(rollout.costs) + 1])
    arrived = not rollout.failure and TASK.distance(states[paper.STEPS - 1]) <= ARRIVED
    return Encounters(
        states, rollout.cost, count(states[: paper.STEPS], world.motions), bool(arrived)
    )


def crowding(motions: Sequence[Motion]) -> float:
    """The share of space and time that obstacles cover between start and target.

    The points are a grid of the rectangle from start to target, enlarged by a disc to either side,
    each at the time of a robot with constant speed along x, and up to five seconds off.
    """
    low, high = np.sort([paper.START[:2], paper.TARGET[:2]], axis=0)
    xs = np.arange(low[0], high[0], GRID)
    ys = np.arange(low[1] - CLEARANCE, high[1] + CLEARANCE, GRID)
    times = (xs - low[0]) / (high[0] - low[0]) * (paper.STEPS - 1)
    late = np.arange(-25, 26, 5)
    at = centres(motions, (times[:, None] + late).ravel()).reshape(len(xs), late.size, -1, 2)
    points = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1)
    away = points[:, None, :, None] - at[:, :, None]
    covered = ((away**2).sum(axis=-1) < (CLEARANCE / 2) ** 2).any(axis=-1)
    return float(covered.mean())

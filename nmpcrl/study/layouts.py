"""The criteria for layouts of obstacles, fixed before any training.

A layout may be used if

1. the straight line from start to target is blocked;
2. start and target lie outside every penalty zone, Upsilon = 0;
3. without noise, the controller with theta_init is at the target after K = 129 steps.

A layout is *closing* if theta_c = 0.35, which learning may approach (departure N), closes a gap of
this first rollout, and *open* otherwise. A was the first layout tried; the others are the first
that a seeded sampler drew and `screen` accepted, so that no layout was selected for its results; a
test draws them again.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control import Task
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import paper
from nmpcrl.study.geometry import Centres

ARRIVED = 0.5  # distance to the target, over all states, at which a rollout has arrived


@dataclass(frozen=True)
class Screening:
    """The criteria that a layout meets."""

    blocked: bool  #: 1, the straight line
    clear: bool  #: 2, start and target
    arrives: bool  #: 3, the rollout of theta_init
    closing: bool  #: a gap of this rollout is closed at theta_c = d_o

    @property
    def passed(self) -> bool:
        """Whether the layout may be used."""
        return self.blocked and self.clear and self.arrives

    @property
    def kind(self) -> str:
        """ "closing" or "open"."""
        return "closing" if self.closing else "open"


def screen(centres: Centres) -> Screening:
    """Apply the criteria to a layout; nothing is trained for it."""
    task = paper.task(centres)
    along, away = (task.target - task.start)[:2], np.asarray(centres) - task.start[:2]
    share = np.clip(away @ along / (along @ along), 0, 1)  # of the line, to each centre's foot
    nearest = np.linalg.norm(away - share[:, None] * along, axis=1).min()
    blocked = bool(nearest < _keep_out(task, 0))
    clear = task.collision_penalty(task.start) == 0 == task.collision_penalty(task.target)
    if not (blocked and clear):
        return Screening(blocked, clear, arrives=False, closing=False)
    theta = np.array(paper.THETA_INIT)
    rollout = evaluate(paper.controller(task), theta, paper.STEPS)
    arrives = not rollout.failure and task.distance(rollout.states[-1]) <= ARRIVED
    narrow = [width <= 0 for width in gaps(task, rollout.states[:, :2], task.margin).values()]
    return Screening(blocked, clear, arrives=bool(arrives), closing=any(narrow))


def gaps(task: Task, path: Matrix, theta_c: float) -> dict[tuple[int, int], float]:
    """The widths [m] of the gaps that a path, shape (steps, 2), goes through, by their two sides.

    A gap lies between two obstacles if the path crosses the line between their centres, and
    between an obstacle and a wall if it crosses the shortest line between them. The walls are
    -1 (left), -2 (bottom), -3 (right) and -4 (top). theta_c widens the obstacles: a gap of width 0
    or less is closed to plans that satisfy Eq. (2f).
    """
    centres, keep_out = np.transpose(task.discs[:2]), _keep_out(task, theta_c)
    widths = {}
    for i, j in combinations(range(len(centres)), 2):
        if _crosses(path, centres[i], centres[j]):
            widths[i, j] = float(np.linalg.norm(centres[i] - centres[j])) - 2 * keep_out
    walls = [(0, task.lower[0]), (1, task.lower[1]), (0, task.upper[0]), (1, task.upper[1])]
    for i, centre in enumerate(centres):
        for number, (axis, limit) in enumerate(walls, start=1):
            foot = centre.copy()
            foot[axis] = limit
            if np.isfinite(limit) and _crosses(path, centre, foot):
                widths[i, -number] = abs(limit - centre[axis]) - keep_out
    return widths


def _keep_out(task: Task, theta_c: float) -> float:
    """Distance [m] from an obstacle's centre at which Xi + theta_c = 0."""
    return float(task.discs[2].max() / 2 * np.sqrt(1 + theta_c))


def _crosses(path: Matrix, one: Vector, other: Vector) -> bool:
    """Whether a path, shape (steps, 2), crosses the segment between two points."""
    before, after = path[:-1], path[1:]
    sides = _side(one, other, before) * _side(one, other, after) <= 0
    ends = _side(before, after, one) * _side(before, after, other) <= 0
    moved = (before != after).any(axis=1)
    return bool((sides & ends & moved).any())


def _side(one: Matrix, other: Matrix, point: Matrix) -> Vector:
    """Positive where a point lies to the left of the way from one point to another."""
    along, away = np.asarray(other) - one, np.asarray(point) - one
    return along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0]

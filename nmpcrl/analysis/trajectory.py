"""A drive in plain words: how long, how far, how close to the obstacles, and through which gaps."""

from dataclasses import dataclass

import numpy as np

from nmpcrl import Matrix
from nmpcrl.control import Task
from nmpcrl.study.layouts import ARRIVED, gaps
from nmpcrl.study.records import Column


@dataclass(frozen=True)
class Drive:
    """What somebody would say who had watched it."""

    arrival: float  # [s] until it stays within `ARRIVED` of the target's place; infinite if never
    length: float  # of the road [m]
    room: float  # least distance of the robot's side from an obstacle's [m]; negative inside
    penalty: float  # sum of Upsilon over the drive, what it is charged for coming close


def described(states: Column, task: Task, period: float) -> Drive:
    """Look at the states of a drive, shape (K + 1, n), one a `period` [s]; nan after a failure."""
    driven = states[np.isfinite(states).all(axis=1)]
    away = np.linalg.norm(driven - task.target, axis=1)
    late = np.flatnonzero(np.linalg.norm((driven - task.target)[:, :2], axis=1) > ARRIVED)
    missed = len(driven) < len(states) or len(driven) - 1 in late
    x, y, clearance = task.discs
    apart = np.hypot(driven[:, :1] - x, driven[:, 1:2] - y) - clearance / 2
    charged = driven[away >= task.near]  # nearer to the target, the input is charged instead
    return Drive(
        arrival=np.inf if missed else period * int(max(late, default=-1) + 1),
        length=float(np.linalg.norm(np.diff(driven[:, :2], axis=0), axis=1).sum()),
        room=float(apart.min()),
        penalty=float(sum(map(task.collision_penalty, charged))),
    )


def closes_at(task: Task, path: Matrix) -> float:
    """The least theta_c at which a gap that a path goes through is closed; infinite without one.

    A gap as wide as D between its sides' centres, or between a centre and a wall, keeps
    D - c sqrt(1 + theta_c) of it.

    Args:
        task: obstacles and walls.
        path: positions, shape (steps, 2).
    """
    bare, first = gaps(task, path, -1.0), gaps(task, path, 0.0)
    ends = [(bare[sides] / (bare[sides] - first[sides])) ** 2 - 1 for sides in bare]
    return float(min(ends, default=np.inf))

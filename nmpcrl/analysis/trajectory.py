"""Measures of a closed-loop trajectory: its length, its clearance, and the gaps on its way."""

from dataclasses import dataclass

import numpy as np

from nmpcrl import Matrix
from nmpcrl.control import Task
from nmpcrl.study.layouts import ARRIVED, gaps
from nmpcrl.study.records import Column


@dataclass(frozen=True)
class Trajectory:
    """Measures of a rollout without noise."""

    arrival: float  # [s] until the robot stays within `ARRIVED` of the target; infinite if never
    length: float  # of the path [m]
    clearance: float  # least distance of the robot's side from an obstacle's [m]; negative inside
    penalty: float  # sum of Upsilon over the rollout


def describe(states: Column, task: Task, period: float) -> Trajectory:
    """Measure the states of a rollout, shape (K + 1, n), each `period` [s]; nan if not reached."""
    reached = states[np.isfinite(states).all(axis=1)]
    away = np.linalg.norm(reached - task.target, axis=1)
    late = np.flatnonzero(np.linalg.norm((reached - task.target)[:, :2], axis=1) > ARRIVED)
    missed = len(reached) < len(states) or len(reached) - 1 in late
    x, y, clearance = task.discs
    distances = np.hypot(reached[:, :1] - x, reached[:, 1:2] - y) - clearance / 2
    charged = reached[away >= task.near]  # near the target, the input is charged instead
    return Trajectory(
        arrival=np.inf if missed else period * int(max(late, default=-1) + 1),
        length=float(np.linalg.norm(np.diff(reached[:, :2], axis=0), axis=1).sum()),
        clearance=float(distances.min()),
        penalty=float(sum(map(task.collision_penalty, charged))),
    )


def closes_at(task: Task, path: Matrix) -> float:
    """The least theta_c that closes a gap on a path, shape (steps, 2); infinite without a gap.

    A gap is D - c sqrt(1 + theta_c) wide if the centres of its sides, or a centre and a wall, are
    D apart.
    """
    bare, first = gaps(task, path, -1.0), gaps(task, path, 0.0)
    ends = [(bare[sides] / (bare[sides] - first[sides])) ** 2 - 1 for sides in bare]
    return float(min(ends, default=np.inf))

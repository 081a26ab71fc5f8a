"""What the solver of a live figure is given, and how it is shown: sliders and a map."""

from dataclasses import replace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Obstacle, Task, browser
from nmpcrl.study import paper
from nmpcrl.study.geometry import MOST_OBSTACLES

LONGEST = 20  # steps planned: a longer plan has several minima
CLOSE = 1.2  # beside the circle of one obstacle, seen close [m]
WIDE = 2.4  # the map of one obstacle, over its height
WALL, AROUND = 0.5, 1.5  # of the map, beyond a wall and beyond an obstacle's circle [m]


def problem_of(nmpc: Nmpc, longest: int = LONGEST) -> dict[str, Any]:
    """What `solver.js` is given of a task: `browser.problem` with one obstacle, and its own.

    Args:
        nmpc: the problem.
        longest: the longest horizon that is asked for.
    """
    task = replace(nmpc.task, obstacles=(Obstacle(0.0, 0.0),))
    longer = task.problem(nmpc.plant, longest, nmpc.gamma, nmpc.slack_weight)
    return browser.problem(longer, ties_active=nmpc.ties_active) | {
        "target": nmpc.task.target.tolist(),
        "discs": [list(disc) for disc in zip(*nmpc.task.discs, strict=True)],
        "most_discs": MOST_OBSTACLES,
    }


def begin(nmpc: Nmpc, state: Vector, theta: Vector) -> dict[str, Any]:
    """What a figure of this controller begins with, its problem and what a map draws."""
    return {
        "names": paper.THETA_NAMES,
        "ranges": ranges(theta),
        "start": state.tolist(),
        "theta": theta.tolist(),
        "horizon": nmpc.horizon,
        "problem": problem_of(nmpc),
        **surroundings(nmpc.task),
    }


def ranges(theta: Vector) -> dict[str, tuple[float, float, float]]:
    """Least, most and step of each slider; the initial theta is one of its steps."""
    *weights, c = theta.tolist()
    found = {
        name: (0.0, 4 * weight, weight / 20)
        for name, weight in zip(paper.THETA_NAMES, weights, strict=False)
    }
    found["c"] = (round(c - 0.2, 6), round(c + 0.5, 6), 0.01)
    return found | {"horizon": (1, LONGEST, 1)}


def surroundings(task: Task) -> dict[str, Any]:
    """What a map draws besides trajectories: its part of the plane, the box, and sizes [m]."""
    return {
        "box": [task.lower[:2].tolist(), task.upper[:2].tolist()],
        "view": view(task),
        "radii": [one.diameter / 2 for one in task.obstacles],
        "robot": task.robot_diameter / 2,
    }


def view(task: Task) -> list[float]:
    """The part of the plane that the map shows: least x and y, width and height [m]."""
    x, y, clearance = task.discs
    centres, reach = np.column_stack([x, y]), clearance[:, None] / 2 + AROUND
    ends = np.array([task.start[:2], task.target[:2]])
    low = np.vstack([centres - reach, ends - AROUND]).min(axis=0)
    high = np.vstack([centres + reach, ends + AROUND]).max(axis=0)
    low = np.maximum(low, task.lower[:2] - WALL)
    high = np.minimum(high, task.upper[:2] + WALL)
    return [*low.tolist(), *(high - low).tolist()]


def boundaries(task: Task, theta_c: float) -> list[float]:
    """The distance from each obstacle's centre at which Xi + theta_c = 0, by Eq. (19) [m]."""
    *_, clearance = task.discs
    return [float(each) / 2 * (1 + theta_c) ** 0.5 for each in clearance]


def close(task: Task, state: Vector) -> list[float]:
    """As `view`, of the obstacle that is nearest to a state."""
    x, y, clearance = (each[np.argmax(task.overlap(state))] for each in task.discs)
    height = clearance + CLOSE
    return [x - WIDE * height / 2, y - height / 2, WIDE * height, height]

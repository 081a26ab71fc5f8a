"""What the solver of a live figure is given, and how it is shown: sliders, a map, lines."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Obstacle, Task, browser
from nmpcrl.report.figures.style import LOOKS
from nmpcrl.study import paper
from nmpcrl.study.geometry import MOST_OBSTACLES

LONGEST = 20  # steps planned: a longer plan has several minima
WALL, AROUND = 0.5, 1.5  # of the map, beyond a wall and beyond an obstacle's circle [m]
DASHES = {"-": (), "--": (3.7, 1.6), "-.": (6.4, 1.6, 1.0, 1.6), ":": (1.0, 1.65)}  # matplotlib's
WIDTH = 1.6  # of a line, of which dashes are multiples


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
        "discs": discs(nmpc.task),
        "most_discs": MOST_OBSTACLES,
    }


def discs(task: Task) -> list[list[float]]:
    """Centre and diameter of each obstacle's clearance, as the solver takes them [m]."""
    return [list(disc) for disc in zip(*task.discs, strict=True)]


def begin(nmpc: Nmpc, state: Vector, theta: Vector) -> dict[str, Any]:
    """What a figure of this controller begins with, its problem and what a map draws."""
    return {
        "names": paper.THETA_NAMES,
        "ranges": ranges(theta),
        "start": state.tolist(),
        "theta": theta.tolist(),
        "horizon": nmpc.horizon,
        "problem": problem_of(nmpc),
        "steps": paper.STEPS,
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


def surroundings(*tasks: Task) -> dict[str, Any]:
    """What a map of some tasks draws besides trajectories: its part of the plane, the box, sizes.

    The part is least x and y, width and height, and shows start, target and obstacles whole [m].
    """
    first, low, high = tasks[0], np.full(2, np.inf), np.full(2, -np.inf)
    for task in tasks:
        x, y, clearance = task.discs
        reach, ends = clearance / 2, np.transpose([task.start[:2], task.target[:2]])
        low = np.hstack([low[:, None], np.vstack([x - reach, y - reach]), ends]).min(axis=1)
        high = np.hstack([high[:, None], np.vstack([x + reach, y + reach]), ends]).max(axis=1)
    low = np.maximum(low - AROUND, first.lower[:2] - WALL)
    high = np.minimum(high + AROUND, first.upper[:2] + WALL)
    return {
        "box": [first.lower[:2].tolist(), first.upper[:2].tolist()],
        "view": [*low.tolist(), *(high - low).tolist()],
        "radii": [one.diameter / 2 for one in first.obstacles],
        "robot": first.robot_diameter / 2,
    }


def look(learner: str) -> dict[str, str]:
    """Colour and dashes of a learner, as in all figures; black follows the theme of the page."""
    found = asdict(LOOKS[learner])
    style = found["linestyle"]
    dashes = DASHES[style] if isinstance(style, str) else style[1]
    color = "var(--ink)" if found["color"] == "#000000" else found["color"]
    return {"color": color, "dashes": " ".join(f"{WIDTH * each:g}" for each in dashes)}

"""The robot on its way, as pixels: what `nmpcrl/Robot-v0` renders."""

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from nmpcrl import Matrix
from nmpcrl.control import Task
from nmpcrl.report.figures.axes import draw_task
from nmpcrl.report.figures.style import INK, PAGE, TEAL, WINE

SIZE, DOTS = (6.4, 6.4), 100  # inches, and dots an inch
MARGIN = 0.4  # around the box, in which the walls are seen [m]


def frame(task: Task, states: Matrix) -> NDArray[np.uint8]:
    """The map with the way so far, shape (640, 640, 3).

    Args:
        task: its obstacles, start, target and box.
        states: of the episode so far, shape (steps, 3).
    """
    with rc_context({**PAGE, "figure.dpi": DOTS}):
        figure = Figure(figsize=SIZE, layout="constrained")
        canvas: Any = FigureCanvasAgg(figure)
        axes = figure.subplots()
        draw_task(axes, task)
        (left, bottom), (right, top) = task.lower[:2], task.upper[:2]
        axes.plot([left, right, right, left, left], [bottom, bottom, top, top, bottom], color=INK)
        axes.plot(states[:, 0], states[:, 1], color=TEAL)
        _robot(axes, task, states[-1])
        axes.set(xlim=(left - MARGIN, right + MARGIN), ylim=(bottom - MARGIN, top + MARGIN))
        axes.set_title(f"after {len(states) - 1} steps, {_away(task, states[-1]):.2f} m to go")
        canvas.draw()
        return np.array(canvas.buffer_rgba())[:, :, :3]


def _away(task: Task, state: Any) -> float:
    return float(np.hypot(*(state - task.target)[:2]))


def _robot(axes: Any, task: Task, state: Any) -> None:
    """The robot as large as it is, and where it looks."""
    x, y, heading = state
    radius = task.robot_diameter / 2
    axes.add_patch(Circle((x, y), radius, fc=WINE, ec=INK, lw=0.8, zorder=3))
    ahead = radius * np.array([np.cos(heading), np.sin(heading)])
    axes.plot([x, x + ahead[0]], [y, y + ahead[1]], color="white", lw=2, zorder=4)

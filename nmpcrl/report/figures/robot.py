"""The robot on its way, as pixels: what `nmpcrl/Robot-v0` renders."""

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from nmpcrl import Matrix
from nmpcrl.control import Task
from nmpcrl.report.figures.axes import draw_task
from nmpcrl.report.figures.style import INK, PAGE, TEAL, WINE

MARGIN = 0.4  # around the box, in which the walls are seen [m]


def frame(task: Task, states: Matrix) -> NDArray[np.uint8]:
    """The map with the way so far, the robot as large as it is and where it looks.

    Args:
        task: its obstacles, start, target and box.
        states: of the episode so far, shape (steps, 3).

    Returns:
        Shape (640, 640, 3).
    """
    with rc_context(PAGE):
        figure = Figure(figsize=(6.4, 6.4), dpi=100, layout="constrained")
        canvas: Any = FigureCanvasAgg(figure)
        axes = figure.subplots()
        draw_task(axes, task)
        low, high = task.lower[:2], task.upper[:2]
        axes.add_patch(Rectangle(tuple(low), *(high - low), fill=False, ec=INK, lw=1.6))
        axes.plot(states[:, 0], states[:, 1], color=TEAL)
        place, heading, radius = states[-1, :2], states[-1, 2], task.robot_diameter / 2
        axes.add_patch(Circle(tuple(place), radius, fc=WINE, ec=INK, lw=0.8, zorder=3))
        ahead = place + radius * np.array([np.cos(heading), np.sin(heading)])
        axes.plot(*np.transpose([place, ahead]), color="white", lw=2, zorder=4)
        (left, bottom), (right, top) = low - MARGIN, high + MARGIN
        away = np.linalg.norm(place - task.target[:2])
        title = f"after {len(states) - 1} steps, {away:.2f} m to go"
        axes.set(xlim=(left, right), ylim=(bottom, top), title=title)
        canvas.draw()
        return np.array(canvas.buffer_rgba())[:, :, :3]

"""Chapter 1's live figure: the controller, its plan and its closed loop."""

from typing import Any

from IPython.display import HTML

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.report.live import frame
from nmpcrl.report.live.problem import begin

SCRIPTS = frame.scripts_of("controller", *frame.MAP, "sliders.js")


def controller(nmpc: Nmpc, theta: Vector, steps: int) -> HTML:
    """The robot, its plan and its closed loop, whose start, obstacles, theta and N can be moved.

    Args:
        nmpc: the paper's robot and a task.
        theta: to begin with, shape (2n + m + 1,).
        steps: of the closed loop.
    """

    def data() -> dict[str, Any]:
        return begin(nmpc, nmpc.task.start, theta) | {"steps": steps}

    return frame.solving("controller", nmpc, data, SCRIPTS)

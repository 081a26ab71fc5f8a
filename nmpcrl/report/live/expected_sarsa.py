"""Chapter 2's live figures: the gradient, its kink, and one update."""

from typing import Any

from IPython.display import HTML

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.live import frame
from nmpcrl.report.live.problem import begin, boundaries, close

ON_MAP = (*frame.MAP, "sliders.js", "graph.js")


def gradient(nmpc: Nmpc, state: Vector, theta: Vector, steps: Vector) -> HTML:
    """dV/dtheta beside finite differences, where the state, the obstacles and theta can be moved.

    Args:
        nmpc: the paper's robot and a task.
        state: to begin with, shape (n,).
        theta: likewise, shape (2n + m + 1,).
        steps: of the differences, growing, shape (k,).
    """

    def data() -> dict[str, Any]:
        return begin(nmpc, state, theta) | {"steps": steps.tolist(), "step": len(steps) // 2}

    return frame.solving("gradient", nmpc, data, frame.scripts_of("gradient", *ON_MAP))


def kink(nmpc: Nmpc, state: Vector, theta: Vector) -> HTML:
    """V and dV/dtheta_c for a robot that is walked over an obstacle's boundary.

    Args:
        nmpc: the paper's robot and a task.
        state: to begin with, near a boundary, shape (n,).
        theta: shape (2n + m + 1,).
    """
    own = {"boundaries": boundaries(nmpc.task, theta[-1]), "view": close(nmpc.task, state)}

    def data() -> dict[str, Any]:
        return begin(nmpc, state, theta) | own

    return frame.solving("kink", nmpc, data, frame.scripts_of("kink", *ON_MAP))


def update(nmpc: Nmpc, theta: Vector, alpha: float) -> HTML:
    """One update of Expected Sarsa from the start, number by number, and how far it goes.

    Args:
        nmpc: the paper's robot and a task.
        theta: to begin with, shape (2n + m + 1,).
        alpha: likewise.
    """
    own = {"gamma": nmpc.gamma, "alpha": alpha, "overshoot": OVERSHOOT}

    def data() -> dict[str, Any]:
        return begin(nmpc, nmpc.task.start, theta) | own

    return frame.solving("update", nmpc, data, frame.scripts_of("update", "sliders.js"))

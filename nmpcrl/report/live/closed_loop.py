"""Chapter 1's live figure: the controller, its plan and its closed loop."""

from IPython.display import HTML

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.learning import browser
from nmpcrl.report.live import frame
from nmpcrl.report.live.problem import problem_of, ranges, surroundings
from nmpcrl.study import paper

SCRIPTS = (*frame.PARTS, "controller.js")


def controller(nmpc: Nmpc, theta: Vector, steps: int) -> HTML:
    """The robot, its plan and its closed loop, whose start, obstacles, theta and N can be moved.

    Args:
        nmpc: the paper's robot and a task.
        theta: to begin with, shape (2n + m + 1,).
        steps: of the closed loop.
    """
    try:
        problem, module = problem_of(nmpc), browser.module(nmpc.plant, nmpc.task)
    except CannotCompile as error:
        return frame.absent(error)
    data = {
        "names": paper.THETA_NAMES,
        "ranges": ranges(theta),
        "steps": steps,
        "start": nmpc.task.start.tolist(),
        "theta": theta.tolist(),
        "horizon": nmpc.horizon,
        "problem": problem,
        **surroundings(nmpc.task),
    }
    return frame.figure("controller", data, SCRIPTS, module)

"""The live figures of chapters 1, 2 and 4, and of obstacles that move."""

import numpy as np
from IPython.display import HTML

from nmpcrl import Vector
from nmpcrl.analysis import two_state
from nmpcrl.control import Nmpc, browser
from nmpcrl.report.live.frame import solving
from nmpcrl.report.live.problem import begin, look, problem_of
from nmpcrl.study import paper
from nmpcrl.study.moving import PERIOD, Straight, problem

RANGES = {"alpha": (0.01, 0.5, 0.01), "beta": (0.01, 1.0, 0.01), "gamma": (0.0, 1.0, 0.01)}
LIMITS = (1e-4, 1e4)  # of the axis of theta
SCENE = (
    Straight((0.5, 1.0), (0.0, 0.3)),  # across the way, as fast upwards as a robot that gives way
    Straight((4.5, -1.0), (0.0, 0.1)),
    Straight((6.5, 4.0)),
    Straight((7.5, -1.0)),
)
BEGIN = 40  # the step at which it stands still
ROBOTS = {  # their looks, by predictor
    "extrapolated": {"color": "#B37A00", "dashes": "8 1.6"},
    "frozen": {"color": "#882255", "dashes": "10.2 2.6 1.6 2.6"},
}


def controller(nmpc: Nmpc, theta: Vector, steps: int) -> HTML:
    """The robot, its plan and its closed loop, whose start, obstacles, theta and N can be moved.

    Args:
        nmpc: the paper's robot and a task.
        theta: to begin with, shape (2n + m + 1,).
        steps: of the closed loop.
    """
    return solving("controller", nmpc, begin(nmpc, nmpc.task.start, theta) | {"steps": steps})


def gradient(nmpc: Nmpc, state: Vector, theta: Vector, steps: Vector) -> HTML:
    """dV/dtheta beside finite differences, and its jump on an obstacle's boundary.

    Args:
        nmpc: the paper's robot and a task.
        state: to begin with, shape (n,).
        theta: shape (2n + m + 1,).
        steps: of the differences, growing, shape (k,).
    """

    given = {"steps": steps.tolist(), "step": len(steps) // 2}
    return solving("gradient", nmpc, begin(nmpc, state, theta) | given)


def chain(alpha: float, beta: float, gamma: float) -> HTML:
    """Semi-gradient and gradient TD on the chain of two states, whose step sizes can be moved.

    Args:
        alpha: step size of theta, to begin with.
        beta: step size of w.
        gamma: discount.
    """
    nmpc = paper.nmpc("A")  # the module has a controller's update rules
    data = {
        "given": {"alpha": alpha, "beta": beta, "gamma": gamma, "states": "first", "at": 0},
        "updates": 120,  # shown
        "problem": problem_of(nmpc),
        "ranges": RANGES,
        "limits": LIMITS,
        "theta": 1.0,
        "w": 0.0,
        "phi": two_state.PHI.tolist(),
        "phi_next": two_state.PHI_NEXT.tolist(),
        "cost": two_state.COST,
        "looks": {learner: look(learner) for learner in ("ES", "GES")},
    }
    return solving("chain", nmpc, data)


def moving() -> HTML:
    """Obstacles with a velocity that can be dragged, and two robots that plan among them."""
    theta = np.array(paper.THETA_INIT)
    nmpc = paper.controller(paper.task(tuple(one.centre for one in SCENE)))
    planned = problem(len(SCENE))
    data = begin(nmpc, nmpc.task.start, theta) | {
        "planning": browser.problem(planned),
        "movers": [[*one.centre, *one.velocity] for one in SCENE],
        "period": PERIOD,
        "step": BEGIN,
        "looks": ROBOTS,
    }
    return solving("moving", nmpc, data, problem=planned)

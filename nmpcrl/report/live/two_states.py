"""Chapter 4's live figure of the chain: where theta goes, update by update."""

from IPython.display import HTML

from nmpcrl.analysis import two_state
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.learning import browser
from nmpcrl.report.live import frame
from nmpcrl.report.live.looks import look
from nmpcrl.report.live.problem import problem_of
from nmpcrl.study import paper

SCRIPTS = (*frame.PARTS, "charts.js", "player.js", "chain.js")
RANGES = {"alpha": (0.01, 0.5, 0.01), "beta": (0.01, 1.0, 0.01), "gamma": (0.0, 1.0, 0.01)}
LIMITS = (1e-4, 1e4)  # of the axis of theta


def chain(alpha: float, beta: float, gamma: float, *, updates: int = 120) -> HTML:
    """Semi-gradient and gradient TD on the chain of two states, whose step sizes can be moved.

    Args:
        alpha: step size of theta, to begin with.
        beta: step size of w.
        gamma: discount.
        updates: how many are shown.
    """
    nmpc = paper.nmpc("A")  # the module has a controller's update rules
    try:
        problem, module = problem_of(nmpc), browser.module(nmpc.plant, nmpc.task)
    except CannotCompile as error:
        return frame.absent(error)
    data = {
        "given": {"alpha": alpha, "beta": beta, "gamma": gamma, "states": "first", "at": 0},
        "ranges": RANGES,
        "limits": LIMITS,
        "updates": updates,
        "theta": 1.0,
        "w": 0.0,
        "phi": two_state.PHI.tolist(),
        "phi_next": two_state.PHI_NEXT.tolist(),
        "cost": two_state.COST,
        "looks": {learner: look(learner) for learner in ("ES", "GES")},
        "problem": problem,
    }
    return frame.figure("chain", data, SCRIPTS, module)

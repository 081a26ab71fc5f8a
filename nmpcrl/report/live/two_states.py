"""Chapter 4's live figure of the chain: where theta goes, update by update."""

from typing import Any

from IPython.display import HTML

from nmpcrl.analysis import two_state
from nmpcrl.report.live import frame
from nmpcrl.report.live.looks import look
from nmpcrl.report.live.problem import problem_of
from nmpcrl.study import paper

SCRIPTS = frame.scripts_of("chain", "sliders.js", "charts.js", "player.js")
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
    given = {"alpha": alpha, "beta": beta, "gamma": gamma, "states": "first", "at": 0}

    def data() -> dict[str, Any]:
        return _chain() | {"given": given, "updates": updates, "problem": problem_of(nmpc)}

    return frame.solving("chain", nmpc, data, SCRIPTS)


def _chain() -> dict[str, Any]:
    return {
        "ranges": RANGES,
        "limits": LIMITS,
        "theta": 1.0,
        "w": 0.0,
        "phi": two_state.PHI.tolist(),
        "phi_next": two_state.PHI_NEXT.tolist(),
        "cost": two_state.COST,
        "looks": {learner: look(learner) for learner in ("ES", "GES")},
    }

"""The live figure of obstacles that move: one robot foresees where they will be, one does not."""

from typing import Any

import numpy as np
from IPython.display import HTML

from nmpcrl import Vector
from nmpcrl.control import browser
from nmpcrl.report.live import frame
from nmpcrl.report.live.problem import begin
from nmpcrl.study import paper
from nmpcrl.study.moving import PERIOD, Straight, problem

SCRIPTS = frame.scripts_of("moving", *frame.MAP, "sliders.js", "charts.js", "player.js")
STYLES = ("moving.css",)
SCENE = (
    Straight((0.5, 1.0), (0.0, 0.3)),  # across the way, as fast upwards as a robot that gives way
    Straight((4.5, -1.0), (0.0, 0.1)),
    Straight((6.5, 4.0)),
    Straight((7.5, -1.0)),
)
BEGIN = 40  # the step at which it stands still
LOOKS = {  # of a robot by its predictor
    "extrapolated": {"color": "#B37A00", "dashes": "8 1.6"},
    "frozen": {"color": "#882255", "dashes": "10.2 2.6 1.6 2.6"},
}


def moving(theta: Vector | None = None) -> HTML:
    """Obstacles with a velocity that can be dragged, and two robots that plan among them.

    Args:
        theta: of both, to begin with; that of the paper if absent.
    """
    theta = np.array(paper.THETA_INIT) if theta is None else theta
    nmpc = paper.controller(paper.task(tuple(one.centre for one in SCENE)))
    planned = problem(len(SCENE))

    def data() -> dict[str, Any]:
        return begin(nmpc, nmpc.task.start, theta) | {
            "planning": browser.problem(planned),
            "movers": [[*one.centre, *one.velocity] for one in SCENE],
            "period": PERIOD,
            "steps": paper.STEPS,
            "step": BEGIN,
            "looks": LOOKS,
        }

    return frame.solving("moving", nmpc, data, SCRIPTS, STYLES, planned)

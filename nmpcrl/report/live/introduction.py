"""The introduction's live figure: the robot, a learner, and a gap that learning closes."""

from typing import Any

import numpy as np
from IPython.display import HTML

from nmpcrl.control import Task
from nmpcrl.report.live import frame
from nmpcrl.report.live.noise import widths
from nmpcrl.report.live.problem import WALL, begin
from nmpcrl.report.live.two_learners import settings
from nmpcrl.study import Experiment, paper
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.setup import controller_of

SCRIPTS = frame.scripts_of(
    "intro", *frame.MAP, "random.js", "learning.js", "trainer.js"
)  # fmt: skip
STYLES = ("intro.css",)
WIDE, NARROW = "A", "E"  # layouts: the first, and the first in which ES closes a gap


def intro() -> HTML:
    """Obstacles to be moved, ES that trains among them, and a layout in which it fails."""
    experiment = Experiment("ES", layout=WIDE)  # as the study has trained it
    nmpc = controller_of(experiment)

    def data() -> dict[str, Any]:
        own = settings(experiment, "ES", nmpc)
        own |= {name: getattr(experiment, name) for name in ("alpha", "decay", "seed")}
        begun = begin(nmpc, nmpc.task.start, np.array(experiment.theta))
        return begun | {
            "view": view(paper.task(WIDE), paper.task(NARROW)),
            "steps": experiment.steps,
            "layouts": {"wide": discs(paper.task(WIDE)), "narrow": discs(paper.task(NARROW))},
            "arrived": ARRIVED,
            "settings": own,
            "widths": widths(),
        }

    return frame.solving("intro", nmpc, data, SCRIPTS, STYLES)


def discs(task: Task) -> list[list[float]]:
    """Centre and diameter of each obstacle's clearance, as the solver takes them [m]."""
    return [list(disc) for disc in zip(*task.discs, strict=True)]


def view(*tasks: Task) -> list[float]:
    """The part of the plane that shows some layouts whole: least x and y, width and height [m]."""
    _, y, clearance = np.hstack([task.discs for task in tasks])
    low, high = tasks[0].lower[:2], tasks[0].upper[:2]
    bottom, top = (y - clearance / 2).min(), (y + clearance / 2).max()
    return [low[0] - WALL, bottom, high[0] - low[0] + 2 * WALL, top - bottom]

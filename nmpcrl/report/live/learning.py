"""The live figures that train: the introduction's robot, and the laboratory."""

from dataclasses import fields
from typing import Any

import numpy as np
from IPython.display import HTML

from nmpcrl.control import Obstacle
from nmpcrl.control.nmpc import ABSURD, FAR
from nmpcrl.learning.training import PATIENCE
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.live.frame import solving
from nmpcrl.report.live.problem import WALL, begin, discs, look, problem_of
from nmpcrl.study import Experiment, paper
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.learners import readers
from nmpcrl.study.records import LAST
from nmpcrl.study.setup import controller_of

WIDE, NARROW = "A", "E"  # layouts: the first, and the first in which ES closes a gap
LEARNERS = ("ES", "DES", "RDES", "GES", "TDC", "QL", "frozen")
SETTINGS = (
    "learner", "alpha", "beta", "beta_tdc", "zeta", "decay", "decay_rate", "horizon", "seed",
    "episodes",
)  # fmt: skip
LONGEST = 40  # steps planned
MOST = {"horizon": LONGEST, "episodes": 3000}  # of a page
MOST_OBSTACLES = 8
FIXED = {  # what Algorithm 1 is given and no reader moves
    "limits": {"absurd": ABSURD, "far": FAR, "patience": PATIENCE},
    "network": {"hidden": paper.HIDDEN, "batch": paper.BATCH},
    "deviation": paper.NOISE,
    "w": [paper.W_INIT] * len(paper.THETA_INIT),
    "steps": paper.STEPS,
}


def intro() -> HTML:
    """Obstacles to be moved, ES that trains among them, and a layout in which it fails."""
    experiment = Experiment("ES", layout=WIDE)
    nmpc = controller_of(experiment)
    tasks = {"wide": paper.task(WIDE), "narrow": paper.task(NARROW)}
    settings = {name: getattr(experiment, name) for name in SETTINGS} | FIXED
    settings |= {
        "decayRate": experiment.decay_rate,
        "evaluateEvery": experiment.evaluate_every,
        "theta": experiment.theta,
        "target": nmpc.task.target.tolist(),
    }

    begun = begin(nmpc, nmpc.task.start, np.array(experiment.theta))
    left, _, width, _ = begun["view"]
    _, y, clearance = np.hstack([task.discs for task in tasks.values()])
    bottom, top = (y - clearance / 2).min(), (y + clearance / 2).max()
    data = begun | {
        "view": [left, bottom, width, top - bottom],
        "layouts": {name: discs(task) for name, task in tasks.items()},
        "arrived": ARRIVED,
        "settings": settings,
    }
    return solving("intro", nmpc, data, "learning.js")


def laboratory() -> HTML:
    """Obstacles, start and target to be moved, settings of a run, and its training as it comes."""
    nmpc = paper.nmpc("A")
    (left, bottom), (right, top) = box = [paper.LOWER[:2], paper.UPPER[:2]]
    disc, robot = Obstacle(0.0, 0.0).diameter, nmpc.task.robot_diameter

    data = FIXED | {
        "problem": problem_of(nmpc, LONGEST),
        "fields": [setting(name) for name in SETTINGS],
        "layouts": paper.LAYOUTS,
        "start": paper.START,
        "target": paper.TARGET,
        "theta": paper.THETA_INIT,
        "names": paper.THETA_NAMES,
        "theta_set": paper.THETA_SET,
        "evaluate_every": Experiment().evaluate_every,
        "last": LAST,
        "overshoot": OVERSHOOT,
        "most": MOST_OBSTACLES,
        "radius": disc / 2,
        "clearance": disc + robot,
        "robot": robot / 2,
        "box": box,
        "view": [left - WALL, bottom - WALL, right - left + 2 * WALL, top - bottom + 2 * WALL],
        "looks": {learner: look(learner) for learner in LEARNERS},
    }
    return solving("laboratory", nmpc, data, "learning.js")


def setting(name: str) -> dict[str, Any]:
    """What a page needs to know of a field of `Experiment`: its default, and what it may be."""
    one = next(one for one in fields(Experiment) if one.name == name)
    allowed, read_by = one.metadata["allowed"], readers(name) or LEARNERS
    found: dict[str, Any] = {"name": name, "default": one.default}
    found["read_by"] = [learner for learner in LEARNERS if learner in read_by]
    if allowed.choices:
        return found | {"choices": list(LEARNERS if name == "learner" else allowed.choices)}
    least, most = allowed.ends
    whole = isinstance(one.default, int)
    return found | {"least": least, "most": MOST.get(name, most), "whole": whole}

"""The laboratory: a live page that places obstacles and trains, as `study.run` does."""

from collections.abc import Iterable
from dataclasses import fields, replace
from typing import Any

from IPython.display import HTML

from nmpcrl.control import Nmpc, Obstacle
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.continuing import TEMPLATES
from nmpcrl.report.examples import Example, settings_of
from nmpcrl.report.live import frame
from nmpcrl.report.live.algorithm import fixed
from nmpcrl.report.live.looks import look
from nmpcrl.report.live.noise import widths
from nmpcrl.report.live.problem import WALL, problem_of
from nmpcrl.study import Experiment, paper
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.learners import readers
from nmpcrl.study.records import LAST

SCRIPTS = frame.scripts_of(
    "laboratory", *frame.MAP, "random.js", "network.js", "learning.js", "trainer.js", "graph.js",
    "player.js", "settings.js", "laboratory_map.js", "laboratory_runs.js", "laboratory_plots.js",
    "laboratory_lesson.js", "laboratory_along.js",
)  # fmt: skip
STYLES = ("laboratory.css",)
LEARNERS = ("ES", "DES", "RDES", "GES", "TDC", "QL", "frozen")
SETTINGS = (
    "learner", "alpha", "beta", "beta_tdc", "zeta", "decay", "decay_rate", "horizon", "seed",
    "episodes",
)  # fmt: skip
LONGEST = 40  # steps planned
MOST = {"horizon": LONGEST, "episodes": 3000}  # of a page
MOST_OBSTACLES = 8
CLOSED, BY_HAND = 0.1, 0.05  # theta_c at which no plan, and one, fits through the gap of the lesson
SLOWER = 1e-8  # alpha, a tenth of the default


def laboratory(gallery: Iterable[Example] = ()) -> HTML:
    """Obstacles, start and target to be moved, settings of a run, and its training as it comes.

    Args:
        gallery: what opens with a click.
    """
    nmpc = paper.nmpc("A")
    return frame.solving("laboratory", nmpc, lambda: _data(nmpc, gallery), SCRIPTS, STYLES)


def _data(nmpc: Nmpc, gallery: Iterable[Example]) -> dict[str, Any]:
    (left, bottom), (right, top) = box = [paper.LOWER[:2], paper.UPPER[:2]]
    disc = Obstacle(0.0, 0.0).diameter
    return {
        "problem": problem_of(nmpc, LONGEST),
        "fields": [setting(name) for name in SETTINGS],
        "layouts": paper.LAYOUTS,
        "start": paper.START,
        "target": paper.TARGET,
        "theta": paper.THETA_INIT,
        "names": paper.THETA_NAMES,
        "w": [paper.W_INIT] * len(paper.THETA_INIT),
        "theta_set": paper.THETA_SET,
        "steps": paper.STEPS,
        "evaluate_every": default("evaluate_every"),
        "last": LAST,
        **fixed(),
        "overshoot": OVERSHOOT,
        "most": MOST_OBSTACLES,
        "radius": disc / 2,
        "clearance": disc + nmpc.task.robot_diameter,
        "robot": nmpc.task.robot_diameter / 2,
        "box": box,
        "view": [left - WALL, bottom - WALL, right - left + 2 * WALL, top - bottom + 2 * WALL],
        "looks": {learner: look(learner) for learner in LEARNERS},
        "widths": widths(),
        "templates": TEMPLATES,
        "period": nmpc.plant.period,
        "arrived": ARRIVED,
        "gallery": [
            {
                "title": one.title,
                "sentence": one.sentence,
                "look": one.look,
                "settings": one.settings,
                "against": one.against and settings_of(one.against),
                "learned": one.learned,
            }
            for one in gallery
        ],
        "trap": trap(),
    }


def trap() -> list[dict[str, Any]]:
    """The lesson on the trap: what each of its six steps trains, and what is laid over that.

    It is the run of the find "A gap that closes", and its remedies were picked after a look at what
    they do there: the lesson illustrates, and is evidence for no claim.
    """
    learned = Experiment(layout="F", seed=1)
    asleep = replace(learned, learner="frozen", episodes=default("evaluate_every"))
    slower, exact = replace(learned, alpha=SLOWER), replace(learned, learner="TDC")
    steps: list[tuple[Experiment, Experiment | None]] = [
        (with_theta_c(asleep, CLOSED), asleep),
        (learned, None),
        (learned, None),
        (slower, learned),
        (exact, learned),
        (with_theta_c(asleep, BY_HAND), learned),
    ]
    return [
        {"settings": settings_of(one), "against": other and settings_of(other)}
        for one, other in steps
    ]


def with_theta_c(experiment: Experiment, value: float) -> Experiment:
    """The same run from another theta_c."""
    return replace(experiment, theta=(*experiment.theta[:-1], value))


def default(name: str) -> Any:
    """The default of a field of `Experiment`."""
    return next(one.default for one in fields(Experiment) if one.name == name)


def setting(name: str) -> dict[str, Any]:
    """What a page needs to know of a field of `Experiment`: its default, and what it may be."""
    one = next(one for one in fields(Experiment) if one.name == name)
    allowed = one.metadata["allowed"]
    read_by = readers(name) or LEARNERS
    found = {"name": name, "default": one.default, "help": one.metadata["help"]}
    found["read_by"] = [learner for learner in LEARNERS if learner in read_by]
    if allowed.choices:
        choices = LEARNERS if name == "learner" else allowed.choices
        return found | {"choices": list(choices), "text": allowed.text}
    least, most = allowed.ends
    whole = isinstance(one.default, int)
    return found | {"least": least, "most": MOST.get(name, most), "whole": whole}

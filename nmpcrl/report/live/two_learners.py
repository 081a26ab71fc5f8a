"""Two learners on the robot that learn from the same noise, step by step, in the page."""

from collections.abc import Mapping
from dataclasses import replace
from math import log10
from typing import Any

from IPython.display import HTML

from nmpcrl.control import Nmpc
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.report.live import frame
from nmpcrl.report.live.algorithm import fixed
from nmpcrl.report.live.looks import look
from nmpcrl.report.live.noise import widths
from nmpcrl.report.live.problem import problem_of, surroundings
from nmpcrl.study import Experiment, paper
from nmpcrl.study.learners import DECAYS
from nmpcrl.study.setup import controller_of

SCRIPTS = frame.scripts_of(
    "learners", *frame.MAP, "sliders.js", "charts.js", "random.js", "learning.js", "slices.js",
    "side_by_side.js", "learners_shown.js",
)  # fmt: skip
WITH_NETWORK = ("network.js", *SCRIPTS)
SEEDS = 20  # offered
WIDE = 1.0  # of alpha's slider, to either side, in powers of ten
EPISODES = 60  # at most, of learners that fit a network: seconds in the page


def learners(experiment: Experiment) -> HTML:
    """ES and GES side by side on the robot, trained in the page as `study.run` does.

    Args:
        experiment: what both are given; its learner is not read.
    """
    shown = {"parts": ["gauges", "weights"], "charts": ["costs", "gauges"]}
    return _pair("learners", ("ES", "GES"), experiment, shown, SCRIPTS)


def networks(experiment: Experiment) -> HTML:
    """DES and RDES side by side, each with its network, for at most `EPISODES` episodes.

    Args:
        experiment: as for `learners`; with the plain network, which waits for its first fit.
    """
    if experiment.network != "plain" or not experiment.gated:
        raise ValueError(
            f"a page has the plain network and its gate, not network = {experiment.network!r} "
            f"with gated = {experiment.gated}"
        )
    short = replace(experiment, episodes=min(experiment.episodes, EPISODES))
    shown = {"parts": ["weights"], "charts": ["costs", "errors"]}
    return _pair("networks", ("DES", "RDES"), short, shown, WITH_NETWORK)


def _pair(
    name: str,
    pair: tuple[str, str],
    experiment: Experiment,
    shown: Mapping[str, list[str]],
    scripts: tuple[str, ...],
) -> HTML:
    nmpc = controller_of(experiment)

    def data() -> dict[str, Any]:
        return {
            "given": {name: getattr(experiment, name) for name in ("alpha", "decay", "seed")},
            "decays": list(DECAYS),
            "seeds": [*range(SEEDS)],
            "alphas": around(experiment.alpha),
            "settings": {learner: settings(experiment, learner, nmpc) for learner in pair},
            "noise": {"deviation": paper.NOISE, "widths": widths()},
            "overshoot": OVERSHOOT,
            "names": paper.THETA_NAMES,
            "looks": {name: look(name) for name in (*pair, "frozen")},
            "problem": problem_of(nmpc),
            **shown,
            **surroundings(nmpc.task),
        }

    return frame.solving(name, nmpc, data, scripts)


def settings(experiment: Experiment, learner: str, nmpc: Nmpc) -> dict[str, Any]:
    """What `learning.js` is given, without what the page can move."""
    own = replace(experiment, learner=learner)
    return {
        "learner": learner,
        "beta": own.beta,
        "zeta": own.zeta,
        "decayRate": own.decay_rate,
        "episodes": own.episodes,
        "steps": own.steps,
        "evaluateEvery": own.evaluate_every,
        "theta": list(own.theta),
        "w": [paper.W_INIT] * len(own.theta),
        "start": nmpc.task.start.tolist(),
        "target": nmpc.task.target.tolist(),
        "discs": [list(disc) for disc in zip(*nmpc.task.discs, strict=True)],
        "horizon": own.horizon,
        **fixed(),
    }


def around(alpha: float) -> tuple[float, float, float]:
    """The range of a slider of powers of ten, at which alpha is one of the steps."""
    middle = round(log10(alpha), 6)
    return middle - WIDE, middle + WIDE, WIDE / 10

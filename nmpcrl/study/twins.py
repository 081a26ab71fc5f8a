"""Twins: runs that begin a rounding error apart, and how far apart they end."""

from dataclasses import replace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis.summary import Digest
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.sweep import main_study

NUDGE = 1e-12  # added to theta_x at the start
OTHER_SOLVER = "ipopt"
SOLVER_EPISODES = 20  # what the other solver takes a minute for

Pair = tuple[Experiment, Experiment]


def nudged(experiment: Experiment) -> Experiment:
    """The same run with theta_x of theta_init moved by `NUDGE`."""
    first, *rest = experiment.theta
    return replace(experiment, theta=(first + NUDGE, *rest))


def pairs(**fields: Any) -> tuple[Pair, ...]:
    """Every learner's run and its nudged twin; `fields` as `main_study` takes them."""
    moving = [e for e in main_study(**fields) if e.learner != "frozen"]
    return tuple((e, nudged(e)) for e in moving)


def solver_pair(experiment: Experiment) -> Pair:
    """The same short run with the default solver and with the paper's."""
    short = replace(experiment, episodes=min(experiment.episodes, SOLVER_EPISODES))
    return short, replace(short, solver=OTHER_SOLVER)


def separation(one: Digest, other: Digest) -> Vector:
    """The largest difference of any component of theta, after each episode that both reached."""
    apart = np.abs(one.episodes["theta"] - other.episodes["theta"]).max(axis=1)
    return apart[np.isfinite(apart)]

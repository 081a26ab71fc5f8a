"""Perturbed replicas: runs that begin a rounding error apart, to see how far apart they end."""

from dataclasses import replace
from typing import Any

from nmpcrl.study.experiment import Experiment
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.sweeps import paper_runs

PERTURBATION = 1e-12  # added to theta_x at the start
OTHER_SOLVER = "ipopt"
SOLVER_EPISODES = 20  # what the other solver takes a minute for

Pair = tuple[Experiment, Experiment]


def perturbed(experiment: Experiment) -> Experiment:
    """The same run with theta_x of theta_init moved by `PERTURBATION`."""
    first, *rest = experiment.theta
    return replace(experiment, theta=(first + PERTURBATION, *rest))


def pairs(**fields: Any) -> tuple[Pair, ...]:
    """Every learner's run and its perturbed replica; `fields` as `paper_runs` takes them."""
    moving = [e for e in paper_runs(**fields) if LEARNERS[e.learner].moves]
    return tuple((e, perturbed(e)) for e in moving)


def solver_pair(experiment: Experiment) -> Pair:
    """The same short run with the default solver and with the paper's."""
    short = replace(experiment, episodes=min(experiment.episodes, SOLVER_EPISODES))
    return short, replace(short, solver=OTHER_SOLVER)

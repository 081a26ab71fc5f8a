"""The arguments of `train` for an experiment or a trial: controller, learner, weights, noise."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from nmpcrl.control import Nmpc
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.learning import Learner, Weights
from nmpcrl.learning.episode import Loop
from nmpcrl.learning.training import Exploration, Trainer
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.learners import DECAYS, LEARNERS, Generators
from nmpcrl.study.trial import Trial


class Job(NamedTuple):
    """The arguments of `train` and `evaluate` for a run."""

    named: Experiment | Trial  #: canonical
    controller: Nmpc
    learner: Learner
    weights: Weights
    explore: Exploration
    options: dict[str, Any]  #: of `train` alone
    environment: Mapping[str, Any] = MappingProxyType({})  #: of `train` and `evaluate`
    judged: int | np.random.SeedSequence = 0  #: seed of each evaluation


def job_of(named: Experiment | Trial) -> Job:
    """The job of a run."""
    if isinstance(named, Trial):
        return _job_of_trial(named)
    named = named.canonical
    controller = controller_of(named)
    options = {"clipped": named.clipped, "constrained": named.values_actions}
    return Job(named, controller, *prepare(named, controller), options)


def _job_of_trial(trial: Trial) -> Job:
    """The job of a trial; an `Experiment` with the same seed has the same noise."""
    noise, learner, world, judged = np.random.SeedSequence(trial.seed).spawn(4)
    theta, controller = np.array(trial.theta), trial.nmpc
    explore = Exploration.draw(
        np.random.default_rng(noise),
        (trial.episodes, trial.steps, trial.nmpc.m),
        deviation=trial.deviation,
        decay_rate=trial.decay_rate,
    )
    return Job(
        trial,
        controller,
        trial.made(controller, np.random.default_rng(learner)),
        Weights(theta, np.full(theta.size, paper.W_INIT)),
        explore,
        {"rng": np.random.default_rng(world)},
        {"plant": trial.plant, "start": trial.start, "data": trial.data},
        judged,
    )


def controller_of(experiment: Experiment) -> Nmpc:
    """The controller whose theta is learned."""
    return paper.controller(
        experiment.task,
        horizon=experiment.horizon,
        solver=SOLVERS[experiment.solver](tolerance=experiment.tolerance),
        ties_active=experiment.ties_active,
    )


def compile_ahead(named: Iterable[Experiment | Trial]) -> None:
    """Compile the functions of some runs, so that their processes find them compiled."""
    named = tuple(named)
    for trial in {one.nmpc.key: one for one in named if isinstance(one, Trial)}.values():
        trial.nmpc.machine(fix_action=False)
    kinds = {
        (e.layout, e.start, e.target, e.box, e.solver, LEARNERS[e.learner].curved): e
        for e in named
        if isinstance(e, Experiment)
    }
    for (*_, curved), experiment in kinds.items():
        job = job_of(replace(experiment, learner="TDC" if curved else "ES"))
        Loop.of(Trainer(job.learner, job.controller, job.weights, job.explore))


def prepare(experiment: Experiment, controller: Nmpc) -> tuple[Learner, Weights, Exploration]:
    """The learner, its first weights and its noise, which `train` takes beside `controller`."""
    children = np.random.SeedSequence(experiment.seed).spawn(3)
    generators = Generators(*map(np.random.default_rng, children))
    explore = Exploration.draw(
        generators.noise,
        (experiment.episodes, experiment.steps, controller.m),
        deviation=paper.NOISE,
        decay_rate=experiment.decay_rate,
        count=DECAYS[experiment.decay],
    )
    theta = np.array(experiment.theta)
    weights = Weights(theta, np.full(theta.size, paper.W_INIT))
    learner = LEARNERS[experiment.learner].make(experiment, controller, generators)
    return learner, weights, explore

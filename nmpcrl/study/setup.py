"""From an experiment to what `train` takes: controller, learner, first weights and noise."""

from collections.abc import Iterable
from dataclasses import fields
from typing import Any, cast

import numpy as np

from nmpcrl.control.solvers import SOLVERS
from nmpcrl.learning import Learner, Weights
from nmpcrl.learning.rollout import Persistent
from nmpcrl.learning.training import Exploration
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.learners import DECAYS, LEARNERS, Generators, Settings
from nmpcrl.study.parameters import ParameterError


def controller_of(experiment: Experiment) -> Persistent:
    """The controller whose theta is learned."""
    nmpc = paper.controller(
        experiment.task,
        horizon=experiment.horizon,
        solver=SOLVERS[experiment.solver](tolerance=experiment.tolerance),
        ties_active=experiment.ties_active,
    )
    return Persistent(nmpc)


def compile_ahead(experiments: Iterable[Experiment]) -> None:
    """Compile what the runs will call, so that their processes find it done."""
    kinds = {
        (e.layout, e.start, e.target, e.box, e.solver, LEARNERS[e.learner].curved): e
        for e in experiments
    }
    for experiment in kinds.values():
        controller = controller_of(experiment)
        nmpc, theta = controller.nmpc, np.array(paper.THETA_INIT)
        solution = nmpc.solve(nmpc.task.start, theta)
        nmpc.plant.step(solution.state, solution.action)
        nmpc.task.stage_cost(solution.state, solution.action)
        if LEARNERS[experiment.learner].curved:
            nmpc.value_hessian_times(solution, theta)


def prepare(experiment: Experiment, controller: Persistent) -> tuple[Learner, Weights, Exploration]:
    """The learner, its first weights and its noise: all that `train` needs besides `controller`.

    Raises:
        ParameterError: the learner holds or reads what its entry in `LEARNERS` does not say.
    """
    children = np.random.SeedSequence(experiment.seed).spawn(3)
    generators = Generators(*map(np.random.default_rng, children))
    explore = Exploration.draw(
        generators.noise,
        (experiment.episodes, experiment.steps, controller.nmpc.plant.m),
        deviation=paper.NOISE,
        decay_rate=experiment.decay_rate,
        count=DECAYS[experiment.decay],
    )
    theta = np.array(experiment.theta)
    weights = Weights(theta, np.full(theta.size, paper.W_INIT))
    entry = LEARNERS[experiment.learner]
    learner = entry.make(_as_read(experiment), controller, generators)
    if hasattr(learner.bootstrap, "network") and not entry.network:
        raise ParameterError(
            f"learner = {experiment.learner!r} holds a network: its entry in LEARNERS needs"
            " network=True, so that its runs are named by the version of torch, too"
        )
    return learner, weights, explore


def step_size(experiment: Experiment) -> float:
    """The step size of theta that a run's learner has, which its recorded alpha ||phi||^2 uses."""
    return LEARNERS[experiment.learner].step_size(_as_read(experiment))


class _AsRead:
    """An experiment that refuses the fields that its learner's entry does not name."""

    def __init__(self, experiment: Experiment) -> None:
        optional = {one.name for one in fields(experiment) if one.metadata["optional"]}
        self._experiment = experiment
        self._refused = optional - set(LEARNERS[experiment.learner].reads)

    def __getattr__(self, name: str) -> Any:
        if name in self._refused:
            raise ParameterError(
                f"learner = {self._experiment.learner!r} reads {name}: its entry in LEARNERS needs"
                f" {name!r} in `reads`, so that {name} is part of the names of its runs"
            )
        return getattr(self._experiment, name)


def _as_read(experiment: Experiment) -> Settings:
    """The experiment as its learner may read it."""
    return cast(Settings, _AsRead(experiment))

"""From what names a run to what `train` takes: controller, learner, first weights and noise."""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields
from typing import Any, cast

import numpy as np

from nmpcrl.control import SolverError
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.learning import Learner, Weights
from nmpcrl.learning.environment import environment, forecasts
from nmpcrl.learning.rollout import Persistent
from nmpcrl.learning.training import Exploration
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.learners import DECAYS, LEARNERS, Generators, Settings
from nmpcrl.study.parameters import ParameterError
from nmpcrl.study.trial import Trial


@dataclass(frozen=True, eq=False)
class Job:
    """All that a run needs."""

    stated: dict[str, Any]  # what its records say that it is
    controller: Persistent
    learner: Learner
    weights: Weights
    explore: Exploration
    alpha: float  # of the column alpha ||phi||^2
    evaluate_every: int
    options: dict[str, Any]  # of `train` alone
    environment: dict[str, Any] = field(default_factory=dict)  # of `train` and `evaluate`
    rollouts: int = 1  # that judge theta
    judged: int | np.random.SeedSequence = 0  # the seed of each evaluation

    @property
    def episodes(self) -> int:
        """Of training."""
        return len(self.explore.scale)

    @property
    def steps(self) -> int:
        """Of an episode, at most."""
        return len(self.explore.scale[0])


def job_of(named: Experiment | Trial) -> Job:
    """What is to be done to carry out a run."""
    if isinstance(named, Trial):
        return _job_of_trial(named)
    experiment = named.canonical
    controller = controller_of(experiment)
    options = {"clipped": experiment.clipped, "constrained": experiment.values_actions}
    return Job(
        asdict(experiment), controller, *prepare(experiment, controller), step_size(experiment),
        experiment.evaluate_every, options,
    )  # fmt: skip


def _job_of_trial(trial: Trial) -> Job:
    """The noise of a seed is that of an `Experiment` of this seed."""
    trial.refuse_change()
    noise, learner, world, judged = np.random.SeedSequence(trial.seed).spawn(4)
    theta, controller = np.array(trial.theta), Persistent(trial.nmpc)
    explore = Exploration.draw(
        np.random.default_rng(noise),
        (trial.episodes, trial.steps, trial.nmpc.m),
        deviation=trial.deviation,
        decay_rate=trial.decay_rate,
    )
    return Job(
        trial.stated,
        controller,
        trial.made(controller, np.random.default_rng(learner)),
        Weights(theta, np.full(theta.size, paper.W_INIT)),
        explore,
        np.nan,
        trial.evaluate_every,
        {
            "clipped": trial.clipped,
            "constrained": trial.constrained,
            "rng": np.random.default_rng(world),
        },
        trial.environment,
        trial.rollouts,
        judged,
    )


def controller_of(experiment: Experiment) -> Persistent:
    """The controller whose theta is learned."""
    nmpc = paper.controller(
        experiment.task,
        horizon=experiment.horizon,
        solver=SOLVERS[experiment.solver](tolerance=experiment.tolerance),
        ties_active=experiment.ties_active,
    )
    return Persistent(nmpc)


def compile_ahead(named: Iterable[Experiment | Trial]) -> None:
    """Compile what the runs will call, so that their processes find it done."""
    named = tuple(named)
    _compile_trials(one for one in named if isinstance(one, Trial))
    kinds = {
        (e.layout, e.start, e.target, e.box, e.solver, LEARNERS[e.learner].curved): e
        for e in named
        if isinstance(e, Experiment)
    }
    for experiment in kinds.values():
        controller = controller_of(experiment)
        nmpc, theta = controller.nmpc, np.array(paper.THETA_INIT)
        solution = nmpc.solve(nmpc.task.start, theta)
        nmpc.plant.step(solution.state, solution.action)
        nmpc.task.stage_cost(solution.state, solution.action)
        if LEARNERS[experiment.learner].curved:
            nmpc.value_hessian_times(solution, theta)


def _compile_trials(trials: Iterable[Trial]) -> None:
    """Solve once with each controller and in each way that a trial does."""
    for trial in {(one.nmpc.key, one.constrained): one for one in trials}.values():
        around = environment(trial.nmpc, trial.plant, trial.start)
        state, theta = around.start(np.random.default_rng(trial.seed)), np.array(trial.theta)
        ahead = forecasts(trial.data, trial.nmpc.horizon)
        known = ahead and ahead(0)
        with suppress(SolverError):
            plan = trial.nmpc.solve(state, theta, data=known)
            if trial.constrained is not False:
                trial.nmpc.solve(state, theta, plan, plan.action, data=known)


def prepare(experiment: Experiment, controller: Persistent) -> tuple[Learner, Weights, Exploration]:
    """The learner, its first weights and its noise: all that `train` needs besides `controller`.

    Raises:
        ParameterError: the learner holds or reads what its entry in `LEARNERS` does not say.
    """
    children = np.random.SeedSequence(experiment.seed).spawn(3)
    generators = Generators(*map(np.random.default_rng, children))
    explore = Exploration.draw(
        generators.noise,
        (experiment.episodes, experiment.steps, controller.nmpc.m),
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

"""From an experiment to what `train` takes: controller, learner, first weights and noise."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from nmpcrl import Vector
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.learning import (
    Learner,
    Weights,
    deep_expected_sarsa,
    expected_sarsa,
    frozen,
    gradient_expected_sarsa,
    gradient_tdc,
    q_learning,
    random_direction,
    regularized_deep_expected_sarsa,
    step_matched,
)
from nmpcrl.learning.rollout import Persistent
from nmpcrl.learning.training import Exploration, count_episodes, count_steps
from nmpcrl.study import paper
from nmpcrl.study.parameters import ParameterError

if TYPE_CHECKING:
    from nmpcrl.study.experiment import Experiment

SMALL_BUFFER = 10 * paper.STEPS  # examples
AVERAGING = 0.005  # the part of the way that a slow copy goes a step: Fujimoto et al. (2018)
LEAST_SCALE = 1e-3  # that an input of the normalised network is divided by

DECAYS = {"step": count_steps, "episode": count_episodes}  # departure C


class Generators(NamedTuple):
    """One generator a purpose, so that all learners of a seed meet the same noise."""

    noise: np.random.Generator
    network: np.random.Generator
    directions: np.random.Generator  # of a control that draws them


Factory = Callable[["Experiment", Persistent, Generators], Learner]


def controller_of(experiment: "Experiment") -> Persistent:
    """The controller whose theta is learned."""
    nmpc = paper.controller(
        experiment.task,
        horizon=experiment.horizon,
        solver=SOLVERS[experiment.solver](tolerance=experiment.tolerance),
        ties_active=experiment.ties_active,
    )
    return Persistent(nmpc)


def compile_ahead(experiments: Iterable["Experiment"]) -> None:
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


def prepare(
    experiment: "Experiment", controller: Persistent
) -> tuple[Learner, Weights, Exploration]:
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


def step_size(experiment: "Experiment") -> float:
    """The step size of theta that a run's learner has, which its recorded alpha ||phi||^2 uses."""
    return LEARNERS[experiment.learner].step_size(_as_read(experiment))


def readers(name: str) -> tuple[str, ...]:
    """The learners that read a field of `Experiment` that not all do."""
    return tuple(learner for learner, entry in LEARNERS.items() if name in entry.reads)


class _AsRead:
    """An experiment that refuses the fields that its learner's entry does not name."""

    def __init__(self, experiment: "Experiment") -> None:
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


def _as_read(experiment: "Experiment") -> "Experiment":
    """The experiment as its learner may read it."""
    return cast("Experiment", _AsRead(experiment))


class Network(NamedTuple):
    """A way to read what the paper leaves open of the network.  # departures H and I"""

    options: Mapping[str, Any] = MappingProxyType({})  # of `QNetwork`
    fits: int = 1  # mini-batches a step
    normalised: bool = False  # whether inputs and target are divided by `scales`
    target: Callable[["Experiment"], Mapping[str, Any]] | None = None  # gives options of `Target`
    late: bool = False  # whether the value is predicted before the step's fit
    greedy: bool = False  # whether the next action is the network's minimiser, and not u_1


NETWORKS = {
    "plain": Network(),
    "normalised": Network(normalised=True),
    "tanh": Network({"activation": "tanh"}),
    "small buffer": Network({"memory": SMALL_BUFFER}),
    "four fits": Network(fits=4),
    "lagged": Network(target=lambda e: {"every": e.steps}),  # refreshed once an episode
    "averaged": Network(target=lambda _: {"rate": AVERAGING}),
    "greedy": Network(greedy=True),
    "late": Network(late=True),
}


def _network_learner(
    make: Callable[..., Learner],
    experiment: "Experiment",
    controller: Persistent,
    generators: Generators,
    *,
    with_theta: bool,
) -> Learner:
    """A learner whose network predicts the next value."""
    from nmpcrl.learning.network import QNetwork, Target  # and torch: not for the other learners

    plant, read = controller.nmpc.plant, NETWORKS[experiment.network]
    options = read.options
    if read.normalised:
        scales = _scales(controller, np.array(experiment.theta), with_theta=with_theta)
        options = {**options, "scales": scales}
    network = QNetwork(
        plant.n + plant.m + with_theta * len(experiment.theta),
        generators.network,
        learning_rate=experiment.zeta,
        batch=paper.BATCH,
        hidden=paper.HIDDEN,
        **options,
    )
    return make(
        controller,
        network,
        experiment.alpha,
        gated=experiment.gated,
        fits=read.fits,
        target=Target(network, **read.target(experiment)) if read.target else None,
        late=read.late,
        actions=(plant.lower, plant.upper) if read.greedy else None,
    )


def _scales(controller: Persistent, theta: Vector, *, with_theta: bool) -> tuple[Vector, float]:
    """What the inputs and the target of the normalised network are divided by.

    A state by the box's half width, or pi where it has none; an action by its bound; theta by
    theta_init; the value by that of theta_init at the start.
    """
    nmpc = controller.nmpc
    half = (nmpc.task.upper - nmpc.task.lower) / 2
    state = np.where(np.isfinite(half), half, np.pi)
    parts = [state, nmpc.plant.upper, *([np.abs(theta)] if with_theta else [])]
    value = nmpc.solve(nmpc.task.start, theta).value
    return np.maximum(np.concatenate(parts), LEAST_SCALE), max(abs(value), LEAST_SCALE)


def _tdc(experiment: "Experiment", controller: Persistent, _: Generators) -> Learner:
    """Exact TDC, with each part that it adds to GES or without."""
    return gradient_tdc(
        controller,
        experiment.alpha,
        experiment.beta_tdc,
        curvature=experiment.curvature,
        projection=paper.THETA_SET if experiment.projected else None,
    )


MOVING = ("alpha", "ties_active")  # fields that learners read whose theta moves
VALUING = (*MOVING, "constrained")  # that may value u_0 = a or not
IMITATING = (*VALUING, "zeta", "gated", "network")  # that hold a network


@dataclass(frozen=True)
class Entry:
    """A learner as experiments name it.

    A field of `Experiment` that not all learners read is read, and is part of a run's key, only
    where `reads` has it; a factory that reads another is refused.
    """

    make: Factory
    reads: tuple[str, ...] = VALUING  # fields that not all learners read
    network: bool = False  # whether it holds one: torch then is part of its keys
    solves: int = 2  # a step, without the one for Q(s, a)
    step_size: Callable[["Experiment"], float] = lambda e: e.alpha  # of theta
    moves: bool = True  # whether theta does
    valued: bool = False  # whether Q(s, a) itself is always learned, with u_0 = a fixed
    curved: bool = False  # whether it asks for the Hessian of the value


def _imitating(make: Callable[..., Learner], *, with_theta: bool) -> Entry:
    """The entry of a learner whose network predicts the next value."""
    factory = partial(_network_learner, make, with_theta=with_theta)
    return Entry(factory, IMITATING, network=True, solves=1)


LEARNERS: dict[str, Entry] = {  # the only list of learners: a name that is not in it is refused
    "ES": Entry(lambda e, nmpc, _: expected_sarsa(nmpc, e.alpha)),
    "DES": _imitating(deep_expected_sarsa, with_theta=False),
    "RDES": _imitating(regularized_deep_expected_sarsa, with_theta=True),
    "GES": Entry(
        lambda e, nmpc, _: gradient_expected_sarsa(nmpc, e.alpha, e.beta), (*VALUING, "beta")
    ),
    "TDC": Entry(_tdc, (*VALUING, "curvature", "projected", "beta_tdc"), curved=True),
    "QL": Entry(lambda e, nmpc, _: q_learning(nmpc, e.alpha), MOVING, valued=True),
    "frozen": Entry(
        lambda _, nmpc, __: frozen(nmpc),
        reads=(),
        solves=1,
        step_size=lambda _: paper.ALPHA,  # that theta would have
        moves=False,
    ),
    "matched": Entry(lambda e, nmpc, _: step_matched(nmpc, e.alpha, e.beta), (*VALUING, "beta")),
    "random": Entry(lambda e, nmpc, rngs: random_direction(nmpc, e.alpha, rngs.directions)),
}

"""From an experiment to what `train` takes: controller, learner, first weights and noise."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

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

if TYPE_CHECKING:
    from nmpcrl.study.experiment import Experiment

SMALL_BUFFER = 10 * paper.STEPS  # examples
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
        (e.layout, e.start, e.target, e.box, e.solver, e.learner == "TDC"): e for e in experiments
    }
    for experiment in kinds.values():
        controller = controller_of(experiment)
        nmpc, theta = controller.nmpc, np.array(paper.THETA_INIT)
        solution = nmpc.solve(nmpc.task.start, theta)
        nmpc.plant.step(solution.state, solution.action)
        nmpc.task.stage_cost(solution.state, solution.action)
        if experiment.learner == "TDC":
            nmpc.value_hessian_times(solution, theta)


def prepare(
    experiment: "Experiment", controller: Persistent
) -> tuple[Learner, Weights, Exploration]:
    """The learner, its first weights and its noise: all that `train` needs besides `controller`."""
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
    return LEARNERS[experiment.learner](experiment, controller, generators), weights, explore


class Network(NamedTuple):
    """A way to read what the paper leaves open of the network.  # departure H"""

    options: Mapping[str, Any] = MappingProxyType({})  # of `QNetwork`
    fits: int = 1  # mini-batches a step
    normalised: bool = False  # whether inputs and target are divided by `scales`


NETWORKS = {
    "plain": Network(),
    "normalised": Network(normalised=True),
    "tanh": Network({"activation": "tanh"}),
    "small buffer": Network({"memory": SMALL_BUFFER}),
    "four fits": Network(fits=4),
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
    from nmpcrl.learning.network import QNetwork  # and with it torch: not for the other learners

    plant, (options, fits, normalised) = controller.nmpc.plant, NETWORKS[experiment.network]
    if normalised:
        scales = _scales(controller, np.array(experiment.theta), with_theta=with_theta)
        options = {**options, "scales": scales}
    network = QNetwork(
        plant.n + plant.m + with_theta * len(experiment.theta),
        generators.network,
        learning_rate=experiment.zeta,
        batch=paper.BATCH,
        **options,
    )
    return make(controller, network, experiment.alpha, gated=experiment.gated, fits=fits)


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


LEARNERS: dict[str, Factory] = {  # the only list of learners: a name that is not in it is refused
    "ES": lambda e, nmpc, _: expected_sarsa(nmpc, e.alpha),
    "DES": partial(_network_learner, deep_expected_sarsa, with_theta=False),
    "RDES": partial(_network_learner, regularized_deep_expected_sarsa, with_theta=True),
    "GES": lambda e, nmpc, _: gradient_expected_sarsa(nmpc, e.alpha, e.beta),
    "TDC": _tdc,
    "QL": lambda e, nmpc, _: q_learning(nmpc, e.alpha),
    "frozen": lambda _, nmpc, __: frozen(nmpc),
    "matched": lambda e, nmpc, _: step_matched(nmpc, e.alpha, e.beta),
    "random": lambda e, nmpc, rngs: random_direction(nmpc, e.alpha, rngs.directions),
}

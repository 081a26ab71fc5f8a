"""The learners, networks and decays that experiments name, and how each is made."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from nmpcrl import Vector
from nmpcrl.learning import (
    Learner,
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
from nmpcrl.learning.training import count_episodes, count_steps
from nmpcrl.study import paper

SMALL_BUFFER = 10 * paper.STEPS  # examples
AVERAGING = 0.005  # rate of the averaged copy: Fujimoto et al. (2018)
LEAST_SCALE = 1e-3  # of an input of the normalised network

Settings = Any  # an `Experiment`

DECAYS = {"step": count_steps, "episode": count_episodes}  # departure C


class Generators(NamedTuple):
    """A generator for each purpose; all learners of a seed have the same noise."""

    noise: np.random.Generator
    network: np.random.Generator
    directions: np.random.Generator  # of the control with random directions


Factory = Callable[[Settings, Persistent, Generators], Learner]


class Network(NamedTuple):
    """A reading of what the paper leaves open of the network.  # departures H and I"""

    options: Mapping[str, Any] = MappingProxyType({})  # of `QNetwork`
    fits: int = 1  # mini-batches a step
    normalised: bool = False  # whether inputs and target are scaled
    target: Callable[[Settings], Mapping[str, Any]] | None = None  # options of `Target`
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
    settings: Settings,
    controller: Persistent,
    generators: Generators,
    *,
    with_theta: bool,
) -> Learner:
    """A learner whose network predicts the next value."""
    from nmpcrl.learning.network import QNetwork, Target  # and torch: not for the other learners

    nmpc, read = controller.nmpc, NETWORKS[settings.network]
    options = read.options
    if read.normalised:
        scales = _scales(controller, np.array(settings.theta), with_theta=with_theta)
        options = {**options, "scales": scales}
    network = QNetwork(
        nmpc.n + nmpc.m + with_theta * len(settings.theta),
        generators.network,
        learning_rate=settings.zeta,
        batch=paper.BATCH,
        hidden=paper.HIDDEN,
        **options,
    )
    return make(
        controller,
        network,
        settings.alpha,
        gated=settings.gated,
        fits=read.fits,
        target=Target(network, **read.target(settings)) if read.target else None,
        late=read.late,
        actions=(nmpc.lower, nmpc.upper) if read.greedy else None,
    )


def _scales(controller: Persistent, theta: Vector, *, with_theta: bool) -> tuple[Vector, float]:
    """The scales of the normalised network's inputs and of its target.

    A state is divided by the box's half width, or by pi where it has none; an action by its bound;
    theta by theta_init; the value by the value of theta_init at the start.
    """
    nmpc = controller.nmpc
    half = (nmpc.task.upper - nmpc.task.lower) / 2
    state = np.where(np.isfinite(half), half, np.pi)
    parts = [state, nmpc.plant.upper, *([np.abs(theta)] if with_theta else [])]
    value = nmpc.solve(nmpc.task.start, theta).value
    return np.maximum(np.concatenate(parts), LEAST_SCALE), max(abs(value), LEAST_SCALE)


def _tdc(settings: Settings, controller: Persistent, _: Generators) -> Learner:
    """Exact TDC; curvature and projection can be left out."""
    return gradient_tdc(
        controller,
        settings.alpha,
        settings.beta_tdc,
        curvature=settings.curvature,
        projection=paper.THETA_SET if settings.projected else None,
    )


# Fields read by learners that move theta, by those that solve for V(s) or Q(s, a), and by those
# with a network.
MOVING = ("alpha", "ties_active")
VALUING = (*MOVING, "constrained")
IMITATING = (*VALUING, "zeta", "gated", "network")


@dataclass(frozen=True)
class Entry:
    """A learner that experiments can name.

    A field of `Experiment` that only some learners read is part of the keys of their runs alone.
    """

    make: Factory
    reads: tuple[str, ...] = VALUING  # fields that only some learners read
    network: bool = False  # whether a network learns: torch is part of the keys then
    solves: int = 2  # a step, without the one for Q(s, a)
    step_size: Callable[[Settings], float] = lambda e: e.alpha  # of theta
    moves: bool = True  # whether theta moves
    valued: bool = False  # whether Q(s, a) is always learned, with u_0 = a fixed
    curved: bool = False  # whether the Hessian of the value is used


def _imitating(make: Callable[..., Learner], *, with_theta: bool) -> Entry:
    """The entry of a learner whose network predicts the next value."""
    factory = partial(_network_learner, make, with_theta=with_theta)
    return Entry(factory, IMITATING, network=True, solves=1)


LEARNERS: dict[str, Entry] = {
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
        step_size=lambda _: paper.ALPHA,  # of the ES that the run is compared with
        moves=False,
    ),
    "matched": Entry(lambda e, nmpc, _: step_matched(nmpc, e.alpha, e.beta), (*VALUING, "beta")),
    "random": Entry(lambda e, nmpc, rngs: random_direction(nmpc, e.alpha, rngs.directions)),
}


def readers(name: str) -> tuple[str, ...]:
    """The learners that read a field of `Experiment`; none for a field that all learners read."""
    return tuple(learner for learner, entry in LEARNERS.items() if name in entry.reads)

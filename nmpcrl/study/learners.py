"""The learners, networks and decays that experiments name, and how each is made."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

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
AVERAGING = 0.005  # the part of the way that a slow copy goes a step: Fujimoto et al. (2018)
LEAST_SCALE = 1e-3  # that an input of the normalised network is divided by

DECAYS = {"step": count_steps, "episode": count_episodes}  # departure C


class Settings(Protocol):
    """The fields of an `Experiment` that its learner may read."""

    alpha: float
    beta: float
    zeta: float
    gated: bool
    network: str
    curvature: bool
    projected: bool
    beta_tdc: float
    theta: tuple[float, ...]
    steps: int


class Generators(NamedTuple):
    """One generator a purpose, so that all learners of a seed meet the same noise."""

    noise: np.random.Generator
    network: np.random.Generator
    directions: np.random.Generator  # of a control that draws them


Factory = Callable[[Settings, Persistent, Generators], Learner]


class Network(NamedTuple):
    """A way to read what the paper leaves open of the network.  # departures H and I"""

    options: Mapping[str, Any] = MappingProxyType({})  # of `QNetwork`
    fits: int = 1  # mini-batches a step
    normalised: bool = False  # whether inputs and target are divided by `scales`
    target: Callable[[Settings], Mapping[str, Any]] | None = None  # gives options of `Target`
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


def _tdc(settings: Settings, controller: Persistent, _: Generators) -> Learner:
    """Exact TDC, with each part that it adds to GES or without."""
    return gradient_tdc(
        controller,
        settings.alpha,
        settings.beta_tdc,
        curvature=settings.curvature,
        projection=paper.THETA_SET if settings.projected else None,
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
    step_size: Callable[[Settings], float] = lambda e: e.alpha  # of theta
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


def readers(name: str) -> tuple[str, ...]:
    """The learners that read a field of `Experiment` that not all do."""
    return tuple(learner for learner, entry in LEARNERS.items() if name in entry.reads)

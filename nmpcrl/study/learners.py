"""The learners, networks and decays that experiments name, and how each is made."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from nmpcrl import Vector, learning
from nmpcrl.control import Nmpc
from nmpcrl.learning import Learner
from nmpcrl.learning.network import QNetwork, Target
from nmpcrl.learning.training import count_episodes, count_steps
from nmpcrl.study import paper

DECAYS = {"step": count_steps, "episode": count_episodes}  # departure C
Settings = Any  # an `Experiment`


class Generators(NamedTuple):
    """A generator for each purpose; all learners of a seed have the same noise."""

    noise: np.random.Generator
    network: np.random.Generator
    directions: np.random.Generator  #: of the control with random directions


Factory = Callable[[Settings, Nmpc, Generators], Learner]


class Network(NamedTuple):
    """A reading of what the paper leaves open of the network.  # departures H and I"""

    options: Mapping[str, Any] = MappingProxyType({})  #: of `QNetwork`
    fits: int = 1  #: mini-batches a step
    normalised: bool = False  #: whether inputs and target are scaled
    target: Callable[[Settings], Mapping[str, Any]] | None = None  #: options of `Target`
    late: bool = False  #: whether the value is predicted before the step's fit
    greedy: bool = False  #: whether the next action is the network's minimiser, and not u_1


NETWORKS = {
    "plain": Network(),
    "normalised": Network(normalised=True),
    "tanh": Network({"activation": "tanh"}),
    "small buffer": Network({"memory": 10 * paper.STEPS}),  # examples
    "four fits": Network(fits=4),
    "lagged": Network(target=lambda e: {"every": e.steps}),  # refreshed once an episode
    "averaged": Network(target=lambda _: {"rate": 0.005}),  # Fujimoto et al. (2018)
    "greedy": Network(greedy=True),
    "late": Network(late=True),
}


def _scales(nmpc: Nmpc, theta: Vector, *, with_theta: bool) -> tuple[Vector, float]:
    """The scales of the normalised network's inputs and of its target, 1e-3 or more.

    A state is divided by the box's half width, or by pi without a box; an action by its bound;
    theta by theta_init; the value by the value of theta_init at the start.
    """
    half = (nmpc.task.upper - nmpc.task.lower) / 2
    state = np.where(np.isfinite(half), half, np.pi)
    parts = [state, nmpc.plant.upper, *([np.abs(theta)] if with_theta else [])]
    value = nmpc.solve(nmpc.task.start, theta).value
    return np.maximum(np.concatenate(parts), 1e-3), max(abs(value), 1e-3)


# Fields read by learners that move theta, that solve for V(s) or Q(s, a), and with a network.
MOVING = ("alpha", "ties_active")
VALUING = (*MOVING, "constrained")
IMITATING = (*VALUING, "zeta", "gated", "network")


@dataclass(frozen=True)
class Entry:
    """A learner that experiments can name."""

    make: Factory
    reads: tuple[str, ...] = VALUING  #: fields that only some learners read
    network: bool = False  #: whether a network learns, torch is part of the keys then
    solves: int = 2  #: a step, without the one for Q(s, a)
    valued: bool = False  #: whether Q(s, a) is always learned, with u_0 = a fixed
    curved: bool = False  #: whether the Hessian of the value is used


def _imitating(make: Callable[..., Learner], *, with_theta: bool) -> Entry:
    """The entry of a learner whose network predicts the next value."""

    def factory(settings: Settings, nmpc: Nmpc, generators: Generators) -> Learner:
        read = NETWORKS[settings.network]
        scales: tuple[Vector | float, float] = (1.0, 1.0)
        if read.normalised:
            scales = _scales(nmpc, np.array(settings.theta), with_theta=with_theta)
        network = QNetwork(
            nmpc.n + nmpc.m + with_theta * len(settings.theta),
            generators.network,
            learning_rate=settings.zeta,
            batch=paper.BATCH,
            hidden=paper.HIDDEN,
            scales=scales,
            **read.options,
        )
        return make(
            nmpc,
            network,
            settings.alpha,
            gated=settings.gated,
            fits=read.fits,
            target=Target(network, **read.target(settings)) if read.target else None,
            late=read.late,
            actions=(nmpc.lower, nmpc.upper) if read.greedy else None,
        )

    return Entry(factory, IMITATING, network=True, solves=1)


LEARNERS: dict[str, Entry] = {
    "ES": Entry(lambda e, nmpc, _: learning.expected_sarsa(nmpc, e.alpha)),
    "DES": _imitating(learning.deep_expected_sarsa, with_theta=False),
    "RDES": _imitating(learning.regularized_deep_expected_sarsa, with_theta=True),
    "GES": Entry(
        lambda e, nmpc, _: learning.gradient_expected_sarsa(nmpc, e.alpha, e.beta),
        (*VALUING, "beta"),
    ),
    "TDC": Entry(
        lambda e, nmpc, _: learning.gradient_tdc(
            nmpc,
            e.alpha,
            e.beta_tdc,
            curvature=e.curvature,
            projection=paper.THETA_SET if e.projected else None,
        ),
        (*VALUING, "curvature", "projected", "beta_tdc"),
        curved=True,
    ),
    "QL": Entry(lambda e, nmpc, _: learning.q_learning(nmpc, e.alpha), MOVING, valued=True),
    "frozen": Entry(lambda _, nmpc, __: learning.frozen(nmpc), reads=(), solves=1),
    "matched": Entry(
        lambda e, nmpc, _: learning.step_matched(nmpc, e.alpha, e.beta), (*VALUING, "beta")
    ),
    "random": Entry(
        lambda e, nmpc, rngs: learning.random_direction(nmpc, e.alpha, rngs.directions)
    ),
}


def readers(name: str) -> tuple[str, ...]:
    """The learners that read a field of `Experiment`; none for a field that all learners read."""
    return tuple(learner for learner, entry in LEARNERS.items() if name in entry.reads)

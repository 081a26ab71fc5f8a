"""Theta as an input of the network, Eq. (11): why runs of the more accurate network stop sooner.

A step theta + alpha delta phi changes V in s by alpha delta phi'phi, and the target gamma Q(s+, a+)
by alpha delta gamma psi'phi, where psi is the prediction's slope in theta. The ratio is the
`feedback`: above 1 a step enlarges the TD error. A second solve has psi = phi+, a network without
theta has psi = 0. A network with theta has learned its slope from the thetas seen so far, which lie
along one line, and predicts at the end of this line. An intervention changes the prediction alone.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.metrics import root_mean_square
from nmpcrl.control import Nmpc
from nmpcrl.learning.bootstrap import Bootstrap, Imitation, NextValue, Transition
from nmpcrl.learning.training import Diverged, train
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.setup import controller_of, prepare

PROBE = 1e-5  # alpha delta of the step along which a slope is measured: delta = 100 at the paper's


@dataclass
class StartTheta:
    """The network predicts with the first theta of the episode; examples and fits are unchanged.

    With `true_slope` the change of the NMPC's own V in s+ since that theta is added.
    """

    network: Imitation
    controller: Nmpc
    true_slope: bool = False
    theta: Vector | None = field(default=None, init=False)  # None before an episode

    def __call__(self, transition: Transition, theta: Vector) -> NextValue | None:
        """Value the next state."""
        first = theta if self.theta is None else self.theta
        self.theta = None if transition.last else first
        successor = self.network(transition, first)
        if not self.true_slope or successor is None or transition.end:
            return successor
        now, then = (
            self.controller.solve(transition.next_state, one, transition.solution).value
            for one in (theta, first)
        )
        return replace(successor, value=successor.value + now - then)


INTERVENTIONS: Mapping[str, Callable[[Imitation, Nmpc], Bootstrap]] = {
    "none": lambda network, _: network,
    "theta held": StartTheta,
    "true slope": partial(StartTheta, true_slope=True),
}


def feedback(network: Imitation, transition: Transition, theta: Vector, gamma: float) -> float:
    """gamma psi'phi / phi'phi; psi is the network's slope in theta at (s+, a+), along phi."""
    phi, where = transition.solution.features, transition.next_state
    ahead, behind = (
        network.network.predict(
            network.inputs(where, transition.solution.next_action, theta + sign * PROBE * phi)
        )
        for sign in (1, -1)
    )
    return float(gamma * (ahead - behind) / (2 * PROBE * (phi @ phi)))


@dataclass(frozen=True, eq=False)
class Outcome:
    """One run, by episode begun; nan where the episode has no prediction."""

    stopped: bool
    episodes: int  # begun
    delta: Vector  # root mean square
    overshoot: Vector  # largest alpha ||phi||^2
    feedback: Vector  # median over the steps with a prediction


def watch(experiment: Experiment, intervention: str = "none") -> Outcome:
    """Train a learner that imitates, with one of `INTERVENTIONS`, and measure its `feedback`."""
    controller = controller_of(experiment)
    learner, weights, explore = prepare(experiment, controller)
    network = learner.bootstrap
    if not isinstance(network, Imitation):
        raise TypeError(f"learner = {experiment.learner!r} has no network that is asked with theta")
    changed = INTERVENTIONS[intervention](network, controller)
    fed: list[float] = []

    def watched(transition: Transition, theta: Vector) -> NextValue | None:
        successor = changed(transition, theta)
        if successor is not None:
            fed.append(feedback(network, transition, theta, learner.gamma))
        return successor

    stopped, episodes, rows = False, 0, list[tuple[float, ...]]()
    how: Any = {"clipped": experiment.clipped, "constrained": experiment.values_actions}
    try:
        for step in train(replace(learner, bootstrap=watched), controller, weights, explore, **how):
            episodes = step.episode + 1
            if step.solution and step.update and step.update.delta is not None:
                phi = step.solution.features
                square = experiment.alpha * float(phi @ phi)
                rows.append((step.episode, step.update.delta, square, fed[-1]))
    except Diverged:
        stopped = True
    columns = ["episode", "delta", "overshoot", "feedback"]
    by_episode = (
        pd.DataFrame(rows, columns=columns, dtype=float)
        .groupby("episode")
        .agg({"delta": root_mean_square, "overshoot": "max", "feedback": "median"})
    )
    numbers = by_episode.reindex(range(episodes)).to_numpy(float)
    return Outcome(stopped, episodes, *numbers.T)

"""Why the more accurate network dies sooner: what theta does as an input of the network, Eq. (11).

A step theta + alpha delta phi changes V in s by alpha delta phi'phi, and the target gamma Q(s+, a+)
by alpha delta gamma psi'phi, where psi is the slope in theta of whatever predicts. Their ratio is
the `feedback`: below 1 the TD error shrinks, above 1 a step makes it larger. A second solve has
psi = phi+. A network without theta has psi = 0. One with theta has the slope that it learned from
the thetas seen so far, which lie along one line, and it is asked at the end of it.

An intervention changes what predicts, and nothing else: the same noise, first weights, examples
and fits.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.learning.bootstrap import Bootstrap, Imitation, Successor, Transition
from nmpcrl.learning.rollout import Persistent
from nmpcrl.learning.training import Diverged, train
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.setup import controller_of, prepare

PROBE = 1e-5  # alpha delta of the step along which a slope is measured: delta = 100 at the paper's


@dataclass
class Held:
    """The network is asked with theta of the start of the episode; it learns as before."""

    network: Imitation
    controller: Persistent
    theta: Vector | None = field(default=None, init=False)  # None where an episode begins

    def __call__(self, transition: Transition, theta: Vector) -> Successor | None:
        """Value the next state under the theta that is held."""
        if self.theta is None:
            self.theta = theta
        successor = self._value(transition, theta, self.theta)
        if transition.last:
            self.theta = None
        return successor

    def _value(self, transition: Transition, theta: Vector, held: Vector) -> Successor | None:
        return self.network(transition, held)


@dataclass
class TrueSlope(Held):
    """`Held`, and what theta has changed since is the NMPC's own change of V in s+."""

    def _value(self, transition: Transition, theta: Vector, held: Vector) -> Successor | None:
        successor = self.network(transition, held)
        if successor is None or transition.end:
            return successor
        now, then = (
            self.controller.solve(transition.next_state, one, transition.solution).value
            for one in (theta, held)
        )
        return replace(successor, value=successor.value + now - then)


def untouched(network: Imitation, controller: Persistent) -> Bootstrap:
    """The network of the experiment."""
    return network


INTERVENTIONS: Mapping[str, Callable[[Imitation, Persistent], Bootstrap]] = {
    "none": untouched,
    "theta held": Held,
    "true slope": TrueSlope,
}


def feedback(
    network: Imitation, transition: Transition, theta: Vector, gamma: float, probe: float = PROBE
) -> float:
    """gamma psi'phi / phi'phi, psi being the network's slope in theta at (s+, a+), along phi."""
    phi, where = transition.solution.features, transition.next_state
    ahead, behind = (
        network.network.predict(
            network.inputs(where, transition.solution.next_action, theta + sign * probe * phi)
        )
        for sign in (1, -1)
    )
    return float(gamma * (ahead - behind) / (2 * probe * (phi @ phi)))


@dataclass(frozen=True, eq=False)
class Outcome:
    """One run; a column has a row an episode that was begun, nan where nothing was predicted."""

    stopped: bool
    theta: Matrix  # at the end, shape (episodes, d)
    delta: Vector  # root mean square
    overshoot: Vector  # largest alpha ||phi||^2
    feedback: Vector  # median over the steps with a prediction

    @property
    def episodes(self) -> int:
        """How many were begun."""
        return len(self.theta)


def watch(experiment: Experiment, intervention: str = "none") -> Outcome:
    """Train a learner that imitates, with one of `INTERVENTIONS`, and measure its `feedback`.

    Raises:
        KeyError: there is no such intervention.
        TypeError: the experiment's learner has no network.
    """
    change, controller = INTERVENTIONS[intervention], controller_of(experiment)
    learner, weights, explore = prepare(experiment, controller)
    network = learner.bootstrap
    if not isinstance(network, Imitation):
        raise TypeError(f"learner = {experiment.learner!r} has no network that is asked with theta")
    changed = change(network, controller)
    fed: list[float] = []

    def watched(transition: Transition, theta: Vector) -> Successor | None:
        successor = changed(transition, theta)
        if successor is not None:
            fed.append(feedback(network, transition, theta, learner.gamma))
        return successor

    stopped, thetas = False, list[Vector]()
    rows: list[list[tuple[float, float, float]]] = []  # by episode, of the steps with a prediction
    steps = train(
        replace(learner, bootstrap=watched),
        controller,
        weights,
        explore,
        clipped=experiment.clipped,
        constrained=experiment.values_actions,
    )
    try:
        for step in steps:
            if step.episode == len(thetas):
                thetas.append(step.weights.theta)
                rows.append([])
            thetas[-1] = step.weights.theta
            if step.solution and step.update and step.update.delta is not None:
                phi = step.solution.features
                square = experiment.alpha * float(phi @ phi)
                rows[-1].append((step.update.delta, square, fed[-1]))
    except Diverged:
        stopped = True
    columns = [np.array(each or [(np.nan,) * 3]).T for each in rows]
    return Outcome(
        stopped,
        np.array(thetas),
        np.array([np.sqrt(np.mean(delta**2)) for delta, _, _ in columns]),
        np.array([overshoot.max() for _, overshoot, _ in columns]),
        np.array([np.median(own) for _, _, own in columns]),
    )

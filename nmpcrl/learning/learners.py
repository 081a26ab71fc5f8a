"""The learners: learner = bootstrap x update rule.

| learner | next value        | theta moves by                  |
|---------|-------------------|---------------------------------|
| ES      | a second solve    | a semi-gradient                 |
| DES     | a network (s, a)  | a semi-gradient                 |
| RDES    | ... (s, a, theta) | a semi-gradient                 |
| GES     | a second solve    | gradient TD with the weights w  |
| frozen  | not asked         | nothing: the control arm        |
"""

from collections.abc import Callable
from dataclasses import dataclass

from nmpcrl import Vector
from nmpcrl.learning.bootstrap import (
    Bootstrap,
    Controller,
    Imitation,
    SecondSolve,
    Successor,
    Transition,
)
from nmpcrl.learning.network import QNetwork
from nmpcrl.learning.updates import (
    auxiliary_step,
    gradient_td_step,
    semi_gradient_step,
    td_error,
)


@dataclass(frozen=True, eq=False)
class Weights:
    """Everything that an update rule moves."""

    theta: Vector  # of the NMPC, shape (d,)
    w: Vector  # auxiliary weights of gradient TD, shape (d,)


# (weights, delta, phi, phi+) -> weights
UpdateRule = Callable[[Weights, float, Vector, Vector | None], Weights]


@dataclass(frozen=True, eq=False)
class Update:
    """What one step of learning did."""

    weights: Weights  # after the step
    successor: Successor | None = None  # None when nothing was bootstrapped
    delta: float | None = None  # TD error; None when there was none, and the weights are unchanged


@dataclass(frozen=True)
class Learner:
    """A bootstrap and an update rule; a step is pure but for the network a bootstrap trains."""

    name: str
    bootstrap: Bootstrap
    rule: UpdateRule
    gamma: float  # discount factor of the TD error

    def step(self, weights: Weights, transition: Transition) -> Update:
        """Value the next state, form the TD error, and move the weights.

        Raises:
            SolverError: the next state was to be solved and could not be.
        """
        successor = self.bootstrap(transition, weights.theta)
        if successor is None:
            return Update(weights)
        solution = transition.solution
        delta = td_error(transition.cost, self.gamma, solution.value, successor.value)
        moved = self.rule(weights, delta, solution.features, successor.features)
        return Update(moved, successor, delta)


def semi_gradient(alpha: float) -> UpdateRule:
    """Eq. (9): move theta along delta phi."""

    def rule(weights: Weights, delta: float, phi: Vector, _: Vector | None) -> Weights:
        return Weights(semi_gradient_step(weights.theta, delta, phi, alpha), weights.w)

    return rule


def gradient_td(alpha: float, beta: float, gamma: float) -> UpdateRule:
    """Eq. (16): move theta and w, both from the old ones."""

    def rule(weights: Weights, delta: float, phi: Vector, phi_next: Vector | None) -> Weights:
        if phi_next is None:
            raise ValueError(
                "gradient TD needs the next state's features: bootstrap by SecondSolve"
            )
        theta, w = weights.theta, weights.w
        return Weights(
            theta=gradient_td_step(theta, w, delta, phi, phi_next, alpha=alpha, gamma=gamma),
            w=auxiliary_step(w, delta, phi, beta),
        )

    return rule


def expected_sarsa(nmpc: Controller, alpha: float) -> Learner:
    """ES: two solves a step, semi-gradient (Moradimaryamnegari et al. 2022)."""
    return Learner("ES", SecondSolve(nmpc), semi_gradient(alpha), nmpc.gamma)


def deep_expected_sarsa(
    nmpc: Controller, network: QNetwork, alpha: float, *, gated: bool = True
) -> Learner:
    """DES: a network of 5 inputs, (s, a), instead of the second solve."""
    bootstrap = Imitation(network, with_theta=False, gated=gated)
    return Learner("DES", bootstrap, semi_gradient(alpha), nmpc.gamma)


def regularized_deep_expected_sarsa(
    nmpc: Controller, network: QNetwork, alpha: float, *, gated: bool = True
) -> Learner:
    """RDES, the paper's first method: the network of DES is told theta as well, 14 inputs."""
    bootstrap = Imitation(network, with_theta=True, gated=gated)
    return Learner("RDES", bootstrap, semi_gradient(alpha), nmpc.gamma)


def gradient_expected_sarsa(nmpc: Controller, alpha: float, beta: float) -> Learner:
    """GES, the paper's second method: two solves a step, gradient TD."""
    return Learner("GES", SecondSolve(nmpc), gradient_td(alpha, beta, nmpc.gamma), nmpc.gamma)


def frozen(nmpc: Controller) -> Learner:
    """The control arm: the same exploration and the same noise, and theta never moves."""

    def nothing(transition: Transition, theta: Vector) -> None:
        return None

    return Learner("frozen", nothing, lambda weights, *_: weights, nmpc.gamma)

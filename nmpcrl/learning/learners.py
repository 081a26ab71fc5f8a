"""The learners: learner = bootstrap x update rule.

| learner | next value        | theta moves by                             |
|---------|-------------------|--------------------------------------------|
| ES      | a second solve    | a semi-gradient                            |
| DES     | a network (s, a)  | a semi-gradient                            |
| RDES    | ... (s, a, theta) | a semi-gradient                            |
| GES     | a second solve    | gradient TD with the weights w             |
| TDC     | a second solve    | gradient TD with its curvature, projected  |
| QL      | a second solve    | a semi-gradient of Q(s, a), u_0 = a fixed  |
| LSTD-Q  | a second solve    | a Gauss-Newton step of a batch             |
| DPG     | none              | the policy's gradient, from a batch        |

LSTD-Q is in `batches`, DPG in `policy_gradient`, and the control arms are in `baselines`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Solution
from nmpcrl.learning.bootstrap import (
    Bootstrap,
    Controller,
    Imitation,
    Moves,
    NextValue,
    SecondSolve,
    Transition,
)
from nmpcrl.learning.optimisers import Bounds
from nmpcrl.learning.updates import (
    auxiliary_step,
    curvature_correction,
    gradient_td_step,
    project,
    semi_gradient_step,
    td_error,
)

if TYPE_CHECKING:
    from nmpcrl.learning.network import QNetwork


@dataclass(frozen=True, eq=False)
class Weights:
    """Everything that an update rule moves."""

    theta: Vector  # of the NMPC, shape (d,)
    w: Vector  # auxiliary weights of gradient TD, shape (d,)
    memory: Any = None  # of a `StatefulRule`; None before its first step


# (weights, delta, solution in s, what is known of s+) -> weights
UpdateRule = Callable[[Weights, float, Solution, NextValue], Weights]


class StatefulRule(Protocol):
    """An update rule that remembers, in what it returns and nowhere else.

    So one learner serves many runs, and a run goes on from the weights of any of its steps.
    """

    def init(self, weights: Weights) -> Any:
        """The memory with which a run begins."""

    def step(
        self,
        memory: Any,
        weights: Weights,
        transition: Transition,
        delta: float,
        successor: NextValue,
    ) -> tuple[Weights, Any]:
        """New weights and memory; `transition` says whether an episode begins or is over.

        A failed solve ends an episode without a last transition, and perhaps without any. A rule
        with a method `interrupted(memory, weights)`, which returns both, is told.
        """


@dataclass(frozen=True, eq=False)
class Projected:
    """A rule of either kind as a `StatefulRule` whose theta stays within the bounds."""

    rule: UpdateRule | StatefulRule
    bounds: Bounds | None

    def init(self, weights: Weights) -> Any:
        """The memory of the rule; None where it has none."""
        return None if callable(self.rule) else self.rule.init(weights)

    def step(
        self,
        memory: Any,
        weights: Weights,
        transition: Transition,
        delta: float,
        successor: NextValue,
    ) -> tuple[Weights, Any]:
        """As the rule does, then project."""
        if callable(self.rule):
            moved = self.rule(weights, delta, transition.solution, successor)
        else:
            moved, memory = self.rule.step(memory, weights, transition, delta, successor)
        if self.bounds is not None:
            moved = replace(moved, theta=project(moved.theta, *self.bounds))
        return moved, memory

    def interrupted(self, memory: Any, weights: Weights) -> tuple[Weights, Any]:
        """Tell the rule, if it asks."""
        tell = getattr(self.rule, "interrupted", None)
        return tell(memory, weights) if tell else (weights, memory)


@dataclass(frozen=True, eq=False)
class Update:
    """What one step of learning did."""

    weights: Weights  # after the step
    successor: NextValue | None = None  # None when nothing was bootstrapped
    delta: float | None = None  # TD error; None when there was none, and the weights are unchanged


@dataclass(frozen=True)
class Learner:
    """A bootstrap and an update rule; a step is pure but for a network or generator they hold."""

    name: str  # as tables show it
    bootstrap: Bootstrap  # values the next state
    rule: UpdateRule | StatefulRule  # moves the weights
    gamma: float  # discount factor of the TD error
    bounds: Bounds | None = None  # into which theta is projected after each step
    values_actions: bool = False  # whether it is meant for Q(s, a), and not for V(s)

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
        rule, memory = self._remembered(weights)
        moved, memory = rule.step(memory, weights, transition, delta, successor)
        return Update(replace(moved, memory=memory), successor, delta)

    def interrupted(self, weights: Weights) -> Weights:
        """The weights after an episode that a failed solve ended."""
        rule, memory = self._remembered(weights)
        moved, memory = rule.interrupted(memory, weights)
        return replace(moved, memory=memory)

    def _remembered(self, weights: Weights) -> tuple[Projected, Any]:
        """The projected rule, and its memory."""
        rule = Projected(self.rule, self.bounds)
        return rule, rule.init(weights) if weights.memory is None else weights.memory


def theta_bounds(nmpc: Any) -> Bounds | None:
    """The bounds of a `Problem`'s theta; None where there is no problem, or nothing is bounded."""
    problem = getattr(nmpc, "problem", None)
    if problem is None or not np.isfinite([problem.theta_lower, problem.theta_upper]).any():
        return None
    return problem.theta_lower, problem.theta_upper


def semi_gradient(alpha: float) -> UpdateRule:
    """Eq. (9): move theta along delta phi."""

    def rule(weights: Weights, delta: float, solution: Solution, _: NextValue) -> Weights:
        return Weights(
            semi_gradient_step(weights.theta, delta, solution.features, alpha), weights.w
        )

    vars(rule)["moves"] = Moves(alpha)
    return rule


def gradient_td(alpha: float, beta: float, gamma: float) -> UpdateRule:
    """Eq. (16): move theta and w, both from the old ones."""

    def rule(weights: Weights, delta: float, solution: Solution, successor: NextValue) -> Weights:
        if successor.features is None:
            raise ValueError(
                "gradient TD needs the next state's features: bootstrap by SecondSolve"
            )
        theta, w, phi = weights.theta, weights.w, solution.features
        return Weights(
            theta=gradient_td_step(
                theta, w, delta, phi, successor.features, alpha=alpha, gamma=gamma
            ),
            w=auxiliary_step(w, delta, phi, beta),
        )

    vars(rule)["moves"] = Moves(alpha, beta)
    return rule


def exact_gradient_td(
    nmpc: Controller,
    alpha: float,
    beta: float,
    *,
    curvature: bool,
    projection: tuple[float, float] | None,
) -> UpdateRule:
    """Nonlinear TDC (Maei et al. 2009): `gradient_td` with what Eq. (16) drops.

    Args:
        nmpc: knows the Hessian of its value.
        alpha: step size of theta.
        beta: step size of w.
        curvature: whether to subtract h, `curvature_correction`.
        projection: least and largest value of a component of theta; None for no projection.
    """
    printed = gradient_td(alpha, beta, nmpc.gamma)

    def rule(weights: Weights, delta: float, solution: Solution, successor: NextValue) -> Weights:
        moved = printed(weights, delta, solution, successor)
        theta = moved.theta
        if curvature:
            hessian_w = nmpc.value_hessian_times(solution, weights.w)
            theta = theta - alpha * curvature_correction(
                delta, solution.features, weights.w, hessian_w
            )
        return Weights(project(theta, *projection) if projection else theta, moved.w)

    vars(rule)["moves"] = Moves(alpha, beta, curvature, projection)
    return rule


def expected_sarsa(nmpc: Controller, alpha: float) -> Learner:
    """ES: two solves a step, Eq. (7), and a semi-gradient, Eq. (9).

    Source: Moradimaryamnegari et al. (2022).
    """
    return Learner("ES", SecondSolve(nmpc), semi_gradient(alpha), nmpc.gamma, theta_bounds(nmpc))


def deep_expected_sarsa(
    nmpc: Controller, network: "QNetwork", alpha: float, **options: Any
) -> Learner:
    """DES: a network of (s, a) instead of the second solve, Eq. (11); a semi-gradient, Eq. (9).

    `options` are those of `Imitation`.
    """
    bootstrap = Imitation(network, with_theta=False, **options)
    return Learner("DES", bootstrap, semi_gradient(alpha), nmpc.gamma, theta_bounds(nmpc))


def regularized_deep_expected_sarsa(
    nmpc: Controller, network: "QNetwork", alpha: float, **options: Any
) -> Learner:
    """RDES, the paper's first method: DES, and theta is an input of the network, too.

    Eqs. (9), (10) and (11); `options` are those of `Imitation`.
    """
    bootstrap = Imitation(network, with_theta=True, **options)
    return Learner("RDES", bootstrap, semi_gradient(alpha), nmpc.gamma, theta_bounds(nmpc))


def gradient_expected_sarsa(nmpc: Controller, alpha: float, beta: float) -> Learner:
    """GES, the paper's second method: two solves a step, Eq. (7), and gradient TD, Eq. (16)."""
    rule = gradient_td(alpha, beta, nmpc.gamma)
    return Learner("GES", SecondSolve(nmpc), rule, nmpc.gamma, theta_bounds(nmpc))


def gradient_tdc(
    nmpc: Controller,
    alpha: float,
    beta: float,
    *,
    curvature: bool = True,
    projection: tuple[float, float] | None = None,
) -> Learner:
    """TDC, exact nonlinear gradient TD: two solves a step and a product with the value's Hessian.

    Arguments as in `exact_gradient_td`; without curvature and projection it is GES.
    """
    rule = exact_gradient_td(nmpc, alpha, beta, curvature=curvature, projection=projection)
    return Learner("TDC", SecondSolve(nmpc), rule, nmpc.gamma, theta_bounds(nmpc))


def q_learning(nmpc: Controller, alpha: float) -> Learner:
    """QL: two solves a step, semi-gradient of the action value proper (Gros and Zanon 2020).

    A step's transition must hold the solution with u_0 = a fixed, whose value is Q_theta(s, a), as
    `train` has it for this learner. In the next state the policy minimises Q, so its value is
    V_theta(s+): a solve with u_0 free.
    """
    rule, bounds = semi_gradient(alpha), theta_bounds(nmpc)
    return Learner("QL", SecondSolve(nmpc), rule, nmpc.gamma, bounds, values_actions=True)

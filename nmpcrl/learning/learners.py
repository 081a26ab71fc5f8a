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

LSTD-Q is in `batches`, DPG in `policy_gradient`; `baselines` has what they are compared with.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.control.vectors import step_size
from nmpcrl.learning.bootstrap import Bootstrap, Imitation, NextValue, SecondSolve, Transition
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

Move = Callable[..., tuple[Vector, Any]]  # the step of an `UpdateRule`


@dataclass(frozen=True, eq=False)
class Weights:
    """theta, and the memory of the update rule: `Weights(theta)` begins a run."""

    theta: Vector  #: of the NMPC, shape (d,)
    w: Vector = None  # type: ignore[assignment]  #: of gradient TD, shape (d,); 0 if absent
    memory: Any = None  #: of the rule; None before its first step

    def __post_init__(self) -> None:
        if self.w is None:
            object.__setattr__(self, "w", np.zeros(np.shape(self.theta)))


def no_memory(weights: Weights) -> None:
    """The memory of a rule without one."""


def unchanged(theta: Vector, memory: Any) -> tuple[Vector, Any]:
    """Keep theta and memory after a failed episode."""
    return theta, memory


@dataclass(frozen=True, eq=False)
class UpdateRule:
    """How theta moves, as an optimiser of optax: memory is an argument and a result of each step.

    So one learner serves many runs, and a run goes on from the weights of any of its steps.

    >>> step = lambda theta, memory, transition, delta, successor: (theta + 0.1, memory)
    >>> UpdateRule(step).step(1.0, None, None, 0.0, None)
    (1.1, None)
    """

    # (theta, memory, transition, TD error, next value) -> the next theta and memory
    step: Callable[[Vector, Any, Transition, float, NextValue], tuple[Vector, Any]]
    init: Callable[[Weights], Any] = no_memory  #: before the first step
    # (theta, memory) -> the next ones, after an episode that a failed solve ended
    interrupted: Callable[[Vector, Any], tuple[Vector, Any]] = unchanged


@dataclass(frozen=True)
class SemiGradient:
    """The step of Eq. (9), along delta phi."""

    alpha: float

    def __post_init__(self) -> None:
        step_size("alpha", self.alpha)

    def __call__(
        self, theta: Vector, memory: Any, transition: Transition, delta: float, _: NextValue
    ) -> tuple[Vector, Any]:
        return semi_gradient_step(theta, delta, transition.solution.features, self.alpha), memory


class Auxiliary(NamedTuple):
    """The memory of gradient TD."""

    w: Vector  #: shape (d,)


def first_w(weights: Weights) -> Auxiliary:
    """The memory of gradient TD before its first step."""
    return Auxiliary(weights.w)


@dataclass(frozen=True, eq=False)
class GradientTD:
    """The step of Eq. (16), of theta and w, both from the old ones."""

    alpha: float  #: step size of theta
    beta: float  #: of w
    gamma: float
    curved: Nmpc | None = None  #: knows the Hessian, for the term that Eq. (16) drops
    follow: Callable[[Vector, float, Vector, float], Vector] = auxiliary_step  #: moves w

    def __post_init__(self) -> None:
        step_size("alpha", self.alpha)
        step_size("beta", self.beta)

    def __call__(
        self, theta: Vector, memory: Auxiliary, transition: Transition, delta: float,
        successor: NextValue,
    ) -> tuple[Vector, Auxiliary]:  # fmt: skip
        if successor.features is None:
            raise ValueError(
                "gradient TD needs the next state's features: bootstrap by SecondSolve"
            )
        (w,), phi, alpha = memory, transition.solution.features, self.alpha
        theta = gradient_td_step(
            theta, w, delta, phi, successor.features, alpha=alpha, gamma=self.gamma
        )
        if self.curved:
            hessian_w = self.curved.value_hessian_times(transition.solution, w)
            theta = theta - alpha * curvature_correction(delta, phi, w, hessian_w)
        return theta, Auxiliary(self.follow(w, delta, phi, self.beta))


def semi_gradient(alpha: float) -> UpdateRule:
    """Eq. (9): move theta along delta phi."""
    return UpdateRule(SemiGradient(alpha))


def gradient_td(alpha: float, beta: float, gamma: float, **options: Any) -> UpdateRule:
    """Eq. (16): move theta and w, both from the old ones; `options` are those of `GradientTD`."""
    return UpdateRule(GradientTD(alpha, beta, gamma, **options), first_w)


@dataclass(frozen=True, eq=False)
class Update:
    """What one step of learning did."""

    weights: Weights  #: after the step
    successor: NextValue | None = None  #: None where the bootstrap gave no value
    delta: float | None = None  #: TD error; None likewise, and the weights are unchanged


def theta_bounds(nmpc: Any) -> Bounds | None:
    """The bounds of a `Problem`'s theta; None where there is no problem, or nothing is bounded."""
    problem = getattr(nmpc, "problem", None)
    if problem is None or not np.isfinite([problem.theta_lower, problem.theta_upper]).any():
        return None
    return problem.theta_lower, problem.theta_upper


@dataclass(frozen=True)
class Learner:
    """A bootstrap and an update rule; only their network or generator changes in place."""

    name: str  #: as tables show it
    bootstrap: Bootstrap  #: values the next state
    rule: UpdateRule  #: moves theta
    gamma: float  #: discount factor of the TD error
    bounds: Bounds | None = None  #: into which theta is projected after each step
    values_actions: bool = False  #: whether it learns Q(s, a) in place of V(s)

    def __post_init__(self) -> None:
        if not isinstance(self.rule, UpdateRule):
            raise ValueError(f"rule = {self.rule!r} must be an UpdateRule: write UpdateRule(step),"
                             " with step(theta, memory, transition, delta, successor) -> (theta,"
                             " memory)")  # fmt: skip

    @classmethod
    def of(
        cls, name: str, nmpc: Nmpc, rule: UpdateRule, bootstrap: Bootstrap | None = None,
        bounds: Bounds | None = None, **options: Any,
    ) -> "Learner":  # fmt: skip
        """A learner with the gamma and the bounds of an NMPC; its bootstrap is a second solve."""
        bounds = bounds or theta_bounds(nmpc)
        return cls(name, bootstrap or SecondSolve(nmpc), rule, nmpc.gamma, bounds, **options)

    def step(self, weights: Weights, transition: Transition) -> Update:
        """Value the next state, form the TD error, and move the weights.

        Raises:
            SolverError: the next state was to be solved and could not be.
        """
        successor = self.bootstrap(transition, weights.theta)
        if successor is None:
            return Update(weights)
        delta = td_error(transition.cost, self.gamma, transition.solution.value, successor.value)
        moved = self.bounded_rule.step(
            weights.theta, self._memory(weights), transition, delta, successor
        )
        return Update(weights_after(weights, *moved), successor, delta)

    def interrupted(self, weights: Weights) -> Weights:
        """The weights after an episode that a failed solve ended."""
        moved = self.bounded_rule.interrupted(weights.theta, self._memory(weights))
        return weights_after(weights, *moved)

    @cached_property
    def bounded_rule(self) -> UpdateRule:
        """The rule, with the projection into the bounds where there are any."""
        if self.bounds is None:
            return self.rule
        return replace(self.rule, step=partial(_projected, self.rule.step, self.bounds))

    def _memory(self, weights: Weights) -> Any:
        return self.rule.init(weights) if weights.memory is None else weights.memory


def _projected(step: Move, bounds: Bounds, *given: Any) -> tuple[Vector, Any]:
    theta, memory = step(*given)
    return project(theta, *bounds), memory


def weights_after(before: Weights, theta: Vector, memory: Any) -> Weights:
    """The next weights: w is that of the memory or of its `inner` one, else the one before."""
    found = memory
    while found is not None and not isinstance(found, Auxiliary):
        found = getattr(found, "inner", None)
    return Weights(theta, before.w if found is None else found.w, memory)


def expected_sarsa(nmpc: Nmpc, alpha: float) -> Learner:
    """ES: two solves a step, Eq. (7), and a semi-gradient, Eq. (9).

    Source: Moradimaryamnegari et al. (2022).
    """
    return Learner.of("ES", nmpc, semi_gradient(alpha))


def deep_expected_sarsa(nmpc: Nmpc, network: "QNetwork", alpha: float, **options: Any) -> Learner:
    """DES: a network of (s, a) instead of the second solve, Eq. (11); a semi-gradient, Eq. (9).

    `options` are those of `Imitation`.
    """
    imitation = Imitation(network, with_theta=False, **options)
    return Learner.of("DES", nmpc, semi_gradient(alpha), imitation)


def regularized_deep_expected_sarsa(
    nmpc: Nmpc, network: "QNetwork", alpha: float, **options: Any
) -> Learner:
    """RDES, the paper's first method: DES, and theta is an input of the network, too.

    Eqs. (9), (10) and (11); `options` are those of `Imitation`.
    """
    imitation = Imitation(network, with_theta=True, **options)
    return Learner.of("RDES", nmpc, semi_gradient(alpha), imitation)


def gradient_expected_sarsa(nmpc: Nmpc, alpha: float, beta: float) -> Learner:
    """GES, the paper's second method: two solves a step, Eq. (7), and gradient TD, Eq. (16)."""
    return Learner.of("GES", nmpc, gradient_td(alpha, beta, nmpc.gamma))


def gradient_tdc(
    nmpc: Nmpc,
    alpha: float,
    beta: float,
    *,
    curvature: bool = True,
    projection: tuple[float, float] | None = None,
) -> Learner:
    """TDC, nonlinear gradient TD (Maei et al. 2009): GES with what Eq. (16) drops.

    Args:
        nmpc: knows the Hessian of its value.
        alpha: step size of theta.
        beta: step size of w.
        curvature: whether to subtract alpha h, `curvature_correction`, a product with the Hessian.
        projection: the least and the largest component of theta; the bounds of a `Problem` if
            absent.
    """
    rule = gradient_td(alpha, beta, nmpc.gamma, curved=nmpc if curvature else None)
    return Learner.of("TDC", nmpc, rule, bounds=projection)


def q_learning(nmpc: Nmpc, alpha: float) -> Learner:
    """QL: two solves a step, semi-gradient of the action value proper (Gros and Zanon 2020).

    A step's transition must hold the solution with u_0 = a fixed, whose value is Q_theta(s, a), as
    `train` has it for this learner. In the next state the policy minimises Q, so its value is
    V_theta(s+): a solve with u_0 free.
    """
    return Learner.of("QL", nmpc, semi_gradient(alpha), values_actions=True)

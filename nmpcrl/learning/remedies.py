"""Rules, and wrappers of any learner, that may help where learning fails.

=========  =======================================================================
remedy     theta moves by
=========  =======================================================================
TDRC       gradient TD with one step size, whose w decays
GES-3      gradient TD, beta = 3 alpha, and steps of w that cannot overshoot
guarded    what a learner would, with alpha at most 1 / ||phi||^2
directed   the direction of ES, as far as a learner would
scheduled  what a learner would, times a factor that changes with the steps
averaged   what a learner would; the mean theta is judged
undone     what a learner would, and back where a rollout without noise costs more
=========  =======================================================================

Gauss-Newton steps are in `gauss_newton`, the deterministic policy gradient in `policy_gradient`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

from nmpcrl import Vector
from nmpcrl.control import Nmpc
from nmpcrl.control.expression import refuse_other
from nmpcrl.learning.baselines import as_far_as
from nmpcrl.learning.bootstrap import Transition
from nmpcrl.learning.learners import (
    Learner,
    Move,
    UpdateRule,
    Weights,
    first_w,
    gradient_td,
    no_memory,
    semi_gradient,
    weights_after,
)
from nmpcrl.learning.updates import auxiliary_step

REGULARISATION = 1.0  # of TDRC, as Ghiassian et al. print it


def regularised_step(w: Vector, delta: float, phi: Vector, alpha: float, decay: float) -> Vector:
    """w + alpha ((delta - phi'w) phi - decay w), shape (d,): w of TDRC, Ghiassian et al. (2020)."""
    return auxiliary_step(w, delta, phi, alpha) - alpha * decay * w


def normalised_step(w: Vector, delta: float, phi: Vector, beta: float) -> Vector:
    """`auxiliary_step` with beta / (1 + beta ||phi||^2), at which no error changes its sign.

    The implicit step: w where the error is taken after it.  Source: Nagumo and Noda (1967).
    """
    return auxiliary_step(w, delta, phi, beta / (1 + beta * float(phi @ phi)))


def guard(alpha: float, phi: Vector) -> float:
    """min(alpha, 1 / ||phi||^2): the longest step that does not pass the target."""
    square = float(phi @ phi)
    return min(alpha, 1 / square) if square > 0 else alpha


def tdrc(nmpc: Nmpc, alpha: float, regularisation: float = REGULARISATION) -> Learner:
    """TDRC: two solves a step, Eq. (16) with one step size, and w decays.

    Source: Ghiassian et al. (2020).  Their features are of unit size: where ||phi||^2 is large, a
    regularisation of 1 does next to nothing. On the two-state chain one above 2 gamma - 1 diverges.
    """
    follow = partial(regularised_step, decay=regularisation)
    return Learner.of("TDRC", nmpc, gradient_td(alpha, alpha, nmpc.gamma, follow=follow))


def normalised_ges(nmpc: Nmpc, alpha: float, ratio: float = 3.0) -> Learner:
    """GES-3: w moves faster than theta, as two-time-scale theory asks, by `normalised_step`."""
    rule = gradient_td(alpha, ratio * alpha, nmpc.gamma, follow=normalised_step)
    return Learner.of("GES-3", nmpc, rule)


def guarded(learner: Learner, alpha: float) -> Learner:
    """A learner whose step size of theta is `guard(alpha, phi)`; w moves as it would.

    Raises:
        ValueError: its rule is not proportional to alpha, since it moves theta by batches.
    """
    rule = of_each_step(learner, "a guard")
    own = replace(rule, step=partial(_guarded, rule.step, alpha))
    return replace(learner, name=f"{learner.name} guarded", rule=own)


def _guarded(
    step: Move, alpha: float, theta: Vector, memory: Any, transition: Transition, *given: Any
) -> tuple[Vector, Any]:
    moved, after = step(theta, memory, transition, *given)
    allowed = guard(alpha, transition.solution.features)
    return moved if allowed == alpha else theta + allowed / alpha * (moved - theta), after


def directed(learner: Learner, alpha: float) -> Learner:
    """The control of a remedy: steps of its lengths in the direction of ES with step size alpha."""
    rule = as_far_as(of_each_step(learner, "this control"), semi_gradient(alpha))
    return replace(learner, name=f"{learner.name} directed", rule=rule)


def of_each_step(learner: Learner, who: str) -> UpdateRule:
    """The rule of a learner, which has no memory but w."""
    if learner.rule.init not in (no_memory, first_w):
        raise ValueError(f"{who} needs a rule that moves theta at every step; {learner.name} has a"
                         " memory")  # fmt: skip
    return learner.rule


class Around:
    """A wrapper of a rule; its memory contains that of the `inner` rule."""

    rule: UpdateRule

    def interrupted(self, theta: Vector, memory: Any) -> tuple[Vector, Any]:
        theta, inner = self.rule.interrupted(theta, memory.inner)
        return theta, memory._replace(inner=inner)


class Mean(NamedTuple):
    """The memory of an `averaged` rule."""

    theta: Vector  #: the mean
    steps: int  #: in all
    inner: Any


@dataclass(frozen=True, eq=False)
class Averaging(Around):
    """The functions of a rule that remembers mean <- mean + (theta - mean) / n after some steps."""

    rule: UpdateRule
    skip: int  #: steps until n = 1; before, the mean is theta

    def init(self, weights: Weights) -> Mean:
        return Mean(weights.theta, 0, self.rule.init(weights))

    def step(self, theta: Vector, memory: Mean, *given: Any) -> tuple[Vector, Mean]:
        theta, inner = self.rule.step(theta, memory.inner, *given)
        steps = memory.steps + 1
        part = 1 / max(steps - self.skip, 1)
        return theta, Mean(memory.theta + part * (theta - memory.theta), steps, inner)


def averaged(learner: Learner, skip: int = 0) -> Learner:
    """A learner that remembers the mean of its theta after `skip` steps, for `judged_theta`.

    Source: Polyak and Juditsky (1992).
    """
    return wrapped(learner, "averaged", Averaging(learner.bounded_rule, skip))


class Counted(NamedTuple):
    """The memory of a `scheduled` rule."""

    steps: int
    inner: Any


@dataclass(frozen=True, eq=False)
class Scheduling(Around):
    """The functions of a rule whose step k is `part(k)` of another's."""

    rule: UpdateRule
    part: Callable[[int], float]

    def init(self, weights: Weights) -> Counted:
        return Counted(0, self.rule.init(weights))

    def step(self, theta: Vector, memory: Counted, *given: Any) -> tuple[Vector, Counted]:
        moved, inner = self.rule.step(theta, memory.inner, *given)
        return theta + self.part(memory.steps) * (moved - theta), Counted(memory.steps + 1, inner)


def scheduled(learner: Learner, part: Callable[[int], float]) -> Learner:
    """A learner whose step k is `part(k)` of another's: alpha becomes alpha part(k).

    scheduled(q_learning(nmpc, 1e-3), lambda k: 1 / (1 + k / 500)) is Robbins and Monro's (1951).
    """
    refuse_other("part is called as part(k) and returns a number", part, 1)
    return wrapped(learner, "scheduled", Scheduling(learner.bounded_rule, part))


class Best(NamedTuple):
    """The memory of `Undoing`."""

    weights: Weights  #: theta with the lowest cost, and its w
    cost: float
    episodes: int
    inner: Any


@dataclass(frozen=True, eq=False)
class Undoing(Around):
    """The functions of a rule that goes back to the best theta where a rollout costs more.

    It begins with a rollout of the first theta, and makes one after every `every` episodes, those
    that a failed solve ended among them. A rollout that fails costs infinitely much. After a step
    back the rule begins anew.
    """

    rule: UpdateRule
    confirm: Callable[[Vector], float]  #: theta -> cost without noise; each call is interaction
    every: int = 1  #: episodes

    def init(self, weights: Weights) -> Best:
        return Best(weights, self.confirm(weights.theta.copy()), 0, self.rule.init(weights))

    def step(
        self, theta: Vector, memory: Best, transition: Transition, *given: Any
    ) -> tuple[Vector, Best]:
        theta, inner = self.rule.step(theta, memory.inner, transition, *given)
        memory = memory._replace(inner=inner)
        return self._judged(theta, memory) if transition.last else (theta, memory)

    def interrupted(self, theta: Vector, memory: Best) -> tuple[Vector, Best]:
        return self._judged(*super().interrupted(theta, memory))

    def _judged(self, theta: Vector, memory: Best) -> tuple[Vector, Best]:
        """After `every` episodes keep theta, or go back."""
        memory = memory._replace(episodes=memory.episodes + 1)
        if memory.episodes % self.every:
            return theta, memory
        cost = self.confirm(theta.copy())
        if cost <= memory.cost:
            best = weights_after(memory.weights, theta, memory.inner)
            return theta, memory._replace(weights=best, cost=cost)
        return memory.weights.theta, memory._replace(inner=self.rule.init(memory.weights))


def undo(learner: Learner, confirm: Callable[[Vector], float], every: int = 1) -> Learner:
    """A learner that takes back steps after which a rollout without noise costs more: `Undoing`."""
    return wrapped(learner, "undone", Undoing(learner.bounded_rule, confirm, every))


def wrapped(learner: Learner, how: str, own: Any) -> Learner:
    rule = UpdateRule(own.step, own.init, own.interrupted)
    return replace(learner, name=f"{learner.name} {how}", rule=rule)


def judged_theta(weights: Weights) -> Vector:
    """The theta that a learner returns: the mean, or the best, where its rule has one."""
    memory = weights.memory
    if isinstance(memory, Best):
        return memory.weights.theta
    return memory.theta if isinstance(memory, Mean) else weights.theta

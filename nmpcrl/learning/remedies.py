"""What may help where learning fails: other rules, and what is put around any learner.

| remedy    | theta moves by                                                             |
|-----------|----------------------------------------------------------------------------|
| TDRC      | gradient TD with one step size, whose w decays                             |
| GES-3     | gradient TD, beta = 3 alpha, and steps of w that cannot overshoot          |
| guarded   | what a learner would, with alpha at most 1 / ||phi||^2                     |
| directed  | the direction of ES, as far as a learner would                             |
| averaged  | what a learner would; what is judged is the mean theta                     |
| undone    | what a learner would, and back where a rollout without noise costs more    |

Gauss-Newton steps are in `gauss_newton`, the deterministic policy gradient in `policy_gradient`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from nmpcrl import Vector
from nmpcrl.control import Solution
from nmpcrl.learning.baselines import as_far_as
from nmpcrl.learning.bootstrap import Controller, NextValue, SecondSolve, Transition
from nmpcrl.learning.learners import (
    Learner,
    Projected,
    UpdateRule,
    Weights,
    gradient_td,
    semi_gradient,
    theta_bounds,
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


def tdrc(nmpc: Controller, alpha: float, regularisation: float = REGULARISATION) -> Learner:
    """TDRC: two solves a step, Eq. (16) with one step size, and w decays.

    Source: Ghiassian et al. (2020).  Their features are of unit size: where ||phi||^2 is large, a
    regularisation of 1 does next to nothing. On the two-state chain one above 2 gamma - 1 diverges.
    """

    def follow(w: Vector, delta: float, phi: Vector) -> Vector:
        return regularised_step(w, delta, phi, alpha, regularisation)

    return _gradient_learner("TDRC", nmpc, alpha, follow)


def normalised_ges(nmpc: Controller, alpha: float, ratio: float = 3.0) -> Learner:
    """GES-3: w moves faster than theta, as two-time-scale theory asks, by `normalised_step`."""

    def follow(w: Vector, delta: float, phi: Vector) -> Vector:
        return normalised_step(w, delta, phi, ratio * alpha)

    return _gradient_learner("GES-3", nmpc, alpha, follow)


def _gradient_learner(
    name: str, nmpc: Controller, alpha: float, follow: Callable[[Vector, float, Vector], Vector]
) -> Learner:
    """GES with another step of w, from the old one as in Eq. (16)."""
    printed = gradient_td(alpha, 0.0, nmpc.gamma)

    def rule(weights: Weights, delta: float, solution: Solution, successor: NextValue) -> Weights:
        moved = printed(weights, delta, solution, successor)
        return replace(moved, w=follow(weights.w, delta, solution.features))

    return Learner(name, SecondSolve(nmpc), rule, nmpc.gamma, theta_bounds(nmpc))


def guarded(learner: Learner, alpha: float) -> Learner:
    """A learner whose step size of theta is `guard(alpha, phi)`; w moves as it would.

    Raises:
        ValueError: its rule is not proportional to alpha, since it moves theta by batches.
    """
    own = _plain_rule(learner, "a guard")

    def rule(weights: Weights, delta: float, solution: Solution, successor: NextValue) -> Weights:
        moved, allowed = own(weights, delta, solution, successor), guard(alpha, solution.features)
        if allowed == alpha:
            return moved
        part = allowed / alpha
        return replace(moved, theta=weights.theta + part * (moved.theta - weights.theta))

    return replace(learner, name=f"{learner.name} guarded", rule=rule)


def directed(learner: Learner, alpha: float) -> Learner:
    """The control of a remedy: its lengths, in the direction of ES, which has step size alpha."""
    rule = as_far_as(_plain_rule(learner, "this control"), semi_gradient(alpha))
    return replace(learner, name=f"{learner.name} directed", rule=rule)


def _plain_rule(learner: Learner, who: str) -> UpdateRule:
    if not callable(learner.rule):
        raise ValueError(f"{who} needs a rule that moves theta at every step; {learner.name} has a"
                         " memory")  # fmt: skip
    return learner.rule


class Mean(NamedTuple):
    """What `Averaging` remembers."""

    theta: Vector  # the mean
    steps: int  # in all
    inner: Any


@dataclass(frozen=True, eq=False)
class Averaging:
    """A `StatefulRule` that leaves a rule as it is and keeps the mean of its theta.

    Source: Polyak and Juditsky (1992).
    """

    rule: Projected
    skip: int = 0  # steps before the mean begins

    def init(self, weights: Weights) -> Mean:
        """The mean of one theta."""
        return Mean(weights.theta, 0, self.rule.init(weights))

    def step(
        self, memory: Mean, weights: Weights, transition: Transition, delta: float, then: NextValue
    ) -> tuple[Weights, Mean]:
        """mean <- mean + (theta - mean) / n; until n = 1, the mean is theta."""
        moved, inner = self.rule.step(memory.inner, weights, transition, delta, then)
        steps = memory.steps + 1
        part = 1 / max(steps - self.skip, 1)
        return moved, Mean(memory.theta + part * (moved.theta - memory.theta), steps, inner)

    def interrupted(self, memory: Mean, weights: Weights) -> tuple[Weights, Mean]:
        """Tell the rule."""
        moved, inner = self.rule.interrupted(memory.inner, weights)
        return moved, memory._replace(inner=inner)


def averaged(learner: Learner, skip: int = 0) -> Learner:
    """A learner that keeps the mean of its theta, which `judged_theta` returns."""
    rule = Averaging(Projected(learner.rule, learner.bounds), skip)
    return replace(learner, name=f"{learner.name} averaged", rule=rule)


class Best(NamedTuple):
    """What `Undoing` remembers."""

    theta: Vector  # with the lowest cost
    w: Vector  # with it
    cost: float
    episodes: int
    inner: Any


@dataclass(frozen=True, eq=False)
class Undoing:
    """A `StatefulRule` that goes back to the best theta where a confirming rollout got worse.

    It begins with a rollout of the first theta, and makes one after every `every` episodes, those
    that a failed solve ended among them. What a rollout cannot judge costs infinitely much. After a
    step back the rule begins anew.
    """

    rule: Projected
    confirm: Callable[[Vector], float]  # theta -> cost without noise; each call is interaction
    every: int = 1  # episodes

    def init(self, weights: Weights) -> Best:
        """The first rollout."""
        cost = self.confirm(weights.theta)
        return Best(weights.theta, weights.w, cost, 0, self.rule.init(weights))

    def step(
        self, memory: Best, weights: Weights, transition: Transition, delta: float, then: NextValue
    ) -> tuple[Weights, Best]:
        """Move as the rule does; judge that at the end of an episode."""
        moved, inner = self.rule.step(memory.inner, weights, transition, delta, then)
        memory = memory._replace(inner=inner)
        return self._judged(memory, moved) if transition.last else (moved, memory)

    def interrupted(self, memory: Best, weights: Weights) -> tuple[Weights, Best]:
        """As at the end of any other episode."""
        moved, inner = self.rule.interrupted(memory.inner, weights)
        return self._judged(memory._replace(inner=inner), moved)

    def _judged(self, memory: Best, moved: Weights) -> tuple[Weights, Best]:
        """After `every` episodes keep the weights, or go back."""
        memory = memory._replace(episodes=memory.episodes + 1)
        if memory.episodes % self.every:
            return moved, memory
        cost = self.confirm(moved.theta)
        if cost <= memory.cost:
            return moved, memory._replace(theta=moved.theta, w=moved.w, cost=cost)
        back = Weights(memory.theta, memory.w)
        return back, memory._replace(inner=self.rule.init(back))


def undo(learner: Learner, confirm: Callable[[Vector], float], every: int = 1) -> Learner:
    """A learner that takes back what a rollout without noise finds worse: see `Undoing`."""
    rule = Undoing(Projected(learner.rule, learner.bounds), confirm, every)
    return replace(learner, name=f"{learner.name} undone", rule=rule)


def judged_theta(weights: Weights) -> Vector:
    """The theta that a learner stands for: the mean, or the best, where its rule keeps one."""
    kept = weights.memory
    return kept.theta if isinstance(kept, Mean | Best) else weights.theta

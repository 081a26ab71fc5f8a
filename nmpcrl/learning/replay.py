"""Experience replay: earlier steps are learned from again, solved anew at the present theta."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, SolverError
from nmpcrl.learning.bootstrap import NextValue, SecondSolve, Transition
from nmpcrl.learning.learners import Learner, UpdateRule, Weights
from nmpcrl.learning.remedies import Around, of_each_step, wrapped
from nmpcrl.learning.updates import td_error


class Buffer(NamedTuple):
    """The memory of `Replaying`."""

    kept: tuple[Transition, ...]  # the last ones
    steps: int  # in all
    inner: Any


@dataclass(frozen=True, eq=False)
class Replaying(Around):
    """The functions of a rule that follows each step by steps along earlier transitions."""

    rule: UpdateRule
    learner: Learner
    nmpc: Nmpc
    draws: int
    size: int
    seed: int

    def init(self, weights: Weights) -> Buffer:
        return Buffer((), 0, self.rule.init(weights))

    def step(
        self, theta: Vector, memory: Buffer, transition: Transition, *given: Any
    ) -> tuple[Vector, Buffer]:
        step = self.rule.step
        theta, inner = step(theta, memory.inner, transition, *given)
        kept = (*memory.kept, transition)[-self.size :]
        rng = np.random.default_rng([self.seed, memory.steps])
        for k in rng.integers(len(kept), size=self.draws).tolist():
            try:
                found = self._anew(theta, kept[k])
            except SolverError:  # the present theta has no plan there
                continue
            theta, inner = step(theta, inner, *found)
        return theta, Buffer(kept, memory.steps + 1, inner)

    def _anew(self, theta: Vector, old: Transition) -> tuple[Transition, float, NextValue]:
        """A transition with its present solution, its TD error and the value of its next state."""
        before, names, learner = old.solution, self.nmpc.problem.data_names, self.learner
        action = old.action if before.ocp.fixed_action.size else None
        data = {name: names.part(name, before.data).reshape(-1, *names[name]) for name in names}
        solution = self.nmpc.solve(old.state, theta, before, action, data=data)
        again = replace(old, solution=solution)
        after: Any = learner.bootstrap(again, theta)  # a solve
        return again, td_error(old.cost, learner.gamma, solution.value, after.value), after


def replayed(
    learner: Learner, nmpc: Nmpc, draws: int = 4, size: int = 1000, seed: int = 0
) -> Learner:
    """A learner that follows each step by `draws` steps along transitions of the last `size`.

    The transitions are random and solved anew, at the cost of a step each; the plant is not
    used. Source: Lin (1992).

    Raises:
        ValueError: it solves nothing in the next state, or moves theta by batches as LSTD-Q does.
    """
    of_each_step(learner, "replay")
    if not isinstance(learner.bootstrap, SecondSolve):
        raise ValueError(f"replay needs a solve in the next state, which {learner.name} has not")
    own = Replaying(learner.bounded_rule, learner, nmpc, draws, size, seed)
    return wrapped(learner, "replayed", own)

"""What ships as an entry of the suite, by name: learners, remedies, and tuners.

An entry is a function of a `Robot` that returns theta, or a policy from observations to actions.
`guarded-ES` is ES with a guard, `control-ES` the control of that, `averaged-ES` and `undone-ES`
what their names say; `ES-episode` counts k of Eq. (5) in episodes.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis.direct_search import SEARCHES, Search
from nmpcrl.analysis.interaction import Robot
from nmpcrl.analysis.policy_search import LOWER, SCALE, UPPER
from nmpcrl.learning import Diverged, Learner, policy_gradient
from nmpcrl.learning.gauss_newton import TrustRegion, closed_loop, lstd_q_within
from nmpcrl.learning.remedies import (
    averaged,
    directed,
    guarded,
    judged_theta,
    normalised_ges,
    tdrc,
    undo,
)
from nmpcrl.learning.training import absurd
from nmpcrl.study import Experiment, paper
from nmpcrl.study.learners import DECAYS, LEARNERS
from nmpcrl.study.setup import prepare

Policy = Callable[[Vector], Vector]  # observation of `nmpcrl/Robot-v0` -> action
Factory = Callable[[Robot], Vector | Policy]

RADIUS = 0.3  # of the trust regions, in `SCALE`s
BOUNDS = (LOWER, UPPER)  # of theta where a step may be long


def trust_region() -> TrustRegion:
    """The one of all entries that take Gauss-Newton steps."""
    return TrustRegion(RADIUS, SCALE)


REMEDIES: dict[str, Callable[[Robot], Learner]] = {  # beside the learners of the study
    "TDRC": lambda robot: tdrc(robot.controller, paper.ALPHA),
    "GES-3": lambda robot: normalised_ges(robot.controller, paper.ALPHA),
    "LSTD-Q": lambda robot: lstd_q_within(robot.controller, trust_region(), bounds=BOUNDS),
    "GN-J": lambda robot: closed_loop(robot.controller, trust_region(), BOUNDS),
    "DPG": lambda robot: policy_gradient(robot.controller, optimiser=trust_region(), bounds=BOUNDS),
}


def _guarded(learner: Learner, _: Robot, __: int) -> Learner:
    return guarded(learner, paper.ALPHA)


def _control(learner: Learner, _: Robot, __: int) -> Learner:
    return directed(guarded(learner, paper.ALPHA), paper.ALPHA)


def _averaged(learner: Learner, _: Robot, episodes: int) -> Learner:
    return averaged(learner, skip=episodes * paper.STEPS // 2)


def _undone(learner: Learner, robot: Robot, _: int) -> Learner:
    return undo(learner, robot.cost)


Wrap = Callable[[Learner, Robot, int], Learner]
WRAPS: dict[str, Wrap] = {
    "guarded": _guarded, "control": _control, "averaged": _averaged, "undone": _undone,
}  # fmt: skip
STEPWISE = ("ES", "DES", "RDES", "GES", "TDC", "QL", "TDRC", "GES-3")  # have a step size to guard
UNWRAPPED = ("frozen", "matched", "random")  # controls


@dataclass(frozen=True)
class Learned:
    """A learner of the study or of `REMEDIES`, wrapped or not, trained as long as the budget goes.

    Where each episode is confirmed by a rollout, half as many are trained on.
    """

    learner: str
    wrap: str = ""  # one of `WRAPS`
    decay: str = "step"  # departure C

    def __call__(self, robot: Robot) -> Vector:
        """The theta that it ends with; the last with which a solver can be called."""
        confirmed = self.wrap == "undone"
        episodes = (robot.budget - 1) // 2 if confirmed else robot.budget
        known = self.learner in LEARNERS
        experiment = Experiment(
            learner=self.learner if known else "ES",
            seed=robot.seed,
            episodes=max(episodes, 1),
            layout=robot.centres,
            decay=self.decay,
        )
        learner, weights, explore = prepare(experiment, robot.controller)
        if not known:
            learner = REMEDIES[self.learner](robot)
        if self.wrap:
            learner = WRAPS[self.wrap](learner, robot, episodes)
        if not episodes:
            return weights.theta
        try:
            for step in robot.train(
                learner, weights, explore, constrained=experiment.values_actions
            ):
                weights = weights if absurd(step.weights) else step.weights
        except Diverged:
            pass
        return judged_theta(weights)


@dataclass(frozen=True)
class Searched:
    """A direct search from theta_init that spends the budget."""

    search: Search

    def __call__(self, robot: Robot) -> Vector:
        """The theta whose rollout cost least."""
        return self.search(robot.cost, np.array(paper.THETA_INIT), robot.budget, robot.seed)


def _entries() -> dict[str, Factory]:
    """By name."""
    plain = {name: Learned(name) for name in (*LEARNERS, *REMEDIES)}
    wrapped = {
        f"{wrap}-{name}": Learned(name, wrap)
        for wrap in WRAPS
        for name in plain
        if name not in UNWRAPPED and (wrap in ("averaged", "undone") or name in STEPWISE)
    }
    learned = plain | wrapped
    other: dict[str, Any] = {
        f"{name}-{decay}": replace(one, decay=decay)
        for name, one in learned.items()
        for decay in DECAYS
        if decay != one.decay and name != "frozen"
    }
    return {**learned, **other, **{name: Searched(one) for name, one in SEARCHES.items()}}


ENTRIES: dict[str, Factory] = _entries()

"""What ships as an entry of the suite, by name: learners, remedies, tuners, and agents.

An entry is a function of a `Robot` that returns theta, or a policy from observations to actions.
`guarded-ES` is ES with a guard, `control-ES` the control of that, `averaged-ES` and `undone-ES`
what their names say; `ES-episode` counts k of Eq. (5) in episodes. `CMA-ES[spread=0.1]` is CMA-ES
with that set, and all else as it ships.
"""

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis.agents import AGENTS, Agent
from nmpcrl.analysis.direct_search import SEARCHES, Search
from nmpcrl.analysis.interaction import Policy, Robot
from nmpcrl.analysis.policy_search import LOWER, SCALE, UPPER
from nmpcrl.learning import Diverged, Learner, policy_gradient
from nmpcrl.learning.gauss_newton import TrustRegion, closed_loop, lstd_q_within
from nmpcrl.learning.remedies import (
    REGULARISATION,
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
from nmpcrl.study.storage.refusal import Refusal

Factory = Callable[[Robot], Vector | Policy]

Setting = Mapping[str, float]  # of an entry, by the name of what is set

RADIUS = 0.3  # of the trust regions, in `SCALE`s
BOUNDS = (LOWER, UPPER)  # of theta where a step may be long
WHOLE = ("every", "width")  # what is set to whole numbers
WRITTEN = re.compile(r"([^\[\]]+)\[([^\[\]]+)\]")  # "CMA-ES[spread=0.1]"


class NoSetting(Refusal):
    """An entry has no such setting; the message says which it has."""


def trust_region(radius: float = RADIUS) -> TrustRegion:
    """The one of all entries that take Gauss-Newton steps."""
    return TrustRegion(radius, SCALE)


def _tdrc(robot: Robot, alpha: float, regularisation: float) -> Learner:
    return tdrc(robot.controller, alpha, regularisation)


def _ges_3(robot: Robot, alpha: float, ratio: float) -> Learner:
    return normalised_ges(robot.controller, alpha, ratio)


def _lstd_q(robot: Robot, radius: float) -> Learner:
    return lstd_q_within(robot.controller, trust_region(radius), bounds=BOUNDS)


def _gn_j(robot: Robot, radius: float) -> Learner:
    return closed_loop(robot.controller, trust_region(radius), BOUNDS)


def _dpg(robot: Robot, radius: float) -> Learner:
    return policy_gradient(robot.controller, optimiser=trust_region(radius), bounds=BOUNDS)


REMEDIES: dict[str, Callable[..., Learner]] = {  # beside the learners of the study
    "TDRC": _tdrc, "GES-3": _ges_3, "LSTD-Q": _lstd_q, "GN-J": _gn_j, "DPG": _dpg,
}  # fmt: skip
STEP_SIZE: Setting = {"alpha": paper.ALPHA}
SET: dict[str, Setting] = {  # what can be set of a remedy, and is if nothing is said
    "TDRC": {**STEP_SIZE, "regularisation": REGULARISATION},
    "GES-3": {**STEP_SIZE, "ratio": 3.0},
    **{name: {"radius": RADIUS} for name in ("LSTD-Q", "GN-J", "DPG")},
}
EVERY: Setting = {"every": 1}  # episodes between two rollouts that confirm


def _guarded(learner: Learner, _: Robot, __: int, *, alpha: float) -> Learner:
    return guarded(learner, alpha)


def _control(learner: Learner, _: Robot, __: int, *, alpha: float) -> Learner:
    return directed(guarded(learner, alpha), alpha)


def _averaged(learner: Learner, _: Robot, episodes: int) -> Learner:
    return averaged(learner, skip=episodes * paper.STEPS // 2)


def _undone(learner: Learner, robot: Robot, _: int, *, every: float) -> Learner:
    return undo(learner, robot.cost, int(every))


Wrap = Callable[..., Learner]  # (learner, robot, episodes, what it has set)
WRAPS: dict[str, Wrap] = {
    "guarded": _guarded, "control": _control, "averaged": _averaged, "undone": _undone,
}  # fmt: skip
STEPWISE = ("ES", "DES", "RDES", "GES", "TDC", "QL", "TDRC", "GES-3")  # have a step size to guard
UNWRAPPED = ("frozen", "matched", "random")  # controls


WRAPS_SET: dict[str, tuple[str, ...]] = {  # what each is given of the setting
    "guarded": ("alpha",), "control": ("alpha",), "undone": ("every",),
}  # fmt: skip


@dataclass(frozen=True)
class Learned:
    """A learner of the study or of `REMEDIES`, wrapped or not, trained as long as the budget goes.

    Where rollouts confirm, so many fewer episodes are trained on. With another alpha, beta of GES
    and TDC keeps its ratio to it.
    """

    learner: str
    wrap: str = ""  # one of `WRAPS`
    decay: str = "step"  # departure C
    setting: tuple[tuple[str, float], ...] = ()  # what differs from `defaults`

    @property
    def defaults(self) -> Setting:
        """What can be set."""
        own = SET.get(self.learner, STEP_SIZE)
        return {**own, **EVERY} if self.wrap == "undone" else own

    def __call__(self, robot: Robot) -> Vector:
        """The theta that it ends with; the last with which a solver can be called."""
        values = {**self.defaults, **dict(self.setting)}
        every = int(values.get("every", 0))
        episodes = (robot.budget - 1) * every // (every + 1) if every else robot.budget
        known = self.learner in LEARNERS
        factor = values["alpha"] / paper.ALPHA if known else 1.0
        experiment = Experiment(
            learner=self.learner if known else "ES",
            seed=robot.seed,
            episodes=max(episodes, 1),
            layout=robot.centres,
            decay=self.decay,
            alpha=factor * paper.ALPHA,
            beta=factor * paper.BETA,
            beta_tdc=factor * paper.BETA_TDC,
        )
        learner, weights, explore = prepare(experiment, robot.controller)
        if not known:
            own = {name: values[name] for name in SET[self.learner]}
            learner = REMEDIES[self.learner](robot, **own)
        if self.wrap:
            given = {name: values[name] for name in WRAPS_SET.get(self.wrap, ())}
            learner = WRAPS[self.wrap](learner, robot, episodes, **given)
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
    setting: tuple[tuple[str, float], ...] = ()  # what differs from `defaults`

    @property
    def defaults(self) -> Setting:
        """What can be set."""
        takes = inspect.signature(self.search).parameters.values()
        return {one.name: one.default for one in takes if one.kind is one.KEYWORD_ONLY}

    def __call__(self, robot: Robot) -> Vector:
        """The theta whose rollout cost least."""
        start = np.array(paper.THETA_INIT)
        return self.search(robot.cost, start, robot.budget, robot.seed, **dict(self.setting))


def untouched(robot: Robot) -> Vector:
    """Theta_init, without an episode."""
    return np.array(paper.THETA_INIT)


def _entries() -> dict[str, Factory]:
    """By name."""
    plain = {name: Learned(name) for name in (*LEARNERS, *REMEDIES) if name != "frozen"}
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
        if decay != one.decay
    }
    searched = {name: Searched(one) for name, one in SEARCHES.items()}
    agents = {name: Agent(name) for name in AGENTS}
    return {"frozen": untouched, **learned, **other, **searched, **agents}


ENTRIES: dict[str, Factory] = _entries()


def called(entry: str, setting: Setting) -> str:
    """The name of an entry that ships with something set otherwise: "CMA-ES[spread=0.1]".

    Raises:
        NoSetting: it cannot be set.
    """
    defaults = getattr(ENTRIES[entry], "defaults", {})
    for name in setting:
        if name not in defaults:
            known = f"can be set only {', '.join(defaults)}" if defaults else "nothing can be set"
            raise NoSetting(f"policy = {entry!r} has no {name!r}: {known}")
    other = [f"{name}={setting[name]:g}" for name in defaults if name in setting and
             setting[name] != defaults[name]]  # fmt: skip
    return f"{entry}[{','.join(other)}]" if other else entry


def entry_with(name: str) -> Factory:
    """The entry that `called` gave the name, or one that ships.

    Raises:
        NoSetting: it has no such setting, or what is set is no number that it may be.
        KeyError: none ships that is called so.
    """
    written = WRITTEN.fullmatch(name)
    if not written:
        return ENTRIES[name]
    entry, texts = written[1], [one.partition("=")[::2] for one in written[2].split(",")]
    try:
        setting = {key.strip(): float(value) for key, value in texts}
    except ValueError:
        raise NoSetting(f"policy = {name!r} must be written as ES[alpha=3e-7]") from None
    found = ENTRIES[entry]
    called(entry, setting)
    for key, value in setting.items():
        if not 0 < value < np.inf or (key in WHOLE and value != int(value)):
            what = "a whole number above 0" if key in WHOLE else "a finite number above 0"
            raise NoSetting(f"policy = {name!r}: {key} must be {what}")
    assert isinstance(found, Learned | Searched | Agent)  # others have no setting
    return replace(found, setting=tuple(setting.items()))

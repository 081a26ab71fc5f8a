"""`learn`: from a controller and a plant to a learned theta, in one call."""

import inspect
import warnings
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Policy
from nmpcrl.control.policy import Data
from nmpcrl.control.solution import short
from nmpcrl.control.vectors import floats, integer, spread
from nmpcrl.learning.batches import lstd_q
from nmpcrl.learning.environment import stream
from nmpcrl.learning.episode import Episode
from nmpcrl.learning.episode import episodes as by_episode
from nmpcrl.learning.learners import (
    Learner,
    Weights,
    expected_sarsa,
    gradient_expected_sarsa,
    gradient_tdc,
    q_learning,
)
from nmpcrl.learning.policy_gradient import policy_gradient
from nmpcrl.learning.remedies import Best, judged_theta
from nmpcrl.learning.remedies import undo as undone
from nmpcrl.learning.rollout import evaluate
from nmpcrl.learning.training import Diverged, Exploration, absurd
from nmpcrl.learning.updates import OVERSHOOT

NAMED: dict[str, Callable[..., Learner]] = {
    "LSTD-Q": lstd_q, "QL": q_learning, "DPG": policy_gradient, "ES": expected_sarsa,
    "GES": gradient_expected_sarsa, "TDC": gradient_tdc,
}  # fmt: skip
DEVIATION = 0.05  # of the noise, in parts of the distance between the bounds of an input
STRIDE = 0.3  # of LSTD-Q: the most by which an entry of theta moves at once, see `lstd_q`
VIOLATED, SOME = 1e-6, 0.1  # of hard rows; of an episode's steps, above which `learn` warns
CLIPPED = 0.1  # of the actions at each of both bounds of an input, above which `learn` warns


@dataclass(frozen=True, eq=False)
class Learned:
    """What `learn` reached; it can be pickled, and given to `learn` to go on from."""

    nmpc: Nmpc
    weights: Weights  #: after the last episode that left them usable
    # arrays over all steps: "episode", cost, value, delta and so on as in `Episode.columns`, and
    # "theta" after the step, shape (steps, d)
    history: dict[str, Any]
    costs: Vector  #: of the rollouts without noise, before learning, and then as asked for
    diverged: str  #: why learning could not go on; "" if it could
    warnings: tuple[str, ...]  #: of this call
    episodes: int  #: in all
    seed: int
    rng: np.random.Generator  #: of plant and start, after the last episode

    @property
    def vector(self) -> Vector:
        """The learned theta, shape (d,); with `undo`, the one whose rollout cost least."""
        return judged_theta(self.weights)

    @property
    def theta(self) -> dict[str, Any]:
        """The learned theta by name."""
        return self.nmpc.problem.split(self.vector)

    @property
    def policy(self) -> Policy:
        """The controller with the learned theta."""
        return Policy(self.nmpc, self.vector)


def learn(
    nmpc: Nmpc,
    learner: Learner | str = "LSTD-Q",
    *,
    plant: Any = None,
    start: Any = None,
    data: Data | None = None,
    episodes: int = 20,
    steps: int = 50,
    deviation: Any = None,
    theta: Vector | None = None,
    seed: int = 0,
    confirm: int = 0,
    undo: bool = False,
    callback: Callable[[Episode], Any] | None = None,
    resume: Learned | None = None,
    **options: Any,
) -> Learned:
    """Learn theta from episodes with noise: `learn(nmpc, plant=plant, start=[1, 0]).theta["mass"]`.

    It warns, once each, where a step size is so large that steps overshoot, where an episode ends
    in a failed solve, where many plans violate hard rows, and where the noise is clipped at both
    bounds of an input; its solves do where a weight of a cost turns negative. A divergence is no
    error: the result says so, with what was reached before.

    Args:
        nmpc: the controller whose theta is learned.
        learner: its name, with its `options`, as in learn(nmpc, "QL", alpha=1e-4): LSTD-Q, which
            needs no step size, and here has a `stride` of 0.3, QL, DPG, ES, GES or TDC. Or any
            `Learner`.
        plant: as in `train`, like `start` and `data`.
        episodes: how many, from a start each.
        steps: of an episode, at most.
        deviation: standard deviation of the noise on the inputs, a number or one an input; 5 % of
            the distance between the bounds if absent.
        theta: to start from, shape (d,); that of the problem if absent.
        seed: of noise, plant and start; a resumed run keeps its own.
        confirm: after so many episodes each, and once before, a rollout of `steps` steps without
            noise is made, whose cost `Learned.costs` keeps; 0 for none.
        undo: whether theta goes back to the best one where such a rollout costs more; `confirm` is
            1 if it is 0. See `remedies.undo`.
        callback: called with each `Episode`; learning ends where it returns False.
        resume: what an earlier call reached, to go on from, with the same other arguments: 10 and
            10 episodes are 20, to the last bit. A learner with a network must be the same object.
    """
    if not isinstance(nmpc, Nmpc):
        raise ValueError(f"nmpc = {nmpc!r} must be an Nmpc: write learn(Nmpc(problem), ...)")
    base = _learner(nmpc, learner, options)
    confirm, seed = integer("confirm", confirm, 0), integer("seed", seed, 0)
    if resume is not None and theta is not None:
        raise ValueError("a resumed run begins with its own theta: leave theta= out")
    if resume is not None and isinstance(resume.weights.memory, Best) != undo:
        raise ValueError(f"the run to resume had undo={not undo}: give it again")
    seed, done = (resume.seed, resume.episodes) if resume else (seed, 0)
    rng = deepcopy(resume.rng) if resume else stream(seed, 1)
    first = nmpc.problem.theta if theta is None else theta
    weights = resume.weights if resume else Weights(floats("theta", first))
    noise = _deviation(nmpc, deviation)
    explore = Exploration(episodes=episodes, steps=steps, deviation=noise, seed=seed, first=done)
    around: dict[str, Any] = {"plant": plant, "start": start, "data": data}
    costs = [*resume.costs] if resume else []
    warned = len(nmpc.bending.said)
    said: dict[str, str] = {}
    found: list[Episode] = []
    diverged = ""

    def judge(theta: Vector) -> float:
        usable = not absurd(Weights(theta), nmpc.largest)
        rollout = evaluate(nmpc, theta, steps, rng=seed, **around) if usable else None
        costs.append(np.inf if rollout is None else rollout.cost)
        return float(costs[-1])

    def warn(kind: str, text: str) -> None:
        if text and kind not in said:
            said[kind] = text
            warnings.warn(text, stacklevel=3)

    mover = undone(base, judge, confirm or 1) if undo else base
    if resume is None and undo:
        weights = replace(weights, memory=mover.rule.init(weights))
    elif resume is None and confirm:
        judge(weights.theta)
    try:
        for one in by_episode(mover, nmpc, weights, explore, rng=rng, **around):
            found.append(replace(one, number=done + one.number))
            warn("failed", one.failure and f"episode {found[-1].number} ended: {one.failure}")
            warn("violated", _violated(found[-1]))
            warn("overshoot", _overshoot(base, found[-1]))
            if not absurd(one.weights, nmpc.largest):
                weights = one.weights
            if confirm and not undo and not (found[-1].number + 1) % confirm:
                judge(one.weights.theta)
            if callback is not None and callback(found[-1]) is False:
                break
    except Diverged as error:
        diverged = str(error)
    history = {"episode": np.repeat([one.number for one in found], [one.steps for one in found])}
    for name in found[0].columns:
        history[name] = np.concatenate([one.columns[name] for one in found])
    if resume:
        history = {k: np.concatenate([resume.history[k], v]) for k, v in history.items()}
    acted = history["action"]
    at = [(acted == side).sum(axis=0) / max(len(acted), 1) for side in (nmpc.lower, nmpc.upper)]
    if (np.minimum(*at) > CLIPPED).any():
        warn("clipped", f"shares of {short(at[0])} and {short(at[1])} of the actions lie at the"
             f" lower and upper bounds, where noise is clipped: deviation={short(noise)} may be too"
             " large")  # fmt: skip
    return Learned(
        nmpc, weights, history, np.array(costs), diverged,
        (*said.values(), *nmpc.bending.said[warned:]), done + len(found), seed, rng,
    )  # fmt: skip


def _learner(nmpc: Nmpc, learner: Learner | str, options: dict[str, Any]) -> Learner:
    """A learner by name with options, or as it is."""
    if isinstance(learner, Learner) and not options:
        return learner
    if not isinstance(learner, str) or learner not in NAMED:
        wrong = f"takes no {', '.join(options)}" if isinstance(learner, Learner) else "is unknown"
        raise ValueError(
            f"learner = {getattr(learner, 'name', learner)!r} {wrong}: it must be a Learner, or one"
            f" of {', '.join(NAMED)} with options"
        )
    make = NAMED[learner]
    options = ({"stride": STRIDE} if make is lstd_q else {}) | options
    try:
        inspect.signature(make).bind(nmpc, **options)
    except TypeError as error:
        others = [*inspect.signature(make).parameters.values()][1:]
        needed = [one.name for one in others if one.default is one.empty]
        words = "".join(f", {name}=..." for name in needed)
        example = f'learn(nmpc, "{learner}", plant=plant, start=start{words})'
        raise ValueError(f"{learner} is {make.__name__}: {error}; write {example}") from error
    return make(nmpc, **options)


def _deviation(nmpc: Nmpc, given: Any) -> Vector:
    """The standard deviation of the noise of each input."""
    if given is None:
        given = DEVIATION * (nmpc.upper - nmpc.lower)
        if not np.isfinite(given).all():
            raise ValueError(
                f"inputs between {short(nmpc.lower)} and {short(nmpc.upper)} say nothing of the"
                " noise: give deviation=, a number or one an input"
            )
    return spread("deviation", given, (nmpc.m,), "an input")


def _violated(episode: Episode) -> str:
    """The warning of plans that violate hard rows or bounds; "" where few do."""
    found = np.nan_to_num(episode.columns["violation"]) > VIOLATED
    share = found.sum() / max(len(found), 1)
    if not share > SOME:
        return ""
    return (
        f"in {share:.0%} of the steps of episode {episode.number} no plan keeps to all hard rows"
        " and bounds, and features there are those of the violation, which leave little to learn:"
        " write what noise may leave as Soft(row, weight=...)"
    )


def _overshoot(learner: Learner, episode: Episode) -> str:
    """The warning of a learner whose steps overshoot; "" where none does."""
    alpha = getattr(learner.rule.step, "alpha", 0.0)
    square = float(np.nan_to_num((episode.columns["features"] ** 2).sum(axis=1)).max(initial=0.0))
    if not alpha * square > OVERSHOOT:
        return ""
    return (
        f"alpha ||phi||^2 is {alpha * square:.3g} in episode {episode.number}; above {OVERSHOOT:g}"
        f" a step makes its own error larger: take an alpha below {OVERSHOOT / square:.2g}"
    )

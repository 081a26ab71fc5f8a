"""Algorithm 1 as a generator of steps."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc, Plant, Solution, SolverError
from nmpcrl.control.nmpc import ABSURD, bounded_vector
from nmpcrl.control.policy import Data, forecasts
from nmpcrl.control.solution import short
from nmpcrl.control.vectors import integer
from nmpcrl.learning.bootstrap import Transition
from nmpcrl.learning.environment import environment, stream, unusable
from nmpcrl.learning.learners import Learner, Update, Weights

Counts = NDArray[np.int_]  # k of each step, shape (episodes, steps)

PATIENCE = 10  # so many episodes in a row that a failed solve ended are a divergence


class Diverged(Exception):
    """Learning cannot go on; the message says why."""


@dataclass(frozen=True, eq=False)
class Step:
    """One step of learning; `update` is None where it failed, and `solution` may be."""

    episode: int
    time: int  #: t of Algorithm 1
    state: Vector  #: s, shape (n,)
    weights: Weights  #: after the step
    action: Vector  #: a, noise included, shape (m,); nan where no action was found
    cost: float = np.nan  #: l(s, a); nan where no action was found
    plan: Solution | None = None  #: whose first input is the policy of Eq. (4)
    solution: Solution | None = None  #: whose value is learned; the plan, unless that is Q(s, a)
    update: Update | None = None
    failure: str = ""  #: what the solver said, if it failed, or where the plant went
    end: bool = False  #: whether the plant ended the episode
    last: bool = False  #: whether it is the last step of its episode, for whatever reason
    next_state: Vector | None = None  #: s+; None where it failed

    @property
    def solves(self) -> list[Solution]:
        """Solutions of the plan, of Q(s, a) and of the next state, each once."""
        solutions = [self.plan, self.solution]
        if self.update and self.update.successor:
            solutions.append(self.update.successor.solution)
        return list(dict.fromkeys(filter(None, solutions)))

    @property
    def warm(self) -> Solution | None:
        """The warm start of the next step's first solve."""
        successor = self.update and self.update.successor
        return (successor and successor.solution) or self.solution


def count_steps(episodes: int, steps: int) -> Counts:
    """k of Eq. (5) read as written, the time step counted through training.  # departure C"""
    return np.arange(episodes * steps).reshape(episodes, steps)


def count_episodes(episodes: int, steps: int) -> Counts:
    """k of Eq. (5) as Algorithm 1 uses it, the episode.  # departure C"""
    return np.repeat(np.arange(episodes), steps).reshape(episodes, steps)


@dataclass(frozen=True, eq=False, init=False)
class Exploration:
    """The noise of Eq. (5), drawn in advance so that every learner of a seed meets the same.

    `Exploration(episodes=40, steps=60, deviation=0.1)` draws normal noise that does not decay.
    """

    noise: Matrix  #: epsilon, shape (episodes, steps, m)
    scale: NDArray[np.floating]  #: c_epsilon^k, shape (episodes, steps); 1 if absent

    def __init__(
        self, noise: Any = None, scale: Any = None, *, episodes: int = 1, steps: int = 100,
        deviation: Any = 0.1, seed: int = 0, first: int = 0,
    ) -> None:  # fmt: skip
        """Take noise and scale, or draw noise of a standard deviation, a number or one an input.

        Each episode has a stream of its own, so that fewer episodes have the same noise, and
        episodes from `first` on go on where an earlier run of as many ended.
        """
        if noise is None:
            count, steps = integer("episodes", episodes), integer("steps", steps)
            spread = np.atleast_1d(np.array(deviation, float))
            if spread.ndim != 1 or not ((spread >= 0) & (spread < np.inf)).all():
                raise ValueError(
                    f"deviation = {deviation} must be a finite number, 0 or more, or one an input"
                )
            streams = (np.random.SeedSequence(seed, spawn_key=(0, first + e)) for e in range(count))
            draws = (np.random.default_rng(one).normal for one in streams)
            noise = np.array([draw(scale=spread, size=(steps, spread.size)) for draw in draws])
        scale = np.ones(np.shape(noise)[:2]) if scale is None else scale
        if np.ndim(noise) != 3 or np.shape(scale) != np.shape(noise)[:2]:
            raise ValueError(
                f"noise has shape {np.shape(noise)} and scale {np.shape(scale)}: they must be"
                " (episodes, steps, inputs) and (episodes, steps)"
            )
        vars(self).update(noise=noise, scale=scale)

    @classmethod
    def draw(
        cls,
        rng: np.random.Generator,
        shape: tuple[int, int, int],
        *,
        deviation: float = 1.0,
        decay_rate: float = 0.99,
        count: Callable[[int, int], Counts] = count_steps,
    ) -> "Exploration":
        """Normal noise that decays.

        Args:
            rng: draws the noise.
            shape: episodes, steps of an episode, inputs of the plant.
            deviation: standard deviation before the decay.
            decay_rate: c_epsilon.
            count: k of Eq. (5): `count_steps` or `count_episodes`.
        """
        scale = decay_rate ** count(*shape[:2])
        return cls(rng.normal(scale=deviation, size=shape), scale)

    @cached_property
    def scaled(self) -> Matrix:
        """The noise of every step at once, shape (episodes, steps, m)."""
        return self.scale[..., None] * self.noise


def train(
    learner: Learner, controller: Nmpc, weights: Weights, explore: Exploration, **options: Any
) -> Iterator[Step]:
    """Algorithm 1: as many episodes, and at most as many steps, as `explore` has noise for.

    A solve that fails ends the episode, and so does a plant that runs away to where no plan can
    begin; learning goes on from the next episode.  # departure M
    A step holds its solutions, 7 KB for the robot: of a long run, keep what you need of each.

    Args:
        learner: moves the weights.
        controller: acts, and is what is learned.
        weights: to start with.
        explore: the noise.
        clipped: whether actions are kept in the action space, by default; they must be where
            Q(s, a) is solved for and inputs have bounds.  # departure E
        constrained: whether Q(s, a) is solved for, with u_0 = a, instead of V(s); what the learner
            is meant for if absent.  # departure F
        plant: as in `environment`; the plant that plans if absent. The state in which an episode
            ends is worth 0.
        start: a state, or a function rng -> state; the task's if absent.
        data: of a `Problem` at each time t of an episode: a function of t, that gives what
            `Nmpc.solve` takes; or by name an array over the episode, of which each plan sees its
            N + 1 stages.
        rng: for a plant or a start that draws; of an int, a stream of its own, which noise that
            `default_rng` of the same int drew does not share.

    Raises:
        ValueError: at the call: an argument is no such thing, or there is no environment, as for a
            `Problem` without `plant` and `start`.
        Diverged: theta is no longer usable, or `PATIENCE` episodes in a row ended early.
    """
    trainer = Trainer(learner, controller, weights, explore, **options)
    return trainer.run(trainer.episode)


class Trainer:
    """Algorithm 1 with the arguments of `train`, checked."""

    def __init__(
        self,
        learner: Learner,
        controller: Nmpc,
        weights: Weights,
        explore: Exploration,
        *,
        clipped: bool = True,
        constrained: bool | None = None,
        plant: Any = None,
        start: Any = None,
        data: Data | None = None,
        rng: np.random.Generator | int = 0,
    ) -> None:
        nmpc = controller
        if not isinstance(nmpc, Nmpc):
            raise ValueError(f"controller = {controller!r} must be an Nmpc")
        if not isinstance(weights, Weights):
            raise ValueError(f"weights = {weights!r} must be Weights: write Weights(theta)")
        if explore.noise.shape[2] != nmpc.m:
            raise ValueError(f"the noise has {explore.noise.shape[2]} numbers a step; the NMPC has"
                             f" {nmpc.m} inputs")  # fmt: skip
        constrained = learner.values_actions if constrained is None else constrained
        if constrained and not clipped and np.isfinite([nmpc.lower, nmpc.upper]).any():
            raise ValueError(
                f"clipped = False lets actions leave {short(nmpc.lower)} and {short(nmpc.upper)},"
                f" where {learner.name} has no Q(s, a): leave it out, or learn V(s) by"
                " constrained=False"
            )
        self.learner, self.nmpc, self.explore = learner, nmpc, explore
        theta, w = (
            bounded_vector(name, vector, nmpc.problem.theta.size, nmpc.largest)
            for name, vector in (("theta", weights.theta), ("w", weights.w))
        )
        self.weights = replace(weights, theta=theta, w=w)
        self.clipped, self.constrained, self.rng = clipped, constrained, stream(rng, 1)
        self.environment = environment(nmpc, plant, start, data)
        self.ahead = forecasts(data, nmpc.horizon)  # the options of a solve at t
        plant = nmpc.plant if plant is None else plant
        self.plant = plant if isinstance(plant, Plant) else None  # the environment, if it is one

    def run(self, episode: Callable[[int, Weights], Iterator[Any]]) -> Iterator[Any]:
        """All results of `episode`, a function of an episode's number and first weights."""
        weights, failed = self.weights, 0
        for number in range(len(self.explore.scale)):
            failure = ""
            for made in episode(number, weights):
                weights, failure = made.weights, made.failure
                yield made
                left = absurd(weights, self.nmpc.largest)
                if left:
                    raise Diverged(f"{left} left the numbers that a solver is given")
            failed = failed + 1 if failure else 0
            if failed == PATIENCE:
                raise Diverged(f"{PATIENCE} episodes in a row ended in a failed solve: {failure}")

    def episode(self, number: int, weights: Weights) -> Iterator[Step]:
        """The steps of an episode."""
        return self.steps(number, 0, self.environment.start(self.rng), weights, None)

    def steps(
        self, episode: int, first: int, state: Vector, weights: Weights, warm: Solution | None
    ) -> Iterator[Step]:
        """The steps of an episode from the first on; the last one says so if a solve failed."""
        nmpc, known = self.nmpc, self.ahead(first)
        final = self.explore.scale.shape[1] - 1
        for t in range(first, final + 1):
            try:
                plan = nmpc.solve(state, weights.theta, warm, **known)
            except SolverError as error:
                yield self._failed(error, episode, t, state, weights, np.full(nmpc.m, np.nan))
                return
            action = plan.action + self.explore.scaled[episode, t]
            action = nmpc.clip(action) if self.clipped else action  # departure E
            next_state, cost, end, cut = self.environment.step(state, action, self.rng)
            found = (episode, t, state, weights, action, cost, plan)
            gone = unusable(next_state, cost, nmpc, end=end)
            if gone:
                yield self._failed(gone, *found)
                return
            last, later = end or cut or t == final, {} if end else self.ahead(t + 1)
            solution = None if self.constrained else plan
            try:
                if solution is None:
                    solution = nmpc.solve(state, weights.theta, plan, action, **known)
                transition = Transition(
                    state, action, cost, next_state, solution, end, last, later.get("data"),
                    first=t == 0,
                )  # fmt: skip
                update = self.learner.step(weights, transition)
            except SolverError as error:
                yield self._failed(error, *found, solution)
                return
            weights = update.weights
            step = Step(
                episode, t, state, weights, action, cost, plan, solution, update, "", end, last,
                next_state,
            )  # fmt: skip
            yield step
            if last:
                return
            state, known, warm = next_state, later, step.warm

    def _failed(
        self, why: Any, episode: int, t: int, state: Vector, weights: Weights, *found: Any
    ) -> Step:
        after = self.learner.interrupted(weights)
        step = Step(episode, t, state, after, *found)
        return replace(step, failure=str(why), last=True)


def absurd(weights: Weights, largest: float = ABSURD) -> str:
    """The name and value of a vector with which no solver can be called; "" if there is none.

    `largest` is that of the `Nmpc`; its default is that of every task's.
    """
    for name, vector in (("theta", weights.theta), ("w", weights.w)):
        small = sum(map(abs, vector.tolist())) <= largest  # false for nan, and faster than NumPy
        if not small and not (np.abs(vector) <= largest).all():
            return f"{name} = {short(vector)}"
    return ""

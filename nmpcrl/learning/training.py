"""Algorithm 1 as a generator of steps."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control import Nmpc, Plant, Solution, SolverError
from nmpcrl.control.nmpc import ABSURD
from nmpcrl.control.solution import short
from nmpcrl.learning.bootstrap import Controller, Transition
from nmpcrl.learning.environment import (
    Data,
    Environment,
    GymnasiumEnv,
    StepFunction,
    environment,
    forecasts,
    ran_away,
)
from nmpcrl.learning.learners import Learner, Update, Weights
from nmpcrl.learning.rollout import nmpc_of, stream

Counts = NDArray[np.int_]
Count = Callable[[int, int], Counts]  # (episodes, steps) -> k of each step

PATIENCE = 10  # so many episodes in a row that a failed solve ended are a divergence


class Diverged(Exception):
    """Learning cannot go on; the message says why."""


@dataclass(frozen=True, eq=False)
class Step:
    """One step of learning; `update` is None where it failed, and `solution` may be."""

    episode: int
    time: int  # t of Algorithm 1
    state: Vector  # s, shape (n,)
    weights: Weights  # after the step
    action: Vector  # a, noise included, shape (m,); nan where no action was found
    cost: float = np.nan  # l(s, a); nan where no action was found
    plan: Solution | None = None  # whose first input is the policy of Eq. (4)
    solution: Solution | None = None  # whose value is learned; the plan, unless that is Q(s, a)
    update: Update | None = None
    failure: str = ""  # what the solver said, if it failed, or where the plant went
    end: bool = False  # whether the plant ended the episode
    last: bool = False  # whether it is the last step of its episode, for whatever reason
    next_state: Vector | None = None  # s+; None where it failed

    @property
    def solves(self) -> list[Solution]:
        """Solutions of the plan, of Q(s, a) and of the next state, each once."""
        solutions = [self.plan, self.solution]
        if self.update and self.update.successor:
            solutions.append(self.update.successor.solution)
        return list(dict.fromkeys(filter(None, solutions)))

    @property
    def warm(self) -> Solution | None:
        """What the next step's first solve begins with."""
        successor = self.update and self.update.successor
        return (successor and successor.solution) or self.solution


@dataclass(frozen=True, eq=False)
class Exploration:
    """The noise of Eq. (5), drawn in advance so that every learner of a seed meets the same."""

    noise: Matrix  # epsilon, shape (episodes, steps, m)
    scale: NDArray[np.floating]  # c_epsilon^k, shape (episodes, steps)

    def __post_init__(self) -> None:
        noise, scale = np.shape(self.noise), np.shape(self.scale)
        if len(noise) != 3 or scale != noise[:2]:
            raise ValueError(
                f"noise has shape {noise} and scale {scale}: they must be (episodes, steps, inputs)"
                " and (episodes, steps)"
            )

    @classmethod
    def draw(
        cls,
        rng: np.random.Generator,
        shape: tuple[int, int, int],
        *,
        deviation: float = 1.0,
        decay_rate: float = 0.99,
        count: Count | None = None,
    ) -> "Exploration":
        """Normal noise that decays.

        Args:
            rng: draws the noise.
            shape: episodes, steps of an episode, inputs of the plant.
            deviation: standard deviation before the decay.
            decay_rate: c_epsilon.
            count: k of Eq. (5): `count_steps`, the default, or `count_episodes`.
        """
        scale = decay_rate ** (count or count_steps)(*shape[:2])
        return cls(rng.normal(scale=deviation, size=shape), scale)

    def __call__(self, policy: Vector, episode: int, time: int) -> Vector:
        """The action before it is clipped to the action space."""
        result: Vector = policy + self.scaled[episode, time]
        return result

    @cached_property
    def scaled(self) -> Matrix:
        """The noise of every step at once, shape (episodes, steps, m)."""
        return self.scale[..., None] * self.noise


def count_steps(episodes: int, steps: int) -> Counts:
    """k of Eq. (5) read as written, the time step counted through training.  # departure C"""
    return np.arange(episodes * steps).reshape(episodes, steps)


def count_episodes(episodes: int, steps: int) -> Counts:
    """k of Eq. (5) as Algorithm 1 uses it, the episode.  # departure C"""
    return np.repeat(np.arange(episodes), steps).reshape(episodes, steps)


def train(
    learner: Learner,
    controller: Controller,
    weights: Weights,
    explore: Exploration,
    *,
    clipped: bool = True,
    constrained: bool | None = None,
    plant: Plant | StepFunction | GymnasiumEnv | None = None,
    start: Any = None,
    data: Data | None = None,
    rng: np.random.Generator | int = 0,
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
        clipped: whether actions are kept in the action space; they must be where Q(s, a) is solved
            for and inputs have bounds.  # departure E
        constrained: whether Q(s, a) is solved for, with u_0 = a, instead of V(s); what the learner
            is meant for if absent.  # departure F
        plant: the environment, as in `environment`: a `Plant`, whose cost is the task's, a function
            (state, action, rng) -> (next state, cost, end), or a `gymnasium.Env`; the plant that
            plans if absent. The state in which an episode ends is worth 0.
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
    trainer = trainer_of(
        learner, controller, weights, explore, clipped=clipped, constrained=constrained,
        plant=plant, start=start, data=data, rng=rng,
    )  # fmt: skip
    return trainer.run()


@dataclass(frozen=True, eq=False)
class Trainer:
    """What an episode needs, as in `train`."""

    learner: Learner
    controller: Any
    nmpc: Nmpc
    weights: Weights  # to start with
    explore: Exploration
    clipped: bool
    constrained: bool
    plant: Plant | None  # the environment, if it is one
    environment: Environment
    data: Callable[[int], Mapping[str, Any]] | None
    rng: np.random.Generator

    def run(self) -> Iterator[Step]:
        """The steps of all episodes."""
        weights, failed = self.weights, 0
        for episode in range(len(self.explore.scale)):
            failure, state = "", self.environment.start(self.rng)
            for step in self.steps(episode, 0, state, weights, None):
                weights, failure = step.weights, step.failure
                yield step
                self.judge(weights)
            failed = self.counted(failed, failure)

    def judge(self, weights: Weights) -> None:
        """Raise Diverged where no solver can be called with the weights."""
        left = absurd(weights, self.nmpc.largest)
        if left:
            raise Diverged(f"{left} left the numbers that a solver is given")

    def counted(self, failed: int, failure: str) -> int:
        """How many episodes in a row failed, after another one; raises Diverged at `PATIENCE`."""
        failed = failed + 1 if failure else 0
        if failed == PATIENCE:
            raise Diverged(f"{PATIENCE} episodes in a row ended in a failed solve: {failure}")
        return failed

    def steps(
        self, episode: int, first: int, state: Vector, weights: Weights, warm: Solution | None
    ) -> Iterator[Step]:
        """The steps of an episode from the first on; the last one says so if a solve failed."""
        controller, constrained = self.controller, self.constrained
        nmpc, rng = self.nmpc, self.rng
        nothing = np.full(nmpc.m, np.nan)
        final = self.explore.scale.shape[1] - 1
        ahead = self.data
        known = ahead and ahead(first)
        for t in range(first, final + 1):
            data = {} if known is None else {"data": known}
            try:
                plan = controller.solve(state, weights.theta, warm, **data)
            except SolverError as error:
                weights = self.learner.interrupted(weights)
                yield Step(episode, t, state, weights, nothing, failure=str(error), last=True)
                return
            action = self.explore(plan.action, episode, t)
            action = nmpc.clip(action) if self.clipped else action  # departure E
            next_state, cost, end, cut = self.environment.step(state, action, rng)
            gone = ran_away(next_state, nmpc, end=end)
            if gone:
                weights = self.learner.interrupted(weights)
                yield Step(episode, t, state, weights, action, cost, plan, failure=gone, last=True)
                return
            last = end or cut or t == final
            later = ahead(t + 1) if ahead and not end else None
            solution = None
            try:
                solution = (
                    controller.solve(state, weights.theta, plan, action, **data)
                    if constrained
                    else plan
                )
                transition = Transition(state, action, cost, next_state, solution, end, last, later,
                                        first=t == 0)  # fmt: skip
                update = self.learner.step(weights, transition)
            except SolverError as error:
                weights = self.learner.interrupted(weights)
                what = (state, weights, action, cost, plan, solution)
                yield Step(episode, t, *what, failure=str(error), last=True)
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


def trainer_of(
    learner: Learner,
    controller: Controller,
    weights: Weights,
    explore: Exploration,
    *,
    clipped: bool = True,
    constrained: bool | None = None,
    plant: Plant | StepFunction | GymnasiumEnv | None = None,
    start: Any = None,
    data: Data | None = None,
    rng: np.random.Generator | int = 0,
) -> Trainer:
    """The arguments of `train`, checked as it says."""
    nmpc = nmpc_of(controller)
    if nmpc is None:
        raise ValueError(f"controller = {controller!r} must be an Nmpc, or hold one")
    if not isinstance(weights, Weights):
        raise ValueError(f"weights = {weights!r} must be Weights: write Weights(theta)")
    if explore.noise.shape[2] != nmpc.m:
        raise ValueError(f"the noise has {explore.noise.shape[2]} numbers a step; the NMPC has"
                         f" {nmpc.m} inputs")  # fmt: skip
    fixed = learner.values_actions if constrained is None else constrained
    if fixed and not clipped and np.isfinite([nmpc.lower, nmpc.upper]).any():
        raise ValueError(
            f"clipped = False lets actions leave {short(nmpc.lower)} and {short(nmpc.upper)}, where"
            f" {learner.name} has no Q(s, a): leave it out, or learn V(s) by constrained=False"
        )
    around, known = environment(nmpc, plant, start), forecasts(data, nmpc.horizon)
    return Trainer(
        learner,
        controller,
        nmpc,
        replace(weights, theta=np.array(weights.theta, float), w=np.array(weights.w, float)),
        explore,
        clipped,
        fixed,
        (plant or nmpc.plant) if plant is None or isinstance(plant, Plant) else None,
        around,
        known,
        stream(rng, 1),
    )


def absurd(weights: Weights, largest: float = ABSURD) -> str:
    """The name and value of a vector with which no solver can be called; "" if there is none.

    `largest` is that of the `Nmpc`; its default is that of every task's.
    """
    for name, vector in (("theta", weights.theta), ("w", weights.w)):
        small = sum(map(abs, vector.tolist())) <= largest  # false for nan, and faster than NumPy
        if not small and not (np.abs(vector) <= largest).all():
            return f"{name} = {short(vector)}"
    return ""

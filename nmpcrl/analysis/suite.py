"""The suite: judges learners, tuners and policies within a budget of episodes.

An entry gets a `Robot` in one place, and returns theta or a policy, which a rollout without noise
judges. A place is a layout or a scenario of moving obstacles; it is *solved* if under every seed
the robot ends at the target and the rollout costs no more than under theta_init.

    >>> judge(entry("CMA-ES[spread=0.1]"), "J001", seed_of("J001", 0), 50).cost  # doctest: +SKIP
"""

import pkgutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector, learning
from nmpcrl.analysis.encounters import count
from nmpcrl.analysis.search import LOWER, SCALE, SEARCHES, UPPER
from nmpcrl.analysis.statistics import interquartile_mean, rate
from nmpcrl.control import Nmpc, SolverError, Task
from nmpcrl.learning import Diverged, Exploration, Learner, Step, Weights, remedies, train
from nmpcrl.learning.gauss_newton import closed_loop
from nmpcrl.learning.optimisers import TrustRegion
from nmpcrl.learning.rollout import Rollout, evaluate
from nmpcrl.learning.training import absurd
from nmpcrl.study import Experiment, paper
from nmpcrl.study.drawn import JUDGE, SCENARIOS, TUNE, Scenario
from nmpcrl.study.geometry import Centres
from nmpcrl.study.jobs import Failed, parallel
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.moving import TASK, World, centres, controller, extrapolated
from nmpcrl.study.parameters import number, numbers, refused, shortened, whole
from nmpcrl.study.refusal import Refusal
from nmpcrl.study.setup import prepare

MOST_EPISODES, MOST_SEEDS = 10_000, 100
HELD_OUT = 1_000_000  # the first seed; the study's seeds are below 100
TOLERANCE = 1e-9  # relative, of two costs that are compared
LAYOUTS: Mapping[str, Centres] = {**JUDGE, **TUNE, **paper.LAYOUTS}
THETA = np.array(paper.THETA_INIT)
RETURNED = numbers([number(-1e300, 1e300)] * THETA.size, f"{THETA.size} finite numbers or a policy")
ACTION = numbers([number(-1e300, 1e300)] * 2, "2 finite numbers")
NO_ROLLOUT = Rollout(np.zeros((0, 3)), np.zeros((0, 2)), np.zeros(0), failure="not begun")

Policy = Callable[[Vector], Vector]  # observation of `nmpcrl/Robot-v0` -> action
Change = Callable[..., Learner]  # (learner, robot, **settings)


class OverBudget(Refusal):
    """An episode was begun beyond the budget."""


class Robot:
    """The robot in one place, with a budget of episodes.

    An episode of `train`, `rollout`, `cost` or `env` counts from its first step; beyond the budget
    it raises OverBudget. Among moving obstacles the controller extrapolates each obstacle's last
    movement, and `task` has no obstacle.
    """

    def __init__(self, place: str | Centres, budget: int, seed: int) -> None:
        """`place` names a layout or a scenario (J001, T01, A, M01), or has the centres [m]."""
        self.motions: Scenario = SCENARIOS.get(place, ()) if isinstance(place, str) else ()
        self.budget, self.seed, self.begun = budget, seed, 0
        self.rng = np.random.default_rng(seed)
        if self.motions:
            first = centres(self.motions, 0)[0].tolist()
            self.centres: Centres = tuple((x, y) for x, y in first)
            self.task: Task = TASK
            self.controller: Nmpc = controller(len(self.motions))
        else:
            self.centres = LAYOUTS[place] if isinstance(place, str) else place
            self.task = paper.task(self.centres)
            self.controller = paper.controller(self.task)

    @property
    def left(self) -> int:
        """Episodes left of the budget."""
        return max(self.budget - self.begun, 0)

    def train(
        self, learner: Learner, weights: Weights, explore: Exploration, **options: Any
    ) -> Iterator[Step]:
        """`learning.train` in this place, with its options, such as `constrained`."""
        return train(learner, self.controller, weights, explore, **options, **self._environment())

    def rollout(self, theta: Vector) -> Rollout:
        """`learning.evaluate` in this place: an episode without noise."""
        return evaluate(self.controller, theta, paper.STEPS, **self._environment())

    def cost(self, theta: Vector) -> float:
        """The summed cost of `rollout`; infinite if a solve failed."""
        return self.rollout(theta).cost

    def env(self) -> Any:
        """`nmpcrl/Robot-v0` in this place, also where a reset asks for another layout."""
        from nmpcrl.study.robot import RobotEnv  # imports Gymnasium, which few entries need

        robot = self

        class Counted(RobotEnv):
            """The environment, whose resets count."""

            def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
                robot._count()
                return super().reset(seed=seed)

        return Counted(self.centres, motions=self.motions)

    def _environment(self) -> dict[str, Any]:
        """The environment of one call of `train` or `evaluate`."""
        world = World(self.motions, extrapolated) if self.motions else None

        def start(rng: np.random.Generator) -> Vector:
            self._count()
            return world.begin(rng) if world else self.task.start

        return {**(world.environment if world else {}), "start": start}

    def _count(self) -> None:
        self.begun += 1
        if self.begun > self.budget:
            raise OverBudget(f"episode {self.begun} was begun with a budget of {self.budget}")


@dataclass(frozen=True, eq=False)
class Entry:
    """A learner, tuner or policy with its settings: a function of a `Robot`.

    >>> str(ENTRIES["CMA-ES"].with_settings(spread=0.1))
    'CMA-ES[spread=0.1]'
    """

    name: str
    run: Callable[..., Any]  # (robot, settings by name) -> theta or `Policy`
    defaults: Mapping[str, float] = field(default_factory=dict)
    changed: Mapping[str, float] = field(default_factory=dict)  # settings other than the default

    @property
    def settings(self) -> dict[str, float]:
        """All settings by name."""
        return {**self.defaults, **self.changed}

    def with_settings(self, **settings: float) -> "Entry":
        """The entry with other settings, which are above 0."""
        for key, value in settings.items():
            if key not in self.defaults:
                known = f"one of {', '.join(self.defaults)}" if self.defaults else "absent"
                raise refused("setting", key, f"{known} for entry {self.name!r}")
            integer = isinstance(self.defaults[key], int)
            if not 0 < value < np.inf or (integer and value != int(value)):
                raise refused(key, value, f"a {'whole' if integer else 'finite'} number above 0")
        both = {**self.settings, **settings}
        return replace(
            self, changed={key: both[key] for key in both if both[key] != self.defaults[key]}
        )

    def __call__(self, robot: Robot) -> Any:
        """Theta or a policy, within the robot's budget."""
        return self.run(robot, **self.settings)

    def __str__(self) -> str:
        """The name in published tables, such as "ES[alpha=3e-07]"."""
        changed = ",".join(f"{key}={value:g}" for key, value in self.changed.items())
        return f"{self.name}[{changed}]" if changed else self.name


def learned(
    robot: Robot, *, learner: str = "ES", change: Change | None = None, **settings: float
) -> Vector:
    """The last finite theta of a learner of the study, trained as long as the budget lasts.

    `change` gives another learner to train in its place. Settings are alpha, with which beta of GES
    and TDC changes in proportion; `every`, the episodes between two confirming rollouts, which
    count; and others for `change`.
    """
    every = int(settings.get("every", 0))
    episodes = (robot.budget - 1) * every // (every + 1) if every else robot.budget
    factor = settings.get("alpha", paper.ALPHA) / paper.ALPHA
    experiment = Experiment(
        learner=learner,
        seed=robot.seed,
        episodes=max(episodes, 1),
        layout=robot.centres,
        alpha=factor * paper.ALPHA,
        beta=factor * paper.BETA,
        beta_tdc=factor * paper.BETA_TDC,
    )
    made, weights, explore = prepare(experiment, robot.controller)
    made = change(made, robot, **settings) if change else made
    if not episodes:
        return weights.theta
    with suppress(Diverged):
        for step in robot.train(made, weights, explore, constrained=experiment.values_actions):
            weights = weights if absurd(step.weights) else step.weights
    return remedies.judged_theta(weights)


def _guarded(learner: Learner, _: Robot, alpha: float) -> Learner:
    return remedies.guarded(learner, alpha)


def _of_controller(make: Callable[..., Learner]) -> Change:
    """A learner of the controller, in the place of the study's."""
    return lambda _, robot, **settings: make(robot.controller, **settings)


def _bounded(make: Callable[..., Learner]) -> Change:
    """A learner of the controller with a trust region, in the place of the study's."""
    return lambda _, robot, radius: make(
        robot.controller, optimiser=TrustRegion(radius, SCALE), bounds=(LOWER, UPPER)
    )


def _undone(change: Change) -> Change:
    """`change`, with an undo of the steps after which a confirming rollout costs more."""
    return lambda learner, robot, every, **settings: remedies.undo(
        change(learner, robot, **settings), robot.cost, int(every)
    )


def _learned(
    name: str, change: Change | None = None, learner: str = "ES", **settings: float
) -> Entry:
    return Entry(name, partial(learned, learner=learner, change=change), settings)


def _searched(name: str) -> Entry:
    search = SEARCHES[name]
    return Entry(
        name,
        lambda robot, **own: search(robot.cost, THETA, robot.budget, robot.seed, **own),
        search.__kwdefaults__ or {},
    )


ALPHA, RADIUS = paper.ALPHA, 0.3  # step size; radius of trust regions, in `SCALE`s
_ENTRIES = (
    Entry("frozen", lambda _: THETA.copy()),
    _searched("grid"),
    *(_learned(one, learner=one, alpha=ALPHA) for one in ("ES", "GES", "TDC", "RDES", "DES")),
    _learned("TDRC", _of_controller(remedies.tdrc), alpha=ALPHA,
             regularisation=remedies.REGULARISATION),
    _learned("GES-3", _of_controller(remedies.normalised_ges), alpha=ALPHA, ratio=3.0),
    _learned("guarded-ES", _guarded, alpha=ALPHA),
    _learned("guarded-RDES", _guarded, "RDES", alpha=ALPHA),
    _learned("control-RDES", lambda learner, _, alpha: remedies.directed(
        remedies.guarded(learner, alpha), alpha), "RDES", alpha=ALPHA),
    _learned("averaged-ES", lambda learner, robot, **_: remedies.averaged(
        learner, robot.budget * paper.STEPS // 2), alpha=ALPHA),
    _learned("undone-ES", _undone(lambda learner, *_, **__: learner), alpha=ALPHA, every=1),
    _learned("undone-LSTD-Q", _undone(_bounded(learning.lstd_q)), radius=RADIUS, every=1),
    _learned("GN-J", _bounded(closed_loop), radius=RADIUS),
    _learned("undone-GN-J", _undone(_bounded(closed_loop)), radius=RADIUS, every=1),
    _learned("DPG", _bounded(learning.policy_gradient), radius=RADIUS),
    *map(_searched, ("SPSA", "CMA-ES", "Bayes")),
)  # fmt: skip
ENTRIES: Mapping[str, Entry] = {one.name: one for one in _ENTRIES}


def entry(name: str, known: Mapping[str, Entry] = ENTRIES) -> Entry:
    """An entry by its name: "ES", "CMA-ES[spread=0.1]", or "my_module:factory".

    A factory is a function of a `Robot`; its module may lie in the working directory.
    """
    base, bracket, inner = name.partition("[")
    if base in known:
        pairs = [one.split("=") for one in inner.removesuffix("]").split(",")] if bracket else []
        try:
            settings = {key.strip(): float(value) for key, value in pairs}
        except ValueError:
            raise refused("entry", name, "of the form ES[alpha=3e-7]") from None
        return known[base].with_settings(**settings)
    if ":" not in name.strip(":"):
        raise refused("entry", name, f"MODULE:FACTORY or one of {', '.join(known)}")
    sys.path.insert(0, here := str(Path.cwd()))
    try:
        factory = pkgutil.resolve_name(name)
    except (Exception, SystemExit) as error:  # whatever the module raises
        why = shortened(f"{type(error).__name__}: {error}")
        raise Refusal(f"entry = {name!r} cannot be imported: {why}") from error
    finally:
        sys.path.remove(here)
    if not callable(factory):
        raise refused("entry", name, f"the name of a function of a Robot, not of {factory!r}")
    return Entry(name, factory)


@dataclass(frozen=True)
class Judgement:
    """The result of an entry in one place with one seed."""

    initial: float  # cost under theta_init
    cost: float  # infinite if a solve failed
    arrived: bool
    episodes: int  # begun
    seconds: float  # of processor time
    over: bool = False  # whether more episodes were begun than the budget
    inside: int = 0  # states in a moving obstacle


def gain(judged: Any) -> Any:
    """Share of theta_init's cost that is saved: a number of a `Judgement`, a column of a table."""
    return 1 - judged.cost / judged.initial


def solved(judged: Any) -> Any:
    """Whether the robot ends at the target, at no more cost than under theta_init; as `gain`."""
    return judged.arrived & (judged.cost <= judged.initial * (1 + TOLERANCE))


def judge(one: Entry | Callable[[Robot], Any], place: str | Centres, seed: int,
          episodes: int) -> Judgement:  # fmt: skip
    """Judge an entry, or another function of a `Robot`, in one place by a rollout without noise."""
    robot, judging = Robot(place, episodes, seed), Robot(place, 2, seed)
    initial, seconds, began = judging.cost(THETA), 0.0, time.process_time()
    rollout = NO_ROLLOUT
    with suppress(OverBudget):
        found = one(robot)
        seconds = time.process_time() - began
        rollout = _rollout(judging, found)
    arrived = not rollout.failure and judging.task.distance(rollout.states[-1]) <= ARRIVED
    inside = count(rollout.states, robot.motions).inside if robot.motions else 0
    return Judgement(
        initial, rollout.cost, bool(arrived), min(robot.begun, episodes), seconds,
        robot.begun > episodes, inside,
    )  # fmt: skip


def seed_of(place: str, k: int) -> int:
    """The k-th seed of a place; no two places share one."""
    for further, names in enumerate((JUDGE, TUNE, paper.LAYOUTS)):
        if place in names:
            return HELD_OUT * (1 + further) + MOST_SEEDS * [*names].index(place) + k
    return scenario_seed(place, k)


def scenario_seed(place: str, k: int) -> int:
    """The k-th seed of a scenario, sequence or layout of the worlds that change."""
    return 5 * HELD_OUT + 1000 * (100 * ord(place[0]) + int(place[1:])) + k


def judge_all(
    name: str,
    *,
    moving: bool = False,
    budget: int = 300,
    layouts: int | None = None,
    seeds: int = 2,
    workers: int | None = None,
) -> pd.DataFrame:
    """Judge an entry, by its name, in the first `layouts` places with every seed.

    The places are `JUDGE`, or with `moving` the scenarios. A row has entry, place, k and
    the fields of `Judgement`, repeatable except for seconds.
    """
    places = SCENARIOS if moving else JUDGE
    budget = whole(1, MOST_EPISODES).check("budget", budget)
    seeds = whole(1, MOST_SEEDS).check("seeds", seeds)
    if layouts is not None:
        layouts = whole(1, len(places)).check("layouts", layouts)
    entry(name)  # refuses an unknown one before a process is begun
    jobs = [(place, k) for place in islice(places, layouts) for k in range(seeds)]

    def judged(job: tuple[str, int]) -> Judgement:  # in a worker, which imports the entry
        return judge(entry(name), job[0], seed_of(*job), budget)

    try:
        found = dict(parallel(judged, jobs, workers, name))
    except Failed as error:
        (place, _), why, _ = error.failures[0]
        raise Refusal(f"entry = {name!r} failed in {place}: {shortened(why)}") from None
    return pd.DataFrame(
        [{"entry": name, "place": job[0], "k": job[1], **asdict(found[job])} for job in jobs]
    )


def scores(judged: pd.DataFrame) -> dict[str, Any]:
    """The scores of one entry in the rows of `judge_all`.

    places (how many), solved and clear (of moving obstacles; shares of the places), gain
    (interquartile mean over places), episodes (most in a place), seconds, and over (the first place
    in which the budget was exceeded, or ""). Intervals are over places.
    """
    places = [each for _, each in judged.groupby("place", sort=False)]
    gains = np.array([np.mean(gain(each).to_numpy()) for each in places])  # over seeds
    return {
        "places": len(places),
        "solved": rate(sum(bool(solved(each).all()) for each in places), len(places)),
        "gain": interquartile_mean(gains, ["places"] * len(places)),
        "episodes": int(judged.episodes.max()),
        "seconds": sum(judged.seconds),
        "clear": rate(sum(not each.inside.any() for each in places), len(places)),
        "over": next(iter(judged.place[judged.over.astype(bool)]), ""),
    }


def followed(robot: Robot, policy: Policy) -> Rollout:
    """An episode of a policy in `nmpcrl/Robot-v0`."""

    env, actions, costs, failure = robot.env(), [], [], ""
    seen, _ = env.reset(seed=0)
    try:
        for _ in range(paper.STEPS):
            chosen = np.array(ACTION.check("what the policy chose", policy(seen.copy())))
            seen, reward, *_ = env.step(chosen)
            actions.append(chosen)
            costs.append(-reward)
    except SolverError as error:  # of a policy that plans
        failure = str(error)
    states = np.reshape(env.states[: len(costs)], (-1, 3))
    return Rollout(states, np.reshape(actions, (-1, 2)), np.array(costs), failure)


def _rollout(robot: Robot, found: Any) -> Rollout:
    """An episode without noise under theta or a policy; ParameterError for anything else."""
    if callable(found):
        return followed(robot, found)
    theta = np.array(RETURNED.check("what the entry returned", found))
    try:
        return robot.rollout(theta)
    except ValueError:  # too large for a solver
        return NO_ROLLOUT

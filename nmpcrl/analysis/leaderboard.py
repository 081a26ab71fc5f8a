"""The suite: any learner, tuner or policy, judged on the layouts of `JUDGE` within a budget.

A second table has the scenarios in which the obstacles move. For each layout and seed an entry gets
a `Robot`, spends its budget, and returns a theta or a policy, which a rollout without noise judges.
A layout is *solved* if under every seed the robot is at the target at the end and it costs no more
than under theta_init. A layout is the unit: what is inferred is for others that are drawn alike.
"""

import importlib
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis.encounters import count
from nmpcrl.analysis.entries import ENTRIES, Factory, entry_with
from nmpcrl.analysis.interaction import AmongMoving, OverBudget, Policy, Robot
from nmpcrl.analysis.statistics import Estimate, interquartile_mean, rate
from nmpcrl.control import SolverError
from nmpcrl.learning.rollout import Rollout
from nmpcrl.study import paper
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.parameters import refused, whole
from nmpcrl.study.population import JUDGE
from nmpcrl.study.scenarios import load
from nmpcrl.study.storage.executor import execute
from nmpcrl.study.storage.refusal import Refusal

BUDGET, SEEDS = 300, 2  # episodes a layout and seed; seeds a layout
MOST_BUDGET, MOST_SEEDS = 10_000, 100
HELD_OUT = 1_000_000  # the first seed; the study's are below 100
TOLERANCE = 1e-9  # of a cost that is to be no more than another


class NoEntry(Refusal):
    """What is named is no entry, or does not do what one does; the message says why."""


@dataclass(frozen=True)
class Judged:
    """An entry in one layout with one seed."""

    initial: float  # cost under theta_init
    cost: float  # infinite where a solve failed
    arrived: bool
    episodes: int  # begun
    seconds: float  # of processor time
    over: bool = False  # whether it went beyond its budget
    inside: int = 0  # states in an obstacle that moves

    @property
    def solved(self) -> bool:
        """At the target at the end, and at no more than theta_init's cost."""
        return self.arrived and self.cost <= self.initial * (1 + TOLERANCE)

    @property
    def gain(self) -> float:
        """Share of theta_init's cost that is saved."""
        return 1 - self.cost / self.initial


@dataclass(frozen=True)
class Row:
    """One line of the leaderboard."""

    entry: str
    layouts: int
    solved: Estimate  # share of the layouts
    gain: Estimate  # interquartile mean over layouts of the mean over seeds
    episodes: int  # at most, in any layout
    seconds: float  # of processor time, in all
    disqualified: str = ""  # why, in a sentence
    clear: Estimate | None = None  # share of the scenarios in which no state is in an obstacle


@dataclass(frozen=True)
class Table:
    """Where entries are judged, by name, and with what."""

    places: Mapping[str, Any]  # centres, or motions, of obstacles
    robot: Callable[[Any, int, int], Robot]  # (place, budget, seed)
    seed_of: Callable[[str, int], int]  # (name, number)


def scenario_seed(name: str, k: int) -> int:
    """The seed number k of a scenario, which no layout has."""
    return 5 * HELD_OUT + 1000 * (100 * ord(name[0]) + int(name[1:])) + k


STILL = Table(JUDGE, Robot, lambda name, k: HELD_OUT + MOST_SEEDS * [*JUDGE].index(name) + k)
MOVING = Table(load(), AmongMoving, scenario_seed)


def entry_of(name: str) -> Factory:
    """An entry by its name in `ENTRIES`, with something set or not, or as MODULE:FACTORY.

    The working directory is searched, too.

    Raises:
        NoEntry: there is none.
        NoSetting: it cannot be set so.
    """
    if name.partition("[")[0] in ENTRIES:
        return entry_with(name)
    module, colon, attribute = name.partition(":")
    if not (module and colon and attribute):
        shipped = "one that ships, such as ES, undone-GES or CMA-ES"
        raise NoEntry(f"policy = {name!r} must be MODULE:FACTORY, or {shipped}")
    here = str(Path.cwd())
    sys.path.insert(0, here)
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (Exception, SystemExit) as error:  # whatever its module raises
        raise NoEntry(f"policy = {name!r} cannot be imported: {_short(error)}") from error
    finally:
        sys.path.remove(here)
    if not callable(found):
        raise NoEntry(f"policy = {name!r} must name a function of a Robot, and is {found!r}")
    return found  # type: ignore[no-any-return]


def judge(
    name: str,
    table: Table = STILL,
    *,
    budget: int = BUDGET,
    layouts: int | None = None,
    seeds: int = SEEDS,
    workers: int | None = None,
    progress: bool = True,
) -> Row:
    """Judge an entry; the same call gives the same row but for its time.

    Args:
        name: as in `entry_of`.
        table: `STILL`, or `MOVING`, whose scenarios are meant by "layouts" then.
        budget: episodes that it may begin, in each layout and with each seed.
        layouts: the first so many; all if absent.
        seeds: a layout.
        workers: processes; as many as there are cores if absent.
        progress: whether to show a bar.

    Raises:
        ParameterError: an argument is not what it may be.
        NoEntry: there is no such entry, or it failed, or returned what is neither.
    """
    budget = whole(1, MOST_BUDGET).check("budget", budget)
    seeds = whole(1, MOST_SEEDS).check("seeds", seeds)
    if layouts is not None:
        layouts = whole(1, len(table.places)).check("layouts", layouts)
    entry_of(name)
    chosen = dict(islice(table.places.items(), layouts))
    jobs = {
        (layout, k): partial(judge_once, name, place, budget, table.seed_of(layout, k), table.robot)
        for layout, place in chosen.items()
        for k in range(seeds)
    }
    found: dict[tuple[str, int], Judged] = {}

    def keep(job: tuple[str, int], judged: Judged) -> str:
        found[job] = judged
        return ""

    failures = execute(jobs, keep, workers=workers, progress=progress, unit="layout")
    for job in jobs:
        if job in failures:
            raise NoEntry(f"policy = {name!r} failed in {job[0]}: {_short(failures[job])}")
    return row(name, budget, {one: [found[one, k] for k in range(seeds)] for one in chosen})


def judge_once(
    name: str, place: Any, budget: int, seed: int, among: Callable[..., Robot] = Robot
) -> Judged:
    """Give an entry its robot, and judge what it returns."""
    robot, judged = among(place, budget, seed), among(place, 2, seed)
    initial, seconds, began = judged.cost(np.array(paper.THETA_INIT)), 0.0, time.process_time()
    try:
        answer = entry_of(name)(robot)
        seconds = time.process_time() - began
        rollout = _rollout(judged, answer)
    except OverBudget as error:
        rollout = _failed(error)
    arrived = not rollout.failure and judged.task.distance(rollout.states[-1]) <= ARRIVED
    return Judged(
        initial, rollout.cost, bool(arrived), min(robot.begun, budget), seconds,
        robot.begun > budget, count(rollout.states, robot.motions).inside if robot.motions else 0,
    )  # fmt: skip


def row(name: str, budget: int, found: Mapping[str, Sequence[Judged]]) -> Row:
    """The line of an entry, of what it did in each layout under each seed."""
    gains = np.array([np.mean([one.gain for one in each]) for each in found.values()])
    solved = sum(all(one.solved for one in each) for each in found.values())
    every = [one for each in found.values() for one in each]
    clear = sum(not any(one.inside for one in each) for each in found.values())
    over = next((layout for layout, each in found.items() if any(one.over for one in each)), "")
    return Row(
        entry=name,
        layouts=len(found),
        solved=rate(solved, len(found)),
        gain=interquartile_mean(gains, ["layouts"] * len(gains)),
        episodes=max(one.episodes for one in every),
        seconds=sum(one.seconds for one in every),
        disqualified=f"it began more than {budget} episodes in {over}" if over else "",
        clear=rate(clear, len(found)),
    )


def _rollout(robot: Robot, answer: Any) -> Rollout:
    """An episode without noise under what an entry returned.

    Raises:
        NoEntry: it is neither theta nor a policy.
    """
    if callable(answer):
        return followed(robot, answer)
    size = len(paper.THETA_INIT)
    try:
        theta = np.array(answer, float)
    except (TypeError, ValueError):
        theta = np.array([np.nan])
    if theta.shape != (size,) or not np.isfinite(theta).all():
        raise refused("what the entry returned", answer, f"{size} finite numbers or a policy")
    try:
        return robot.rollout(theta)
    except ValueError as error:  # too large for a solver
        return _failed(error)


def followed(robot: Robot, policy: Policy) -> Rollout:
    """An episode in `nmpcrl/Robot-v0`."""
    env = robot.env()
    observation, _ = env.reset()
    actions, costs = [], []
    over = False
    while not over:
        try:
            action = np.array(policy(observation.copy()), float)
        except SolverError as error:
            return _failed(error)
        observation, reward, _, over, _ = env.step(action)
        actions.append(action)
        costs.append(-reward)
    return Rollout(np.array(env.states[:-1]), np.array(actions), np.array(costs))


def _failed(error: Exception) -> Rollout:
    nothing: Vector = np.zeros((0, 3))
    return Rollout(nothing, nothing[:, :2], nothing[:, 0], failure=str(error) or "failed")


def _short(error: BaseException) -> str:
    """An error in one line."""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__

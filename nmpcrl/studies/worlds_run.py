"""Runs among obstacles that move, with a wrong model, or with a richer terminal cost.

A policy is "init", "grid" (over theta_c), "CMA-ES" or "ES"; and where the model can be learned
"ES+model", "oracle" or "oracle+ES".
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis.encounters import judged
from nmpcrl.analysis.search import cma_es, grid
from nmpcrl.analysis.suite import Robot, entry
from nmpcrl.control import Nmpc
from nmpcrl.control.problem import Parameter
from nmpcrl.learning import Diverged, Exploration, Weights, expected_sarsa, train
from nmpcrl.learning.rollout import evaluate
from nmpcrl.learning.training import absurd
from nmpcrl.studies.investigation import Condition, Row
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, SCENARIOS
from nmpcrl.study.faults import FAULTS, Fault, robot
from nmpcrl.study.moving import PREDICTORS, TARGET, World, diagonal, problem, square, still

TERMINALS = ("diagonal", "full", "learned")  # the paper's first
BELOW = ((1, 0), (2, 0), (2, 1))  # entries of the triangular factor of V^f that the paper leaves 0
BUMPS = np.array([(x, y) for x in np.linspace(-1, 7, 5) for y in np.linspace(-1, 5, 5)])  # [m]
WIDTHS = np.array([2.0, 1.5])  # of a bump, along x and y [m]: the distance to the next
HEIGHT = 1000.0  # of a bump of weight 1: V_theta(s) itself is some thousands
TURNS, MOVES = np.array([0.0, 1.0]), np.eye(2, 3)  # the input of the bias, the states of the drift
MODEL = {
    "gain": Parameter(np.eye(2), -2.0, 2.0),
    "bias": Parameter(0.0, -1.0, 1.0),
    "drift": Parameter(np.zeros(2), -0.5, 0.5),
}
ORACLES = ("oracle", "oracle+ES")  # policies that begin with the model of the fault
DRAWS = 5  # rollouts that judge theta where the fault draws
THETA = np.array(paper.THETA_INIT)


def learned_model(x: Any, u: Any, th: Any, _: Any) -> Any:
    """The robot's model under gain u + (0, bias), and then drift."""
    applied = th["gain"] @ u + th["bias"] * TURNS
    return robot().transition(x, applied) + robot().period * (th["drift"].T @ MOVES).T


def full(x: Any, th: Any, _: Any) -> Any:
    """Any positive semidefinite quadratic terminal cost of x - s_ref, by a triangular factor."""
    away = x - TARGET
    scaled = [th["f"][i] * away[i] for i in range(3)]
    for k, (i, j) in enumerate(BELOW):
        scaled[i] += th["below"][k] * away[j]
    return square(scaled, 3)


def bumps(x: Any, th: Any, _: Any) -> Any:
    """The paper's terminal cost plus a weighted sum of `BUMPS`."""
    cost = diagonal(x, th)
    for k, bump in enumerate(BUMPS):
        cost += HEIGHT * th["bumps"][k] / (1 + square((x[:2] - bump) / WIDTHS, 2)) ** 2
    return cost


RICHER: Mapping[str, dict[str, Any]] = {  # arguments of `moving.problem`
    "diagonal": {},
    "full": {"terminal": full, "further": {"below": np.zeros(len(BELOW))}},
    "learned": {"terminal": bumps, "further": {"bumps": np.zeros(len(BUMPS))}},
    "model": {"model": learned_model, "further": MODEL},
}


@cache
def controller(kind: str = "diagonal", obstacles: int = 4) -> Nmpc:
    """The NMPC of a kind of `RICHER`, compiled once."""
    return Nmpc(problem(obstacles, **RICHER[kind]))


def row(
    cost: float,  # of the last theta; of `gradient` the cosine
    inside: int = 0,  # states in an obstacle
    collisions: int = 0,  # times that the robot enters one
    arrived: bool = False,  # whether the robot is at the target at the end
    series: Sequence[float] = (),  # costs, every `shifts.EVERY` episodes or by layout; or theta
    events: Sequence[int] = (),  # episodes at whose end a chart fired
) -> Row:
    """A row; columns that a part does not measure have their defaults."""
    return {
        "cost": float(cost), "inside": inside, "collisions": collisions,
        "arrived": arrived, "series": [*series], "events": [*events],
    }  # fmt: skip


def exploration(episodes: int, seed: int) -> Exploration:
    """The paper's noise on the action."""
    rng, shape = np.random.default_rng([seed, 0]), (episodes, paper.STEPS, 2)
    return Exploration.draw(rng, shape, deviation=paper.NOISE, decay_rate=paper.DECAY_RATE)


def theta_of(
    policy: str, nmpc: Nmpc, world: World, start: Vector, episodes: int, seed: int
) -> Vector:
    """The theta of a policy in a world, from a start; of ES the last that a solver can take."""
    if policy in ("init", "oracle"):
        return start
    if policy in ("grid", "CMA-ES"):
        draws = iter(np.random.SeedSequence([seed, 2]).generate_state(episodes).tolist())
        search = grid if policy == "grid" else cma_es
        return search(lambda theta: judged(nmpc, theta, world, next(draws)).cost,
                      start, episodes, seed)  # fmt: skip
    weights = Weights(start, np.full(start.size, paper.W_INIT))
    rng, explore = np.random.default_rng([seed, 1]), exploration(episodes, seed)
    learner = expected_sarsa(nmpc, paper.ALPHA)
    with suppress(Diverged):
        for step in train(learner, nmpc, weights, explore, rng=rng, **world.environment):
            weights = weights if absurd(step.weights) else step.weights
    return weights.theta


def moving(setting: tuple[str, str], place: str, episodes: int, seed: int) -> Row:
    """A view and a policy among obstacles that move."""
    view, policy = setting
    world = World(SCENARIOS[place], PREDICTORS[view])
    nmpc = controller(obstacles=len(world.motions))
    theta = theta_of(policy, nmpc, world, nmpc.problem.theta, episodes, seed)
    made = judged(nmpc, theta, world)
    return row(made.cost, *made.contacts, made.arrived)


def model(setting: tuple[str, str], place: str, episodes: int, seed: int) -> Row:
    """A policy on a robot with a fault; the mean cost where the fault is random."""
    fault, policy = FAULTS[setting[0]], setting[1]
    nmpc = controller("diagonal" if policy in ("init", "grid", "ES") else "model")
    world = World(still(JUDGE[place]), fault=fault)
    start = nmpc.problem.vector(**(fault.model if policy in ORACLES else {}))
    theta = theta_of(policy, nmpc, world, start, episodes, seed)
    draws = DRAWS if fault.slip or any(fault.noise) else 1
    made = [judged(nmpc, theta, world, draw) for draw in range(draws)]
    cost = float(np.mean([each.cost for each in made]))
    inside, collisions = np.sum([each.contacts for each in made], axis=0).tolist()
    return row(cost, inside, collisions, all(each.arrived for each in made), theta.tolist())


def carry(name: str, place: str, episodes: int, seed: int) -> Row:
    """The costs of the theta of one layout in all of `JUDGE`, by the paper's own controller."""
    theta = entry(name)(Robot(JUDGE[place], episodes, seed))
    assert not callable(theta)  # no policy is carried
    costs = [evaluate(paper.nmpc(each), theta, paper.STEPS).cost for each in JUDGE.values()]
    return row(costs[[*JUDGE].index(place)], series=costs)


def gradient(deviation: float, place: str, episodes: int, seed: int) -> Row:
    """The cosine of the summed steps of ES at theta_init with noise in the state and without."""
    nmpc, explore, sums = controller(), exploration(episodes, seed), []
    for each in (0.0, deviation):
        world = World(still(JUDGE[place]), fault=Fault(noise=(each,) * 3))
        weights, summed = Weights(THETA, np.zeros(THETA.size)), np.zeros(THETA.size)
        rng = np.random.default_rng(seed)  # the published draws: the stream of `exploration`
        learner = expected_sarsa(nmpc, 0.0)
        for step in train(learner, nmpc, weights, explore, rng=rng, **world.environment):
            if step.update and step.solution and step.update.delta is not None:
                summed += step.update.delta * step.solution.features
        sums.append(summed)
    exact, noisy = sums
    lengths = np.linalg.norm(exact), np.linalg.norm(noisy)
    return row(exact @ noisy / np.prod(lengths), series=[float(lengths[1] / lengths[0])])


def terminal(kind: str, place: str, episodes: int, seed: int) -> Row:
    """ES with a terminal cost, in the paper's world; costs are shares of theta_init's."""
    nmpc, world = controller(kind), World(still(JUDGE[place]))
    start = nmpc.problem.theta
    theta = theta_of("ES", nmpc, world, start, episodes, seed)
    initial, made = (judged(nmpc, each, world) for each in (start, theta))
    return row(made.cost / initial.cost, *made.contacts, made.arrived, theta.tolist())


CONTROLLERS = {  # kind and number of obstacles, by part; others have ("diagonal", 4)
    "moving": [("diagonal", size) for size in sorted({*map(len, SCENARIOS.values())})],
    "model": [("diagonal", 4), ("model", 4)],
    "terminal": [(kind, 4) for kind in TERMINALS],
}


def compile_ahead(missing: Iterable[tuple[Condition, Any]]) -> None:
    """Compile each controller once, so that no row includes the time of a compilation."""
    for part in {one.part for one, _ in missing}:
        for each in CONTROLLERS.get(part, [("diagonal", 4)]):
            nmpc = controller(*each)
            nmpc.solve(np.array(paper.START), nmpc.problem.theta)

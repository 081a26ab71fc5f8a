"""Runs in worlds that move or change, with a wrong model, or with a richer terminal cost.

Each function takes the setting of an arm, a place, a number of episodes and a seed, and returns a
row of `worlds.py`. A policy is "init", "grid" (over theta_c), "CMA-ES" or "ES"; and where the model
can be learned "ES+model", "oracle" or "oracle+ES".
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis.encounters import judged
from nmpcrl.analysis.search import cma_es, grid
from nmpcrl.analysis.suite import Robot, entry, judge
from nmpcrl.claims.investigation import Condition, Row
from nmpcrl.learning import (
    Diverged,
    Exploration,
    Learner,
    Weights,
    deep_expected_sarsa,
    expected_sarsa,
    frozen,
    regularized_deep_expected_sarsa,
    train,
)
from nmpcrl.learning.rollout import Persistent, evaluate
from nmpcrl.learning.training import absurd
from nmpcrl.studies.shifts import Recent, changing, schedule
from nmpcrl.studies.worlds_problems import controller, oracle
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE, SCENARIOS
from nmpcrl.study.faults import FAULTS, Fault
from nmpcrl.study.moving import PREDICTORS, World, still

EVERY = 5  # episodes between two rollouts of a changing world
DRAWS = 5  # rollouts that judge theta where the body draws
THETA = np.array(paper.THETA_INIT)


def row(
    cost: float,
    inside: int = 0,
    collisions: int = 0,
    arrived: bool = False,
    series: Sequence[float] = (),
    events: Sequence[int] = (),
) -> Row:
    """A row; columns that a part does not measure have these values.

    Args:
        cost: of the last theta; of `gradient` the cosine.
        inside: states in an obstacle.
        collisions: times that the robot enters one.
        arrived: whether the robot is at the target at the end.
        series: costs, every `EVERY` episodes or by layout; or theta.
        events: episodes at whose end a chart fired.
    """
    return {
        "cost": float(cost), "inside": int(inside), "collisions": int(collisions),
        "arrived": bool(arrived), "series": [*series], "events": [*events],
    }  # fmt: skip


def explored(episodes: int, seed: int) -> Exploration:
    """The paper's noise on the action."""
    rng, shape = np.random.default_rng([seed, 0]), (episodes, paper.STEPS, 2)
    return Exploration.draw(rng, shape, deviation=paper.NOISE, decay_rate=paper.DECAY_RATE)


def learned(nmpc: Persistent, world: World, theta: Vector, episodes: int, seed: int) -> Vector:
    """Train ES in a world; the last theta with which a solver can be called."""
    weights = Weights(theta, np.full(theta.size, paper.W_INIT))
    how: dict[str, Any] = {"rng": np.random.default_rng([seed, 1]), **world.environment}
    try:
        learner = expected_sarsa(nmpc, paper.ALPHA)
        for step in train(learner, nmpc, weights, explored(episodes, seed), **how):
            weights = weights if absurd(step.weights) else step.weights
    except Diverged:
        pass  # the last usable theta is judged
    return weights.theta


def found(policy: str, nmpc: Persistent, world: World, episodes: int, seed: int) -> Vector:
    """The theta of a policy that begins with the nominal model."""
    draws = iter(np.random.SeedSequence([seed, 2]).generate_state(episodes).tolist())
    start = nmpc.nmpc.problem.theta  # type: ignore[union-attr]

    def cost(theta: Vector) -> float:
        return judged(nmpc, theta, world, next(draws)).cost

    if policy == "grid":
        return grid(cost, start, episodes)
    if policy == "CMA-ES":
        return cma_es(cost, start, episodes, seed)
    return start if policy == "init" else learned(nmpc, world, start, episodes, seed)


def moving(setting: tuple[str, str], place: str, episodes: int, seed: int) -> Row:
    """The row of a view and a policy among obstacles that move."""
    view, policy = setting
    motions = SCENARIOS[place]
    nmpc, world = controller(len(motions)), World(motions, PREDICTORS[view])
    made = judged(nmpc, found(policy, nmpc, world, episodes, seed), world)
    return row(made.cost, *made.counted, made.arrived)


def model(setting: tuple[str, str], place: str, episodes: int, seed: int) -> Row:
    """The row of a policy in a robot with a fault; the mean cost where the fault is random."""
    fault, policy = FAULTS[setting[0]], setting[1]
    nmpc = controller(learned_model=policy not in ("init", "grid", "ES"))
    world = World(still(JUDGE[place]), fault=fault)
    if policy.startswith("oracle"):
        theta = oracle(fault)
        if policy == "oracle+ES":
            theta = learned(nmpc, world, theta, episodes, seed)
    else:
        theta = found(policy, nmpc, world, episodes, seed)
    draws = DRAWS if fault.slip or any(fault.noise) else 1
    made = [judged(nmpc, theta, world, draw) for draw in range(draws)]
    return row(
        float(np.mean([each.cost for each in made])),
        sum(each.counted.inside for each in made),
        sum(each.counted.collisions for each in made),
        all(each.arrived for each in made),
        theta.tolist(),
    )


def sequence(rate: str, place: str, episodes: int) -> tuple[list[str], list[int]]:
    """The layouts of a sequence, and the index of the layout of each episode."""
    rng = np.random.default_rng([25, int(place[1:])])
    names = [str(name) for name in rng.permutation([*JUDGE])]
    order = schedule(rate, episodes, rng)
    return names[: order[-1] + 1], order


def begun_anew(rate: str, name: str, place: str, episodes: int, seed: int) -> Row:
    """An entry of the suite in the last layout of a sequence, with the remaining episodes."""
    names, order = sequence(rate, place, episodes)
    alone = judge(entry(name), names[-1], seed, episodes - order.index(order[-1]))
    return row(alone.cost / alone.initial, arrived=alone.arrived)


def shifting(rate: str, setting: tuple[str, ...], place: str, episodes: int, seed: int) -> Row:
    """A learner where the layout changes; costs are shares of theta_init's in the same layout."""
    if setting[0] == "remedy":
        return begun_anew(rate, setting[1], place, episodes, seed)
    kind, knows, reaction = setting
    names, order = sequence(rate, place, episodes)
    layouts, nmpc = [JUDGE[name] for name in names], controller()
    initial = [judged(nmpc, THETA, World(still(each))).cost for each in layouts]
    make = _maker(kind, nmpc, seed, recent=reaction == "recent")
    reacts = {"knows": knows, "reaction": "plain" if reaction == "recent" else reaction}
    series, events, arrived = [], [], False
    explore = explored(episodes, seed)
    for e, each in enumerate(changing(nmpc, layouts, order, make, explore, **reacts)):
        events += [e] if each.alarm else []
        if e % EVERY == EVERY - 1 or e == episodes - 1:
            world = World(still(layouts[each.layout]), seen=still(layouts[each.seen]))
            made = judged(nmpc, each.theta, world)
            series.append(made.cost / initial[each.layout])
            arrived = made.arrived
    return row(series[-1], arrived=arrived, series=series, events=events)


def _maker(kind: str, nmpc: Persistent, seed: int, *, recent: bool) -> Callable[[float], Learner]:
    """A function that makes a learner, given a factor of alpha."""
    plain: dict[str, Callable[[float], Learner]] = {
        "ES": lambda factor: expected_sarsa(nmpc, factor * paper.ALPHA),
        "frozen": lambda _: frozen(nmpc),
    }
    if kind in plain:
        return plain[kind]
    from nmpcrl.learning.network import QNetwork  # and torch, which takes seconds

    bits = np.random.PCG64([seed, 3])
    rng = Recent(bits) if recent else np.random.Generator(bits)
    size, learner = {
        "DES": (5, deep_expected_sarsa), "RDES": (5 + THETA.size, regularized_deep_expected_sarsa),
    }[kind]  # fmt: skip
    network = QNetwork(size, rng, paper.ZETA, paper.BATCH, paper.HIDDEN)
    return lambda factor: learner(nmpc, network, factor * paper.ALPHA)


def carry(name: str, place: str, episodes: int, seed: int) -> Row:
    """The costs of the theta of one layout in all of `JUDGE`, by the paper's own controller."""
    theta = entry(name)(Robot(JUDGE[place], episodes, seed))
    assert not callable(theta)  # no policy is carried
    costs = [evaluate(paper.nmpc(each), theta, paper.STEPS).cost for each in JUDGE.values()]
    return row(costs[[*JUDGE].index(place)], series=costs)


def gradient(deviation: float, place: str, episodes: int, seed: int) -> Row:
    """The cosine of the summed steps of ES at theta_init with noise in the state and without."""
    sums = []
    for each in (0.0, deviation):
        world = World(still(JUDGE[place]), fault=Fault(noise=(each,) * 3))
        nmpc, summed = controller(), np.zeros(THETA.size)
        weights = Weights(THETA, np.zeros(THETA.size))
        # the published draws: those of `explored`, since [seed, 0] is the stream of seed
        how: dict[str, Any] = {"rng": np.random.default_rng(seed), **world.environment}
        explore = explored(episodes, seed)
        for step in train(expected_sarsa(nmpc, 0.0), nmpc, weights, explore, **how):
            if step.update and step.solution and step.update.delta is not None:
                summed += step.update.delta * step.solution.features
        sums.append(summed)
    exact, noisy = sums
    lengths = np.linalg.norm(exact), np.linalg.norm(noisy)
    return row(exact @ noisy / np.prod(lengths), series=[float(lengths[1] / lengths[0])])


def terminal(kind: str, place: str, episodes: int, seed: int) -> Row:
    """ES with a terminal cost, in the paper's world; costs are shares of theta_init's."""
    nmpc, world = controller(terminal=kind), World(still(JUDGE[place]))
    start = nmpc.nmpc.problem.theta  # type: ignore[union-attr]
    theta = learned(nmpc, world, start, episodes, seed)
    initial, made = (judged(nmpc, each, world) for each in (start, theta))
    return row(made.cost / initial.cost, *made.counted, made.arrived, theta.tolist())


def compile_ahead(missing: Iterable[tuple[Condition, Any]]) -> None:
    """Compile each controller once, so that no row includes the time of a compilation."""
    kinds: dict[tuple[int, bool, str], None] = {}
    for one, setting in missing:
        size = len(SCENARIOS[one.place]) if one.part == "moving" else 4
        richer = one.part == "model" and setting[1] not in ("init", "grid", "ES")
        kinds[size, richer, setting if one.part == "terminal" else ""] = None
    for size, learned_model, kind in kinds:
        nmpc = controller(size, learned_model=learned_model, **({"terminal": kind} if kind else {}))
        nmpc.solve(np.array(paper.START), nmpc.nmpc.problem.theta)  # type: ignore[union-attr]

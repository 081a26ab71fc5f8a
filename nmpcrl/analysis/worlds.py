"""What is run in worlds that move, change, or are not the model, and how it is kept.

`run` carries out one `Wanted`, whose entry is "PART: ARM". The arms of the parts are

- moving: a predictor and a policy, "frozen ES", in a scenario;
- model: a fault and a policy, "drift ES+model", in a layout;
- once, every 50, random: learner, what is known and the reaction, "RDES told recent"; or
  "remedy ENTRY", the entry begun anew after the change; in a sequence of layouts, S01 and so on;
- carry: an entry, whose theta of a layout is judged in all of `JUDGE`;
- gradient: the deviation of the measured state, in a layout;
- terminal: a terminal cost of `study.world.TERMINALS`, learned by ES in a layout.

A policy is "init", "grid" over theta_c, "CMA-ES", "ES", and where the model can be learned
"ES+model", "oracle" and "oracle+ES".
"""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis import judgements
from nmpcrl.analysis.direct_search import cma_es, grid
from nmpcrl.analysis.encounters import judged
from nmpcrl.analysis.entries import entry_with
from nmpcrl.analysis.interaction import Robot
from nmpcrl.analysis.kept import Kept, Wanted
from nmpcrl.analysis.leaderboard import judge_once, scenario_seed
from nmpcrl.analysis.shifts import RATES, Recent, changing, schedule
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
from nmpcrl.study import paper
from nmpcrl.study.faults import FAULTS, Fault
from nmpcrl.study.motions import PREDICTORS, still
from nmpcrl.study.population import JUDGE
from nmpcrl.study.scenarios import load
from nmpcrl.study.world import World, controller, oracle

EPOCH = 1  # raised by hand where an edit of this changes a number
EVERY = 5  # episodes between two rollouts of a changing world
DRAWS = 5  # rollouts that judge theta where the body draws
THETA = np.array(paper.THETA_INIT)


@dataclass(frozen=True)
class Ran:
    """What one run came to; what its part does not have is left as it is."""

    cost: float = np.nan  # of the last theta; of `gradient` the cosine
    inside: int = 0  # states in an obstacle
    collisions: int = 0
    arrived: bool = False
    series: list[float] = field(default_factory=list)  # costs: every `EVERY` episodes, or by layout
    events: list[int] = field(default_factory=list)  # episodes at whose end a chart fired
    seconds: float = 0.0  # of processor time


def run(one: Wanted) -> Ran:
    """Carry out one."""
    part, _, arm = one.entry.partition(": ")
    began = time.process_time()
    ran = JOBS[part](arm, one)
    return replace(ran, seconds=time.process_time() - began)


seed_of = scenario_seed  # of any place, by its name


def explored(episodes: int, seed: int) -> Exploration:
    """The paper's noise."""
    rng, shape = np.random.default_rng([seed, 0]), (episodes, paper.STEPS, 2)
    return Exploration.draw(rng, shape, deviation=paper.NOISE, decay_rate=paper.DECAY_RATE)


def learned(nmpc: Persistent, world: World, theta: Vector, episodes: int, seed: int) -> Vector:
    """What ES makes of theta in a world; the last with which a solver can be called."""
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


def moving(arm: str, one: Wanted) -> Ran:
    """A policy among obstacles that move."""
    view, policy = arm.split()
    motions = load()[one.layout]
    nmpc, world = controller(len(motions)), World(motions, PREDICTORS[view])
    made = judged(nmpc, found(policy, nmpc, world, one.budget, one.seed), world)
    return Ran(made.cost, *made.counted, made.arrived)


def model(arm: str, one: Wanted) -> Ran:
    """A policy in a body that is not the model; mean cost where the body draws."""
    name, policy = arm.split()
    fault: Fault = FAULTS[name]
    nmpc = controller(learned_model=policy not in ("init", "grid", "ES"))
    world = World(still(JUDGE[one.layout]), fault=fault)
    if policy.startswith("oracle"):
        theta = oracle(fault)
        if policy == "oracle+ES":
            theta = learned(nmpc, world, theta, one.budget, one.seed)
    else:
        theta = found(policy, nmpc, world, one.budget, one.seed)
    draws = DRAWS if fault.slip or any(fault.noise) else 1
    made = [judged(nmpc, theta, world, seed) for seed in range(draws)]
    return Ran(
        float(np.mean([each.cost for each in made])),
        sum(each.counted.inside for each in made),
        sum(each.counted.collisions for each in made),
        all(each.arrived for each in made),
        series=theta.tolist(),
    )


def sequence(rate: str, place: str, episodes: int) -> tuple[list[str], list[int]]:
    """The layouts of a sequence, and the number of that of each episode."""
    rng = np.random.default_rng([25, int(place[1:])])
    names = [str(name) for name in rng.permutation([*JUDGE])]
    order = schedule(rate, episodes, rng)
    return names[: order[-1] + 1], order


def shifting(arm: str, one: Wanted) -> Ran:
    """A learner where the layout changes; costs are shares of theta_init's in the same layout."""
    rate = one.entry.partition(": ")[0]
    names, order = sequence(rate, one.layout, one.budget)
    layouts, nmpc = [JUDGE[name] for name in names], controller()
    if arm.startswith("remedy "):
        entry, left = arm.partition(" ")[2], one.budget - order.index(order[-1])
        alone = judge_once(entry, layouts[-1], left, one.seed)
        return Ran(alone.cost / alone.initial, arrived=alone.arrived)
    kind, knows, reaction = arm.split()
    initial = [judged(nmpc, THETA, World(still(each))).cost for each in layouts]
    make = _maker(kind, nmpc, one.seed, recent=reaction == "recent")
    reacts = {"knows": knows, "reaction": "plain" if reaction == "recent" else reaction}
    series, events, arrived = [], [], False
    explore = explored(one.budget, one.seed)
    for e, each in enumerate(changing(nmpc, layouts, order, make, explore, **reacts)):
        events += [e] if each.alarm else []
        if e % EVERY == EVERY - 1 or e == one.budget - 1:
            world = World(still(layouts[each.layout]), seen=still(layouts[each.seen]))
            made = judged(nmpc, each.theta, world)
            series.append(made.cost / initial[each.layout])
            arrived = made.arrived
    return Ran(series[-1], arrived=arrived, series=series, events=events)


def _maker(kind: str, nmpc: Persistent, seed: int, *, recent: bool) -> Callable[[float], Learner]:
    """(factor of alpha) -> learner."""
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


def carry(arm: str, one: Wanted) -> Ran:
    """The costs of one layout's theta in all of `JUDGE`, by the paper's own controller."""
    theta = entry_with(arm)(Robot(JUDGE[one.layout], one.budget, one.seed))
    assert not callable(theta)  # no policy is carried
    costs = [evaluate(paper.nmpc(each), theta, paper.STEPS).cost for each in JUDGE.values()]
    return Ran(costs[[*JUDGE].index(one.layout)], series=costs)


def gradient(arm: str, one: Wanted) -> Ran:
    """The cosine of the summed steps of ES at theta_init with noise in the state and without."""
    sums = []
    for deviation in (0.0, float(arm)):
        world = World(still(JUDGE[one.layout]), fault=Fault(noise=(deviation,) * 3))
        nmpc, summed = controller(), np.zeros(THETA.size)
        weights = Weights(THETA, np.zeros(THETA.size))
        # the published draws: those of `explored`, since [seed, 0] is the stream of seed
        how: dict[str, Any] = {"rng": np.random.default_rng(one.seed), **world.environment}
        explore = explored(one.budget, one.seed)
        for step in train(expected_sarsa(nmpc, 0.0), nmpc, weights, explore, **how):
            if step.update and step.solution and step.update.delta is not None:
                summed += step.update.delta * step.solution.features
        sums.append(summed)
    exact, noisy = sums
    lengths = np.linalg.norm(exact), np.linalg.norm(noisy)
    return Ran(float(exact @ noisy / np.prod(lengths)), series=[float(lengths[1] / lengths[0])])


def terminal(arm: str, one: Wanted) -> Ran:
    """ES with a terminal cost, in the paper's world; costs are shares of theta_init's."""
    nmpc, world = controller(terminal=arm), World(still(JUDGE[one.layout]))
    start = nmpc.nmpc.problem.theta  # type: ignore[union-attr]
    theta = learned(nmpc, world, start, one.budget, one.seed)
    initial, made = (judged(nmpc, each, world) for each in (start, theta))
    return Ran(made.cost / initial.cost, *made.counted, made.arrived, series=theta.tolist())


JOBS: dict[str, Callable[[str, Wanted], Ran]] = {
    "moving": moving, "model": model, "carry": carry, "gradient": gradient, "terminal": terminal,
    **dict.fromkeys(RATES, shifting),
}  # fmt: skip


def depends_on() -> dict[str, Any]:
    """All that the numbers depend on, beside what is wanted."""
    return {**judgements.depends_on(), "worlds": EPOCH}


def compile_ahead(missing: Iterable[Wanted]) -> None:
    """Compile what the runs call, so that no processor time of that is counted."""
    kinds: dict[tuple[int, bool, str], None] = {}  # each once: a controller takes a while to make
    for one in missing:
        part, _, arm = one.entry.partition(": ")
        size = len(load()[one.layout]) if part == "moving" else 4
        kinds[size, "ES+" in arm or "oracle" in arm, arm if part == "terminal" else ""] = None
    for size, learned_model, richer in kinds:
        kind = {"terminal": richer} if richer else {}
        nmpc = controller(size, learned_model=learned_model, **kind)
        nmpc.solve(np.array(paper.START), nmpc.nmpc.problem.theta)  # type: ignore[union-attr]


KEPT: Kept[Ran] = Kept("worlds", Ran, lambda: depends_on())

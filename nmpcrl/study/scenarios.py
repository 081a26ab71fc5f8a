"""Forty scenarios with obstacles that move, drawn and screened before anything was run in them.

Number, speed and spread of a scenario are drawn, then the kind and place of each obstacle; they may
pass through each other. A scenario may be used if

1. a robot that sees no obstacle gets into one;
2. the start is clear in the first second, and the target in the last five: Upsilon = 0;
3. without noise, the NMPC with theta_init that knows the motion is at the target at the end.

They are the first that a seeded sampler drew and the screening accepted. The third criterion leaves
out what even the best informed of the three predictors cannot do, as it does in `layouts`.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np

from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import paper
from nmpcrl.study.layouts import AREA, ARRIVED
from nmpcrl.study.motions import KINDS, Motion, centres, draw, still
from nmpcrl.study.storage.atomic import write_json
from nmpcrl.study.world import CLEARANCE, TASK, World, controller, inside

SEED, COUNT = 25, 40
NUMBERS = (3, 6)  # of obstacles, least and most
SPEEDS = (0.1, 0.5)  # [m/s], of the mean; the robot does 0.6
SPREADS = (0.0, 0.2)  # [m/s]
AT_START, AT_TARGET = np.arange(6), np.arange(paper.STEPS - 25, paper.STEPS)  # steps
PLACE = Path(__file__).with_name("scenarios.json")

Scenario = tuple[Motion, ...]


def sampler(seed: int = SEED) -> Iterator[Scenario]:
    """Scenarios without end."""
    rng = np.random.default_rng(seed)
    while True:
        number = int(rng.integers(NUMBERS[0], NUMBERS[1] + 1))
        speed, spread = (round(rng.uniform(*ends), 3) for ends in (SPEEDS, SPREADS))
        (left, right), (bottom, top) = AREA
        places = rng.uniform((left, bottom), (right, top), (number, 2)).round(1).tolist()
        yield tuple(
            draw(rng, str(rng.choice([*KINDS])), (x, y), speed=speed, spread=spread)
            for x, y in places
        )


def accepted(scenario: Scenario) -> bool:
    """Whether it meets the criteria; nothing is trained in it."""
    for point, steps in ((paper.START, AT_START), (paper.TARGET, AT_TARGET)):
        away = np.linalg.norm(centres(scenario, steps) - point[:2], axis=2)
        if away.min() < CLEARANCE / 2 * np.sqrt(1 + TASK.margin):
            return False
    theta, nmpc = np.array(paper.THETA_INIT), controller(len(scenario))
    nothing = still([(99.0, 99.0)] * len(scenario))
    blind, knowing = World(scenario, seen=nothing), World(scenario)
    if not inside(evaluate(nmpc, theta, paper.STEPS, **blind.environment).states, scenario).any():
        return False
    rollout = evaluate(nmpc, theta, paper.STEPS, **knowing.environment)
    return not rollout.failure and TASK.distance(rollout.states[-1]) <= ARRIVED


def drawn() -> Iterator[Scenario]:
    """The accepted ones in the order of the draws, without end."""
    return filter(accepted, sampler())


def write() -> Path:
    """Draw them again, and keep them with the package."""
    found = [
        [[kind, asdict(one)] for one in scenario for kind in KINDS if type(one) is KINDS[kind]]  # type: ignore[call-overload]
        for scenario in islice(drawn(), COUNT)
    ]
    write_json(PLACE, {f"M{i:02}": one for i, one in enumerate(found, start=1)})
    return PLACE


@cache
def load() -> dict[str, Scenario]:
    """The scenarios that `write` kept, by name: M01 to M40."""
    kept = json.loads(PLACE.read_text("utf-8"))
    return {name: tuple(_motion(*one) for one in scenario) for name, scenario in kept.items()}


def _motion(kind: str, fields: dict[str, float | list[float]]) -> Motion:
    plain = {key: tuple(one) if isinstance(one, list) else one for key, one in fields.items()}
    return KINDS[kind](**plain)

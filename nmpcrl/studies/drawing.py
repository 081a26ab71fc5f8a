"""The samplers of the layouts and of the scenarios, which were drawn before anything was run.

**Named layouts** B to F: the first that a seeded sampler drew and `layouts.screen` accepted, until
there were three open and three closing ones. **Population**: the first 180 that another seed drew
and `screen` accepted, whatever their kind, none of them a named one.

**Scenarios** with obstacles that move: number, speed and spread of a scenario are drawn, then the
kind and place of each obstacle; obstacles may pass through each other. A scenario may be used if

1. a robot that sees no obstacle gets into one;
2. the start is clear in the first second, and the target in the last five: Upsilon = 0;
3. without noise, the NMPC with theta_init that knows the motion is at the target at the end.

The third criterion, like that of the layouts, leaves out what the best informed of the three
predictors cannot do. Forty are used: the first that were drawn and accepted.
"""

from collections.abc import Iterator
from dataclasses import asdict
from itertools import combinations, islice
from pathlib import Path
from typing import Any

import numpy as np

from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import paper
from nmpcrl.study.drawn import FOLDER, Scenario
from nmpcrl.study.files import write_json
from nmpcrl.study.geometry import Centres
from nmpcrl.study.layouts import ARRIVED, screen
from nmpcrl.study.moving import (
    CLEARANCE,
    KINDS,
    TASK,
    Motion,
    Point,
    Polynomial,
    Sinusoidal,
    Straight,
    World,
    centres,
    controller,
    inside,
    still,
)

AREA = ((-1.5, 7.5), (-1.5, 5.0))  # of the drawn centres, x and y [m]
APART = 2.2  # least distance of two drawn centres [m]: no disc touches another
GRID = 0.1  # drawn centres are multiples of it [m]
NAMED_SEED, POPULATION_SEED, SCENARIO_SEED = 0, 24, 25
NAMED = {"open": 3, "closing": 3}  # named layouts of each kind, A included
SIZES = {"T": 60, "J": 120}  # layouts of the population, by the first letter of their names

COUNT = 40  # scenarios
NUMBERS = (3, 6)  # of obstacles, least and most
SPEEDS = (0.1, 0.5)  # [m/s], of the mean; the robot does 0.6
SPREADS = (0.0, 0.2)  # [m/s]
AT_START, AT_TARGET = np.arange(6), np.arange(paper.STEPS - 25, paper.STEPS)  # steps
TURN = 20.0  # [s]: an episode has 26
ORDER = 3  # of the drawn polynomials, at most
STEEPEST = 0.5  # of the drawn coefficients


def layout_sampler(seed: int) -> Iterator[Centres]:
    """An endless sequence of four centres each, `APART` from each other and on a grid."""
    rng = np.random.default_rng(seed)
    (left, right), (bottom, top) = AREA
    while True:
        drawn = rng.uniform((left, bottom), (right, top), (4, 2))
        rounded = np.round(np.round(drawn / GRID) * GRID, 6)
        pairs = combinations(rounded, 2)
        if all(np.linalg.norm(one - other) >= APART for one, other in pairs):
            yield tuple((float(x), float(y)) for x, y in sorted(rounded.tolist()))


def named() -> dict[str, Centres]:
    """The named layouts after A; `paper.LAYOUTS` begins with A and these."""
    wanted = dict(NAMED)
    wanted[screen(paper.LAYOUTS["A"]).kind] -= 1
    found: dict[str, Centres] = {}
    drawn = layout_sampler(NAMED_SEED)
    while any(wanted.values()):
        layout = next(drawn)
        screening = screen(layout)
        if screening.passed and wanted[screening.kind]:
            wanted[screening.kind] -= 1
            found[chr(ord("B") + len(found))] = layout
    return found


def population() -> Iterator[Centres]:
    """The endless population of layouts, in the order of the draws; each takes 0.2 s."""
    known = set(paper.LAYOUTS.values())
    for layout in layout_sampler(POPULATION_SEED):
        if layout not in known and screen(layout).passed:
            known.add(layout)
            yield layout


def names() -> tuple[str, ...]:
    """The names of the population's layouts: T01 to T60, J001 to J120."""
    return tuple(
        f"{letter}{i:0{len(str(n))}}" for letter, n in SIZES.items() for i in range(1, n + 1)
    )


def draw(
    rng: np.random.Generator, kind: str, place: Point, *, speed: float, spread: float
) -> Motion:
    """Draw a motion about a place.

    Args:
        rng: draws speed, direction, and the rest.
        kind: one of `KINDS`.
        place: of a straight motion halfway through an episode, and the centre of others [m].
        speed: mean of its normal law [m/s]; a negative draw counts by its size.
        spread: standard deviation of that law [m/s].
    """
    v, angle = abs(rng.normal(speed, spread)), rng.uniform(0, 2 * np.pi)
    direction = np.array([np.cos(angle), np.sin(angle)])
    phase = rng.uniform(-1, 1)
    if kind == "straight":
        at_start = np.asarray(place) - TURN / 2 * v * direction
        return Straight(_rounded(at_start), _rounded(v * direction))
    if kind == "sinusoidal":
        reach = v * TURN / 4 * direction  # so that v is the mean speed
        return Sinusoidal(place, _rounded(reach), TURN, round(np.pi * phase, 3))
    p = rng.uniform(-STEEPEST, STEEPEST, rng.integers(1, ORDER + 1) + 1)
    axis = max(v * TURN / 4, 0.5) * direction
    return Polynomial(place, _rounded(axis), _rounded(p), round(v, 3), round(phase, 3))


def _rounded(values: Any) -> Any:
    """Numbers as the file has them: three digits behind the point."""
    return tuple(round(float(one), 3) for one in values)


def scenario_sampler(seed: int = SCENARIO_SEED) -> Iterator[Scenario]:
    """An endless sequence of drawn scenarios."""
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
    """Whether a scenario meets the three criteria."""
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


def write(folder: Path = FOLDER) -> None:
    """Draw the population and the scenarios again, and write their files."""
    write_json(folder / "population.json", dict(zip(names(), population(), strict=False)))
    kinds: dict[type[Any], str] = {KINDS[kind]: kind for kind in KINDS}  # type: ignore[misc]
    found = [
        [[kinds[type(one)], asdict(one)] for one in scenario]  # type: ignore[call-overload]
        for scenario in islice(filter(accepted, scenario_sampler()), COUNT)
    ]
    write_json(folder / "scenarios.json", {f"M{i:02}": one for i, one in enumerate(found, 1)})

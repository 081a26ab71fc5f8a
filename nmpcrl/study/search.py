"""The best theta that a derivative-free search finds: how far from it does learning end?

CMA-ES (Hansen 2016) minimises the noise-free cost that learning is judged by, which no learner
ever sees, within a stated budget of drives. It is no learner: it needs whole drives without noise.
"""

import json
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from itertools import repeat
from pathlib import Path
from typing import Any

import cma
import numpy as np

from nmpcrl import Vector
from nmpcrl.study import paper
from nmpcrl.study.store import SPAWN, digest, folder, versions
from nmpcrl.study.training import Persistent, evaluate

BUDGET = 3000  # drives without noise that a search may make
SPREAD = 0.3  # of the first drives, in units of `SCALE`
SCALE = np.array([1, 1, 0.1, 0.1, 0.1, 1, 1, 0.1, 0.3])  # of each component of theta
LOWER, UPPER = np.r_[np.zeros(8), -0.5], np.r_[np.full(8, 10.0), 1.0]  # where theta is looked for
FAILED = 1e6  # stands for the cost of a drive on which a solve failed
SOURCES = ("control", "study/paper.py", "study/training.py", "study/search.py")


@dataclass(frozen=True)
class Found:
    """Where a search ended."""

    layout: str
    seed: int
    budget: int
    initial: float  # noise-free cost of theta_init
    cost: float  # noise-free cost of theta
    theta: tuple[float, ...]
    drives: tuple[int, ...]  # after so many drives ...
    best: tuple[float, ...]  # ... this was the lowest cost so far


def search(layout: str, seed: int = 0, budget: int = BUDGET) -> Found:
    """Look for the theta of least noise-free cost in a layout, from theta_init."""
    controller = Persistent(paper.nmpc(layout))

    def cost(scaled: Vector) -> float:
        found = evaluate(controller, np.asarray(scaled) * SCALE, paper.STEPS).cost
        return found if np.isfinite(found) else FAILED

    start = np.array(paper.THETA_INIT) / SCALE
    options = {
        "bounds": [list(LOWER / SCALE), list(UPPER / SCALE)],
        "maxfevals": budget,
        "seed": seed + 1,  # 0 would mean the clock
        "verbose": -9,
    }
    strategy = cma.CMAEvolutionStrategy(start, SPREAD, options)
    initial = cost(start)
    drives, best = [1], [initial]
    theta, made = start, 1
    while not strategy.stop() and made < budget:
        asked = strategy.ask()
        costs = [cost(one) for one in asked]
        strategy.tell(asked, costs)
        made += len(asked)
        if min(costs) < best[-1]:
            theta = asked[int(np.argmin(costs))]
        drives.append(made)
        best.append(min(best[-1], *costs))
    found = tuple(float(value) for value in np.asarray(theta) * SCALE)
    return Found(layout, seed, budget, initial, best[-1], found, tuple(drives), tuple(best))


def fetch(layouts: Iterable[str], seeds: Iterable[int] = (0,), budget: int = BUDGET) -> list[Found]:
    """`search` in each layout with each seed: read what is stored, search for the rest."""
    wanted = [(layout, seed) for layout in layouts for seed in seeds]
    place = folder() / "search.json"
    key = f"{digest(SOURCES)} {sorted(versions().items())} {budget}"
    kept = _kept(place, key)
    missing = [pair for pair in wanted if pair not in kept]
    if missing:
        with ProcessPoolExecutor(mp_context=SPAWN) as pool:
            found = pool.map(search, *zip(*missing, strict=True), repeat(budget))
            kept |= dict(zip(missing, found, strict=True))
        place.parent.mkdir(parents=True, exist_ok=True)
        half = place.with_suffix(".half")
        half.write_text(json.dumps({"key": key, "found": [asdict(one) for one in kept.values()]}))
        half.replace(place)
    return [kept[pair] for pair in wanted]


def _kept(place: Path, key: str) -> dict[tuple[str, int], Found]:
    """The searches in the file, if they are of this code, these versions and this budget."""
    try:
        kept = json.loads(place.read_text())
        if kept["key"] != key:
            return {}
        found = [Found(**_tuples(one)) for one in kept["found"]]
    except FileNotFoundError:
        return {}
    except (ValueError, LookupError, TypeError) as error:
        print(f"{place} is damaged ({error}) and is searched again", file=sys.stderr)
        return {}
    return {(one.layout, one.seed): one for one in found}


def _tuples(fields: dict[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}

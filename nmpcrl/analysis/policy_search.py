"""The best theta that a derivative-free search finds: how far from it does learning end?

CMA-ES (Hansen 2016) minimises the noise-free cost that learning is judged by, which no learner
ever sees, within a stated budget of rollouts. It is no learner: it needs whole rollouts without
noise. What it finds bounds the family's best from one side only; a longer search may find better.
"""

import json
import sys
from bisect import bisect
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.learning.rollout import Persistent, evaluate
from nmpcrl.study import paper, store
from nmpcrl.study.parameters import LARGEST_SEED, Allowed, one_of, whole
from nmpcrl.study.provenance import epochs, versions
from nmpcrl.study.storage import place
from nmpcrl.study.storage.atomic import write_json
from nmpcrl.study.storage.executor import execute

BUDGET = 2000  # rollouts without noise that a search may make
LEAST = 40  # rollouts: the first one and some generations
CHECK = 200  # rollouts of a published search that a build makes again
MOST = 100_000  # long before which a search has converged and ends by itself
SPREAD = 0.3  # of the first rollouts, in units of `SCALE`
SCALE = np.array([1, 1, 0.1, 0.1, 0.1, 1, 1, 0.1, 0.3])  # of each component of theta
LOWER, UPPER = np.r_[np.zeros(8), -0.5], np.r_[np.full(8, 10.0), 1.0]  # where theta is looked for
ALLOWED: Mapping[str, Allowed] = {  # by field of `Search`
    "layout": one_of(paper.LAYOUTS),
    "seed": whole(0, LARGEST_SEED - 1),  # one more is CMA-ES's
    "budget": whole(LEAST, MOST),
}
FAILED = 1e6  # stands for the cost of a rollout on which a solve failed


@dataclass(frozen=True)
class Search:
    """One search; the same one finds the same theta.

    Raises:
        ParameterError: a field is not what it may be.
    """

    layout: str = "A"
    seed: int = 0  # of the candidates that are drawn
    budget: int = BUDGET

    def __post_init__(self) -> None:
        for name, allowed in ALLOWED.items():
            object.__setattr__(self, name, allowed.check(name, getattr(self, name)))


@dataclass(frozen=True)
class Found:
    """Where a search ended, and each improvement on the way; the first rollout is theta_init's."""

    theta: tuple[float, ...]
    made: int  # rollouts in all
    rollouts: tuple[int, ...]  # at this one, from 1 on, ...
    best: tuple[float, ...]  # ... the lowest cost so far fell to this

    @property
    def initial(self) -> float:
        """Noise-free cost of theta_init."""
        return self.best[0]

    @property
    def cost(self) -> float:
        """Noise-free cost of theta."""
        return self.best[-1]

    @property
    def gain(self) -> float:
        """Share of theta_init's cost that theta saves."""
        return 1 - self.cost / self.initial

    def after(self, rollouts: int) -> float:
        """The lowest cost of so many rollouts: that of a search with a smaller budget."""
        return self.best[bisect(self.rollouts, rollouts) - 1]


def search(wanted: Search) -> Found:
    """Look for the theta of least noise-free cost in a layout, from theta_init."""
    import cma  # takes a second, and who reads a search needs none

    controller = Persistent(paper.nmpc(wanted.layout))

    def cost(scaled: Vector) -> float:
        return evaluate(controller, np.asarray(scaled) * SCALE, paper.STEPS).cost

    start = np.array(paper.THETA_INIT) / SCALE
    options = {
        "bounds": [LOWER / SCALE, UPPER / SCALE],
        "seed": wanted.seed + 1,  # 0 would mean the clock
        "verbose": -9,
    }
    strategy = cma.CMAEvolutionStrategy(start, SPREAD, options)
    tried, costs = [start], [cost(start)]
    while not strategy.stop() and len(costs) + strategy.popsize <= wanted.budget:
        asked = strategy.ask()
        found = [cost(one) for one in asked]
        strategy.tell(asked, [min(one, FAILED) for one in found])
        tried += asked
        costs += found
    return _found(np.array(tried) * SCALE, np.array(costs))


def to_make(wanted: Iterable[Search], known: Mapping[Search, Found]) -> tuple[Search, ...]:
    """The searches that are not known, and of the others the beginning, as a check."""
    return tuple(replace(one, budget=CHECK) if one in known else one for one in wanted)


def search_all(
    searches: Iterable[Search], *, workers: int | None = None, progress: bool = True
) -> dict[Search, Found]:
    """`search` for many: read what is stored, search for the rest in parallel, and store it.

    Args:
        searches: those wanted.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar.

    Raises:
        StoreError: searches are missing and could not be stored; nothing is searched.
        Exception: what the first search raised that failed; the others are stored.
    """
    wanted = tuple(dict.fromkeys(searches))
    kept = _kept()
    missing = [one for one in wanted if one not in kept]
    if missing:
        store.check_folder()

    def keep(one: Search, found: Found) -> str:
        kept[one] = found
        _keep(kept)
        return f"layout {one.layout}: cost {found.cost:.0f}"

    failures = execute(
        {one: partial(search, one) for one in missing},
        keep,
        workers=workers,
        progress=progress,
        unit="search",
    )
    for error in failures.values():
        raise error
    return {one: kept[one] for one in wanted}


def _found(tried: Vector, costs: Vector) -> Found:
    """The result of rollouts with these thetas, shape (rollouts, d), and their costs."""
    lowest = np.minimum.accumulate(costs)
    fell = np.flatnonzero(np.r_[True, lowest[1:] < lowest[:-1]])
    return Found(
        theta=tuple(tried[fell[-1]].tolist()),
        made=len(costs),
        rollouts=tuple((fell + 1).tolist()),
        best=tuple(lowest[fell].tolist()),
    )


def _place() -> Path:
    return store.folder() / "policy_search.json"


def _depends_on() -> dict[str, Any]:
    """All that the numbers depend on."""
    return {"epochs": epochs(), **versions(), "cma": version("cma")}


def _kept() -> dict[Search, Found]:
    """The searches in the file, if they are of this code and these versions."""
    path = _place()
    try:
        kept = json.loads(path.read_text("utf-8"))
        if kept["key"] != _depends_on():
            return {}
        return from_lists(kept["searches"])
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, LookupError, TypeError) as error:
        print(f"{path} is damaged ({error}) and is searched again", file=sys.stderr)
        return {}


def _keep(found: Mapping[Search, Found]) -> None:
    content = {"key": _depends_on(), "searches": as_lists(found)}
    place.keep(_place(), lambda path: write_json(path, content))


def as_lists(found: Mapping[Search, Found]) -> list[list[dict[str, Any]]]:
    """Searches as JSON has them."""
    return [[asdict(one), asdict(result)] for one, result in found.items()]


def from_lists(kept: Iterable[tuple[dict[str, Any], dict[str, Any]]]) -> dict[Search, Found]:
    """What `as_lists` was given."""
    return {Search(**one): Found(**_tuples(found)) for one, found in kept}


def _tuples(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {name: tuple(v) if isinstance(v, list) else v for name, v in fields.items()}

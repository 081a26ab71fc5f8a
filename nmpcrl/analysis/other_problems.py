"""What the chapter "Other problems" rests on: runs of 50 seeds, kept as one sealed file.

`nmpcrl bench --problems` makes it, in some ten minutes; `book/published` has a copy.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis import solver_spread, wrong_model
from nmpcrl.analysis.solver_spread import Spread
from nmpcrl.analysis.wrong_model import ARMS, Course
from nmpcrl.study import sealed, store
from nmpcrl.study.parameters import Refusal
from nmpcrl.study.problems import grid
from nmpcrl.study.problems import gros_zanon as gz
from nmpcrl.study.storage.executor import execute
from nmpcrl.study.storage.place import check_folder

FILE = "other_problems.json"
POINTS, INPUTS = 161, 121  # of the grid on which the best policy is found
BUDGET, SPREAD = 400, 0.05  # thetas that the search tries, and how far it begins to look
SEARCH_EPISODES, SEARCH_SEED = 10, 2 * 10**6  # of the cost that it sees


class DamagedProblems(Refusal):
    """A file is not what `make` wrote."""


@dataclass(frozen=True)
class References:
    """Mean costs of a step that the learners are compared with."""

    wrong: float  # of the plan as it begins
    informed: float  # of the plan with the plant's A, B, bounds and mean disturbance
    best_theta: float  # of the theta that CMA-ES finds
    theta: tuple[float, ...]  # that one
    best_policy: float  # of the policy of dynamic programming


@dataclass(frozen=True)
class OtherProblems:
    """All runs."""

    courses: tuple[Course, ...]
    spreads: tuple[Spread, ...]
    references: References
    about: Mapping[str, Any]

    def tests(self) -> dict[str, Vector]:
        """The last cost of each seed, by arm."""
        return {arm: np.array([one.test for one in self.courses if one.arm == arm]) for arm in ARMS}

    def predictions(self) -> dict[str, tuple[str, bool]]:
        """Each prediction, and whether it came true."""
        r = self.references
        held = wrong_model.held(self.tests(), r.informed, r.best_policy)
        spread = solver_spread.held(list(self.spreads))
        said = {**wrong_model.PREDICTIONS, **solver_spread.PREDICTIONS}
        return {name: (said[name], bool(true)) for name, true in (held | spread).items()}


def path() -> Path:
    """Where the latest runs are kept, beside the benchmark."""
    return store.folder() / FILE


def make(*, workers: int | None = None, progress: bool = True) -> OtherProblems:
    """Run everything, and keep it in `path`.

    Args:
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar.

    Raises:
        StoreError: it could not be kept; nothing is run.
        Exception: what the first job raised that failed.
    """
    check_folder()
    began, wanted = time.perf_counter(), jobs()
    done: dict[Any, Any] = {}

    def collect(job: Any, result: Any) -> str:
        done[job] = result
        return str(job)

    for error in execute(wanted, collect, workers=workers, progress=progress, unit="run").values():
        raise error
    return kept([done[job] for job in wanted], time.perf_counter() - began)


def jobs() -> dict[Any, Callable[[], Any]]:
    """All that is run, by name."""
    seeds = range(solver_spread.SEEDS)
    spreads = {("spread", seed): partial(solver_spread.spread, seed) for seed in seeds}
    courses = {
        (arm, seed): partial(wrong_model.run, arm, seed)
        for arm in ARMS
        for seed in range(wrong_model.SEEDS)
    }
    return {("references", 0): references, **spreads, **courses}


def kept(results: Sequence[Any], seconds: float) -> OtherProblems:
    """What all jobs returned, kept in `path`."""
    (found,) = (one for one in results if isinstance(one, References))
    whole = OtherProblems(
        tuple(one for one in results if isinstance(one, Course)),
        tuple(one for one in results if isinstance(one, Spread)),
        found,
        sealed.about(seconds),
    )
    sealed.keep(path(), _rounded(asdict(whole)))
    return whole


def references() -> References:
    """The costs to compare with; a search of minutes is among them."""
    problem, informed = gz.problem(), gz.problem(informed=True)
    best = search(informed.theta)
    return References(
        wrong_model.judge(problem.theta),
        wrong_model.judge(informed.theta),
        wrong_model.judge(best),
        tuple(best.tolist()),
        wrong_model.mean_cost(grid.best(points=POINTS, inputs=INPUTS).action),
    )


def search(start: Vector, budget: int = BUDGET) -> Vector:
    """The theta of the least mean cost that CMA-ES finds; it sees disturbances of its own."""
    import cma  # takes a second

    def cost(theta: Any) -> float:
        found = wrong_model.judge(np.asarray(theta), SEARCH_EPISODES, SEARCH_SEED)
        return min(found, 1e6)

    strategy = cma.CMAEvolutionStrategy(start, SPREAD, {"seed": 1, "verbose": -9})
    tried = 0
    while not strategy.stop() and tried < budget:
        asked = strategy.ask()
        strategy.tell(asked, [cost(one) for one in asked])
        tried += len(asked)
    return np.asarray(strategy.result.xbest)


def read(place: Path) -> OtherProblems:
    """What `make` kept.

    Raises:
        DamagedProblems: it is missing, or something else.
    """
    return sealed.read(place, _restored, DamagedProblems, "nmpcrl bench --problems")


def _restored(found: dict[str, Any]) -> OtherProblems:
    return OtherProblems(
        tuple(Course(**_lists(one)) for one in found["courses"]),
        tuple(Spread(**_lists(one)) for one in found["spreads"]),
        References(**_lists(found["references"])),
        found["about"],
    )


def _lists(fields: dict[str, Any]) -> dict[str, Any]:
    """With tuples for lists, and what JSON has no number for."""
    return {
        name: tuple(map(_number, value)) if isinstance(value, list) else _number(value)
        for name, value in fields.items()
    }


def _number(value: Any) -> Any:
    return np.inf if value is None else value


def _rounded(value: Any) -> Any:
    """With seven digits, which no sentence needs more of; infinite numbers are null."""
    if isinstance(value, dict):
        return {name: _rounded(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(one) for one in value]
    if isinstance(value, float):
        return float(f"{value:.7g}") if np.isfinite(value) else None
    return value

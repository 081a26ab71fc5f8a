"""The benchmark as a whole: measured into a dict of columns, kept as one JSON file."""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import psutil
from tqdm import tqdm

from nmpcrl.bench.learners import against_mpcrl, learners
from nmpcrl.bench.processes import at_once, first_calls, whole_runs
from nmpcrl.bench.scaling import solve_times
from nmpcrl.bench.solves import interleaved, own_loop, parts
from nmpcrl.study import paper, place, provenance, store
from nmpcrl.study.atomic import write_json
from nmpcrl.study.machine import machine
from nmpcrl.study.parameters import ParameterError

Bench = dict[str, dict[str, Any]]  # lists of one length by name, by what is measured

ALL = ("ES", "GES", "RDES", "DES")


@dataclass(frozen=True)
class Length:
    """How much is measured."""

    episodes: int  # of the recorded closed loops, each with and without noise
    problems: int  # of each of their episodes
    loops: int  # episodes of the default solver's own loop, and of every other small measure
    turns: int  # learning steps of every learner with every solver
    rounds: int  # of mpcrl
    mpcrl_steps: int  # of each round
    run: int  # episodes of a whole run
    learners: tuple[str, ...]  # whose whole runs are measured
    seeds: int  # runs at once
    seed_run: int  # episodes of each
    firsts: int  # first calls with machine code that is kept
    compile: bool  # whether to compile the solver anew


LENGTHS = {  # from the shortest
    "smoke": Length(
        episodes=1,
        problems=20,
        loops=1,
        turns=20,
        rounds=1,
        mpcrl_steps=8,
        run=4,
        learners=("ES", "RDES"),
        seeds=0,
        seed_run=0,
        firsts=1,
        compile=False,
    ),
    "short": Length(
        episodes=1,
        problems=paper.STEPS,
        loops=10,
        turns=120,
        rounds=2,
        mpcrl_steps=40,
        run=30,
        learners=ALL,
        seeds=6,
        seed_run=paper.EPISODES,
        firsts=3,
        compile=True,
    ),
    "full": Length(
        episodes=4,
        problems=paper.STEPS,
        loops=40,
        turns=400,
        rounds=5,
        mpcrl_steps=60,
        run=paper.EPISODES,
        learners=ALL,
        seeds=12,
        seed_run=paper.EPISODES,
        firsts=5,
        compile=True,
    ),
}


def read_or_measure(length: str = "full", *, progress: bool = True) -> Bench:
    """The benchmark: read if this code was measured here, and at least so long; else measured.

    Args:
        length: "smoke", "short" or "full".
        progress: whether to show a bar on standard error.

    Raises:
        ParameterError: there is no such length.
    """
    check(length)
    kept = stored()
    names = list(LENGTHS)
    if kept and names.index(kept["about"]["length"]) >= names.index(length):
        return kept
    return measure(length, progress=progress)


def check(length: object) -> None:
    """Refuse a length that there is not.

    Raises:
        ParameterError: there is none of this name.
    """
    if length not in list(LENGTHS):
        raise ParameterError(f"length = {length!r} must be one of {', '.join(LENGTHS)}")


def stored() -> Bench | None:
    """What is in the file, if it is of this code, these versions and this machine."""
    try:
        kept = json.loads(path().read_text())
        return kept if kept["about"]["key"] == depends_on() else None
    except FileNotFoundError:
        return None
    except (OSError, ValueError, LookupError, TypeError) as error:
        print(f"{path()} is damaged ({error}) and is measured again", file=sys.stderr)
        return None


def measure(length: str, *, progress: bool = True) -> Bench:
    """Measure everything, and store it.

    Raises:
        StoreError: it could not be stored; nothing is measured.
    """
    store.check_folder()
    size, began = LENGTHS[length], time.perf_counter()
    about: dict[str, Any] = {
        "length": length,
        "key": depends_on(),
        "date": datetime.now(UTC).date().isoformat(),
        "others": psutil.cpu_percent(1.0) / 100,  # share of the cores that is in use already
        "machine": machine(),
        "versions": versions(),
    }
    bench: Bench = {"about": about}
    bar = tqdm(_stages(size), "benchmark", disable=not progress, leave=False)
    for name, stage in bar:
        bar.set_description(f"benchmark ({length}): {name}")
        bench |= stage()
    about["seconds"] = time.perf_counter() - began
    place.keep(path(), lambda here: write_json(here, bench))
    return bench


def _stages(size: Length) -> list[tuple[str, Callable[[], Bench]]]:
    """What is measured, in order; what needs a quiet machine is not behind what starts many."""

    def runs() -> Bench:
        totals, progress = whole_runs(size.learners, size.run)
        return {"runs": totals, "episodes": progress}

    def steps() -> Bench:
        steps = against_mpcrl(size.rounds, size.mpcrl_steps)
        return {"learners": learners(size.turns), "mpcrl": steps}

    return [
        ("every solver", lambda: {"solves": interleaved(size.episodes, size.problems)}),
        ("its own loop", lambda: {"loop": own_loop(size.loops, paper.STEPS)}),
        ("parts of a step", lambda: {"parts": parts(size.loops)}),
        ("scaling", lambda: {"scaling": solve_times(max(3, size.loops // 2), paper.STEPS)}),
        ("learning steps", steps),
        ("whole runs", runs),
        ("runs at once", lambda: {"parallel": at_once(size.seeds, size.seed_run)}),
        ("first call", lambda: {"first": first_calls(size.firsts, compile_too=size.compile)}),
    ]


def path() -> Path:
    """The file, in the folder of the runs."""
    return store.folder() / "bench.json"


def depends_on() -> str:
    """A hash of all that the times depend on, but for what else the machine does."""
    return provenance.hash_of(
        [provenance.sources_hash(), provenance.room_hash("bench"), versions(), machine()]
    )


def versions() -> dict[str, str | None]:
    """The versions that the times depend on."""
    try:
        found: str | None = version("mpcrl")
    except PackageNotFoundError:
        found = None
    return {**provenance.environment(), "mpcrl": found}

"""The benchmark as a whole: measured stage by stage into columns, kept as one JSON file."""

import json
import sys
import time
from collections.abc import Callable, Collection, Iterable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import psutil
from tqdm import tqdm

from nmpcrl.bench.learners import against_mpcrl
from nmpcrl.bench.paired import IDLE
from nmpcrl.bench.processes import PROCESSES, at_once, first_calls, time_learners_afresh, whole_runs
from nmpcrl.bench.scaling import solve_times
from nmpcrl.bench.solves import columns_of, interleaved, own_loop, parts
from nmpcrl.study import limits, lock, paper, provenance
from nmpcrl.study.files import check_folder, folder, write_json
from nmpcrl.study.machine import machine
from nmpcrl.study.parameters import one_of

Bench = dict[str, dict[str, Any]]  # lists of one length by name, by what is measured
Stage = tuple[str, Callable[[], Bench]]

STEPS = "learning steps"  # the stage that Table II and the verdicts on time rest on

ALL = ("ES", "GES", "RDES", "DES")


@dataclass(frozen=True)
class Length:
    """How much is measured."""

    episodes: int  # of the recorded closed loops, each with and without noise
    problems: int  # of each of their episodes
    loops: int  # episodes of the default solver's own loop, and of every other small measure
    processes: int  # that time the learners, one after the other
    turns: int  # learning steps of every learner with every solver, in each of these
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
        processes=2,
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
        processes=4,
        turns=paper.STEPS,
        rounds=2,
        mpcrl_steps=40,
        run=30,
        learners=ALL,
        seeds=6,
        seed_run=50,
        firsts=3,
        compile=False,
    ),
    "full": Length(
        episodes=4,
        problems=paper.STEPS,
        loops=40,
        processes=PROCESSES,
        turns=3 * paper.STEPS,
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


@dataclass(frozen=True)
class Measured:
    """When and how a stage was measured."""

    length: str
    date: str
    others: float  # share of the cores that was in use when it began
    seconds: float  # that it took


def read_or_measure(
    length: str = "full",
    *,
    only: Collection[str] = (),
    calm: bool = False,
    progress: bool = True,
) -> Bench:
    """The benchmark: read if this code was measured here, and at least so long; else measured.

    Args:
        length: "smoke", "short" or "full".
        only: the stages that are needed; all of them if empty.
        calm: whether to measure again what was measured while other programs ran, if its verdict
            may depend on that.
        progress: whether to show a bar on standard error.

    Raises:
        ParameterError: there is no such length.
    """
    check(length)
    kept = stored() or _empty()
    missing = [
        stage
        for stage in _stages(LENGTHS[length])
        if (not only or stage[0] in only) and not _serves(kept, stage[0], length, calm)
    ]
    return _measured(kept, missing, length, progress) if missing else kept


def _serves(kept: Bench, stage: str, length: str, calm: bool) -> bool:
    """Whether what is kept of a stage is long enough, and calm enough where that is asked for."""
    measured = kept["stages"].get(stage)
    if measured is None or list(LENGTHS).index(measured["length"]) < list(LENGTHS).index(length):
        return False
    return not (calm and stage == STEPS and max(kept["learners"]["waited"]) > IDLE)


def beforehand(length: str, only: Collection[str] = ()) -> tuple[Callable[[], Bench], ...]:
    """What a chapter's driver calls with the machine to itself, so that `read_or_measure` reads.

    Raises:
        ParameterError: there is no such length.
    """
    check(length)
    return (partial(read_or_measure, length, only=only, calm=True),)


def check(length: object) -> None:
    """Refuse a length that there is not.

    Raises:
        ParameterError: there is none of this name.
    """
    one_of(LENGTHS).check("length", length)


def stored() -> Bench | None:
    """What is in the file, if it is of this code, these versions and this machine."""
    try:
        kept = json.loads(path().read_text("utf-8"))
        return kept if kept["about"]["key"] == depends_on() and dict(kept["stages"]) else None
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
    return _measured(_empty(), _stages(LENGTHS[length]), length, progress)


def _empty() -> Bench:
    """A benchmark of which nothing is measured yet."""
    about = {"key": depends_on(), "machine": machine(), "versions": versions()}
    return {"about": about, "stages": {}}


def _measured(kept: Bench, stages: Iterable[Stage], length: str, progress: bool) -> Bench:
    """`kept` with these stages measured; each is stored as soon as it is."""
    limits.need_numba("what is measured is the machine code that it compiles")
    check_folder()
    bar = tqdm(list(stages), "benchmark", disable=not progress, leave=False)
    for name, stage in bar:
        bar.set_description(f"benchmark ({length}): {name}")
        others, began = psutil.cpu_percent(1.0) / 100, time.perf_counter()
        kept |= stage()
        kept["stages"][name] = asdict(
            Measured(
                length=length,
                date=datetime.now(UTC).date().isoformat(),
                others=others,
                seconds=time.perf_counter() - began,
            )
        )
        kept["about"] |= _summed(kept["stages"].values())
        write_json(path(), kept)
    return kept


def _summed(stages: Collection[dict[str, Any]]) -> dict[str, Any]:
    """What `Measured` says of all stages together: the least length, the last day, ..."""
    one = [Measured(**stage) for stage in stages]
    return asdict(
        Measured(
            length=min((stage.length for stage in one), key=list(LENGTHS).index),
            date=max(stage.date for stage in one),
            others=max(stage.others for stage in one),
            seconds=sum(stage.seconds for stage in one),
        )
    )


def _stages(size: Length) -> list[Stage]:
    """What is measured, in order; what needs a quiet machine is not behind what starts many."""

    def runs() -> Bench:
        totals, progress = whole_runs(size.learners, size.run)
        return {"runs": totals, "episodes": progress}

    def steps() -> Bench:
        return {"learners": columns_of(time_learners_afresh(size.processes, size.turns))}

    return [
        ("every solver", lambda: {"solves": interleaved(size.episodes, size.problems)}),
        ("its own loop", lambda: {"loop": own_loop(size.loops, paper.STEPS)}),
        ("parts of a step", lambda: {"parts": parts(size.loops)}),
        ("scaling", lambda: {"scaling": solve_times(max(3, size.loops // 2), paper.STEPS)}),
        (STEPS, steps),
        ("mpcrl", lambda: {"mpcrl": against_mpcrl(size.rounds, size.mpcrl_steps)}),
        ("whole runs", runs),
        ("runs at once", lambda: {"parallel": at_once(size.seeds, size.seed_run)}),
        ("first call", lambda: {"first": first_calls(size.firsts, compile_too=size.compile)}),
    ]


OTHERS = tuple(name for name, _ in _stages(LENGTHS["smoke"]) if name != STEPS)


def path() -> Path:
    """The file, in the folder of the runs."""
    return folder() / "bench.json"


def depends_on() -> str:
    """A hash of all that the times depend on, but for what else the machine does."""
    bench = [
        lock.code(one.read_text("utf-8")) for one in sorted(Path(__file__).parent.glob("*.py"))
    ]
    return provenance.hash_of([lock.sources_hash(), bench, versions(), machine()])


def versions() -> dict[str, str | None]:
    """The versions that the times depend on."""
    try:
        found: str | None = version("mpcrl")
    except PackageNotFoundError:
        found = None
    return {**provenance.environment(), "mpcrl": found}

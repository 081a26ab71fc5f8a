"""Summaries of many runs: trained once, run by run, wherever there is room.

A worker trains, summarises, and hands the summary back; who asked for it stores it, and has
reserved the run until then. What somebody else has reserved is left for the end.
"""

import traceback
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from nmpcrl.analysis.summary import RunSummary, summarise
from nmpcrl.control import Riccati
from nmpcrl.study import store
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.limits import seconds_of
from nmpcrl.study.provenance import (
    environment,
    provenance,
    signature,
    summary_key,
    warn_of_changes,
)
from nmpcrl.study.records import DamagedRecords, Records, most_evaluations
from nmpcrl.study.run import run
from nmpcrl.study.setup import compile_ahead
from nmpcrl.study.storage import place
from nmpcrl.study.storage.atomic import write_json
from nmpcrl.study.storage.executor import execute
from nmpcrl.study.storage.refusal import Refusal
from nmpcrl.study.storage.reservation import reservations
from nmpcrl.study.store import Runs

FOLDER = "summaries"  # among the runs
EPISODE, EVALUATION, STEP, REST = 280, 140, 40, 10_000  # bytes that a summary's file takes at most


class Failed(Refusal):
    """Some runs of a study could not be made; the others are stored."""


class OtherSolver(Refusal):
    """A run was solved by another solver than its experiment names, and so is none of that."""


class OtherCode(RuntimeError):
    """A worker would make other numbers than who asked for them."""


def fetch_summaries(
    experiments: Iterable[Experiment],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: bool = True,
    strict: bool = True,
) -> Runs[RunSummary]:
    """The summaries of many runs: read if they are stored, otherwise made and stored.

    A run that fails, or whose worker is killed again and again, is recorded with its reason beside
    the summaries and does not stop the others; the next call tries it again.

    Args:
        experiments: the runs wanted.
        executor: runs them, such as `cluster.executor` gives; by default processes on this machine.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar with runs done and failed, and the time left.
        strict: whether a failure is raised when all others are done, or only said.

    Raises:
        StoreError: summaries are missing and cannot be stored; nothing is trained.
        OtherSolver: what solves them is not installed; nothing is trained.
        Failed: runs failed, and `strict` holds.
    """
    wanted = tuple(dict.fromkeys(experiments))
    found = {e: one for e in wanted if (one := read(e))}
    failures: dict[Experiment, Exception] = {}
    # the long ones first, so that no worker is alone with one at the end
    missing = sorted((e for e in wanted if e not in found), key=seconds_of, reverse=True)
    if missing:
        _refuse_without_numba(missing)
        store.check_folder(sum(map(size_of, missing)), folder())
        compile_ahead(missing)
    options = {"executor": executor, "workers": workers, "progress": progress}
    while missing:
        missing = _make_all(missing, found, failures, **options)
    if failures:
        _tell(failures, len(wanted), strict)
    return Runs({e: found[e] for e in wanted if e in found})


def _refuse_without_numba(missing: Iterable[Experiment]) -> None:
    """Say before anything is trained what would be known after it.

    Raises:
        OtherSolver: runs of riccati are missing, and without numba another one would solve them.
    """
    needing = sum(one.solver == Riccati.name for one in missing)
    if needing and environment()["numba"] == "absent":
        raise OtherSolver(
            f"numba is not installed, and without it {Riccati.name}, which {needing} of the missing"
            " runs name, solves nothing: `pip install numba`"
        )


def _make_all(
    missing: list[Experiment],
    found: dict[Experiment, RunSummary],
    failures: dict[Experiment, Exception],
    **options: Any,
) -> list[Experiment]:
    """Make what nobody else is at; what is left, once one of those is no longer."""
    expected = signature()
    names = {e: f"{FOLDER}/{path_of(e).name}" for e in missing}
    reserved, mine, left = reservations(store.folder()), set[str](), list[Experiment]()

    def begin(experiment: Experiment) -> bool:
        if not reserved.take([names[experiment]]):
            left.append(experiment)
            return False
        mine.add(names[experiment])
        if one := _read_or_set_aside(experiment):  # it has been stored meanwhile
            found[experiment] = one
            end(experiment)
            return False
        return True

    def end(experiment: Experiment) -> None:
        reserved.release([names[experiment]])
        mine.remove(names[experiment])

    def store_it(experiment: Experiment, made: RunSummary) -> str:
        found[experiment] = made
        keep(experiment, made)
        end(experiment)
        return ""

    jobs = {e: partial(make, e, expected) for e in missing}
    try:
        failed = execute(jobs, store_it, begin=begin, **options)
    finally:
        reserved.release(mine)
    for experiment, error in failed.items():
        _note(experiment, error)
    failures |= failed
    if left:
        store.wait_for([names[e] for e in left], left[0])
    return left


def _tell(failures: Mapping[Experiment, Exception], wanted: int, strict: bool) -> None:
    """Raise, or only say, what failed."""
    first, error = next(iter(failures.items()))
    said = (
        f"{len(failures)} of {wanted} runs failed, {first} because of"
        f" {type(error).__name__}: {error}; each has its reason in {folder()}"
    )
    if strict:
        raise Failed(said)
    place.say(said)


def folder() -> Path:
    """Where summaries are kept, among the runs."""
    return store.folder() / FOLDER


def path_of(experiment: Experiment) -> Path:
    """The file of one summary."""
    return folder() / f"{store.name_of(experiment)}-{summary_key(experiment)[:10]}.npz"


def is_stored(experiment: Experiment) -> bool:
    """Whether there is a file that says it is the summary; all of it is read by `load` alone."""
    return store.is_there(path_of(experiment), experiment, RunSummary.about)


def load(experiment: Experiment) -> RunSummary:
    """The stored summary of a run.

    Raises:
        FileNotFoundError: there is none.
        DamagedRecords: it is not whole, or that of another run.
    """
    warn_of_changes()
    path = path_of(experiment)
    summary = RunSummary.load(path)
    store.check_run(path, experiment, summary.experiment, summary.facts)
    return summary


def read(experiment: Experiment) -> RunSummary | None:
    """The stored summary of a run, if there is a whole one."""
    try:
        return load(experiment)
    except (FileNotFoundError, DamagedRecords):
        return None


def _read_or_set_aside(experiment: Experiment) -> RunSummary | None:
    """As `_read`, for who has reserved it and makes it again."""
    try:
        return load(experiment)
    except FileNotFoundError:
        return None
    except DamagedRecords as error:
        place.set_aside(path_of(experiment), error)
        return None


def size_of(experiment: Experiment) -> int:
    """How many bytes the file of a summary takes at most."""
    e = experiment
    return EPISODE * e.episodes + EVALUATION * most_evaluations(e) + STEP * e.steps + REST


def make(experiment: Experiment, expected: str, *, afresh: bool = False) -> RunSummary:
    """What a worker does: train a run, unless it is stored whole, and summarise it.

    Args:
        experiment: names the run.
        expected: the `signature` of who asked.
        afresh: whether to train it even if it is stored.

    Raises:
        OtherCode: this worker would make other numbers than who asked.
        OtherSolver: the run needed another solver than its experiment names.
    """
    if signature() != expected:
        raise OtherCode("the worker has other code, or other versions of what the numbers need")
    records = None if afresh else _stored_run(experiment)
    if records is None:
        records = run(experiment)
        records = replace(records, facts={**records.facts, **provenance(experiment)})
    if other := store.solved_by_another(experiment, records.facts):
        raise OtherSolver(f"it was {other}")
    return summarise(records)


def _stored_run(experiment: Experiment) -> Records | None:
    try:
        return store.read(experiment)
    except (FileNotFoundError, DamagedRecords):
        return None


def keep(experiment: Experiment, made: RunSummary) -> None:
    """Store a summary; what may lie there of an earlier failure goes."""
    path = path_of(experiment)
    if place.keep(path, made.save):
        with suppress(OSError):
            _note_of(path).unlink()


def _note(experiment: Experiment, error: Exception) -> None:
    """Write down why there is no summary."""
    said = f"{type(error).__name__}: {error}"
    trace = "".join(traceback.format_exception(error))
    content = {"experiment": asdict(experiment), "reason": said, "traceback": trace}
    note = _note_of(path_of(experiment))
    try:
        write_json(note, content)
    except OSError as refused:
        place.say(f"{note} cannot be written ({refused.strerror}): {said}")


def _note_of(path: Path) -> Path:
    return path.with_suffix(".failed.json")

"""Summaries of many runs: trained once, run by run, wherever there is room.

A worker trains, summarises, and hands the summary back; who asked for it stores it.
"""

import sys
import threading
import traceback
from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import asdict
from functools import partial
from pathlib import Path

from nmpcrl.analysis.summary import RunSummary, summarise
from nmpcrl.study import paper, store
from nmpcrl.study.atomic import write_json
from nmpcrl.study.executor import execute
from nmpcrl.study.experiment import NETWORK_LEARNERS, Experiment
from nmpcrl.study.provenance import provenance, signature, summary_key, warn_of_changes
from nmpcrl.study.records import DamagedRecords, Records
from nmpcrl.study.run import run
from nmpcrl.study.setup import compile_ahead
from nmpcrl.study.store import Runs

ALONE = threading.Lock()  # of a process: torch's generator, which draws weights, is its only one


class Failed(RuntimeError):
    """Some runs of a study could not be made; the others are stored."""


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
        Failed: runs failed, and `strict` holds.
    """
    wanted = tuple(dict.fromkeys(experiments))
    missing = [e for e in wanted if not is_stored(e)]
    compile_ahead(missing)
    # the long ones first, so that no worker is alone with one at the end
    ordered = sorted(missing, key=seconds_of, reverse=True)
    failures = execute(
        {e: partial(make, e, signature()) for e in ordered},
        _keep,
        executor=executor,
        workers=workers,
        progress=progress,
    )
    for experiment, error in failures.items():
        _note(experiment, error)
    if failures:
        first, error = next(iter(failures.items()))
        said = (
            f"{len(failures)} of {len(wanted)} runs failed, {first} because of"
            f" {type(error).__name__}: {error}; each has its reason in {folder()}"
        )
        if strict:
            raise Failed(said)
        print(said, file=sys.stderr)
    return Runs({e: load(e) for e in wanted if e not in failures})


def folder() -> Path:
    """Where summaries are kept, among the runs."""
    return store.folder() / "summaries"


def path_of(experiment: Experiment) -> Path:
    """The file of one summary."""
    return folder() / f"{store.name_of(experiment)}-{summary_key(experiment)[:10]}.npz"


def is_stored(experiment: Experiment) -> bool:
    """Whether the summary of a run is there; a damaged one is put aside."""
    path = path_of(experiment)
    if not path.exists():
        return False
    try:
        Records.about(path)
    except DamagedRecords as error:
        store.set_aside(path, error)
        return False
    return True


def load(experiment: Experiment) -> RunSummary:
    """The stored summary of a run."""
    warn_of_changes()
    return RunSummary.load(path_of(experiment))


def seconds_of(experiment: Experiment) -> float:
    """About how long a run takes one core [s]."""
    each = 12.0 if experiment.learner in NETWORK_LEARNERS else 4.0
    whole = paper.EPISODES * paper.STEPS * paper.HORIZON
    return each * experiment.episodes * experiment.steps * experiment.horizon / whole


def make(experiment: Experiment, expected: str, *, afresh: bool = False) -> RunSummary:
    """What a worker does: train a run, unless it is stored whole, and summarise it.

    Args:
        experiment: names the run.
        expected: the `signature` of who asked.
        afresh: whether to train it even if it is stored.

    Raises:
        OtherCode: this worker would make other numbers than who asked.
    """
    if signature() != expected:
        raise OtherCode("the worker has other code, or other versions of what the numbers need")
    with ALONE:
        records = None if afresh else _stored_run(experiment)
        if records is None:
            records = run(experiment)
            records.facts.update(provenance(experiment))
        return summarise(records)


def _stored_run(experiment: Experiment) -> Records | None:
    try:
        return Records.load(store.path_of(experiment))
    except (FileNotFoundError, DamagedRecords):
        return None


def _keep(experiment: Experiment, made: RunSummary) -> str:
    """Store a summary; what may lie there of an earlier failure goes."""
    path = path_of(experiment)
    made.save(path)
    _note_of(path).unlink(missing_ok=True)
    return ""


def _note(experiment: Experiment, error: Exception) -> None:
    """Write down why there is no summary."""
    said = f"{type(error).__name__}: {error}"
    trace = "".join(traceback.format_exception(error))
    content = {"experiment": asdict(experiment), "reason": said, "traceback": trace}
    write_json(_note_of(path_of(experiment)), content)


def _note_of(path: Path) -> Path:
    return path.with_suffix(".failed.json")

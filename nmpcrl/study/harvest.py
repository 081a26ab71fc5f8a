"""Digests of many runs: a study is trained once, run by run, wherever there is room.

A worker trains, digests, and hands the digest back; who asked for it stores it. So an interruption
loses the runs in flight and no other, and workers need not share a disk with anybody.
"""

import json
import os
import sys
import tempfile
import traceback
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from tqdm import tqdm

from nmpcrl.study import paper, store
from nmpcrl.study.digest import Digest, digest
from nmpcrl.study.experiment import NETWORK_LEARNERS, Experiment, compile_ahead, run
from nmpcrl.study.records import DamagedRecords, Records

SUMMARISES = ("study/digest.py", "study/metrics.py", "study/imitation.py")  # besides the run itself
AHEAD = 4  # runs that wait for each worker: it need not, and an interruption forgets few


class Failed(RuntimeError):
    """Some runs of a study could not be made; the others are stored."""


def fetch_digests(
    experiments: Iterable[Experiment],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: bool = True,
    strict: bool = True,
) -> store.Study[Digest]:
    """The digests of many runs: read if they are stored, otherwise trained, digested and stored.

    A run that fails is recorded with its reason beside the digests and does not stop the others;
    the next call tries it again.

    Args:
        experiments: the runs wanted.
        executor: runs them, such as `cluster.executor` gives; by default processes on this machine.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar with runs done, running and failed, and the time left.
        strict: whether a failure is raised when all others are done, or just left out.

    Raises:
        Failed: runs failed, and `strict` holds.
        RuntimeError: workers were killed again and again.
    """
    wanted = tuple(dict.fromkeys(experiments))
    failures: dict[Experiment, str] = {}
    for left in reversed(range(store.ATTEMPTS + 1)):
        missing = [e for e in wanted if not is_stored(e) and e not in failures]
        if not missing:
            break
        if not left:
            raise RuntimeError(
                f"workers were killed {store.ATTEMPTS} times; {len(missing)} runs are missing:"
                f" {missing[0]}, ..."
            )
        try:  # the long ones first, so that no worker is alone with one at the end
            with _workers(executor, workers, len(missing)) as (pool, count):
                failures |= _harvest(
                    sorted(missing, key=seconds_of, reverse=True), pool, count, progress
                )
        except BrokenProcessPool:
            if executor is not None:
                raise
    if failures and strict:
        first, reason = next(iter(failures.items()))
        raise Failed(
            f"{len(failures)} of {len(wanted)} runs failed, {first} because of {reason};"
            f" each has its reason in {folder()}"
        )
    return store.Study({e: _read(e) for e in wanted if e not in failures})


def folder() -> Path:
    """Where digests are kept, among the runs."""
    return store.folder() / "digests"


def path_of(experiment: Experiment) -> Path:
    """The file of one digest."""
    return folder() / f"{store.name_of(experiment)}-{key(experiment)[:10]}.npz"


def key(experiment: Experiment) -> str:
    """A digest of all that a digest's numbers depend on."""
    depends = [store.key(experiment), _summary()]
    return sha256(json.dumps(depends).encode()).hexdigest()


def is_stored(experiment: Experiment) -> bool:
    """Whether the digest of a run is there; a damaged one is put aside."""
    path = path_of(experiment)
    if not path.exists():
        return False
    try:
        Records.about(path)
    except DamagedRecords as error:
        aside = path.with_suffix(".damaged")
        path.replace(aside)
        print(f"{error}; it is kept as {aside.name} and made again", file=sys.stderr)
        return False
    return True


def seconds_of(experiment: Experiment) -> float:
    """About how long a run takes one core [s]."""
    each = 12.0 if experiment.learner in NETWORK_LEARNERS else 4.0
    whole = paper.EPISODES * paper.STEPS * paper.HORIZON
    return each * experiment.episodes * experiment.steps * experiment.horizon / whole


def make(experiment: Experiment) -> Digest:
    """What a worker does: train a run, unless it is stored whole, and digest it."""
    try:
        records = Records.load(store.path_of(experiment))
    except (FileNotFoundError, DamagedRecords):
        records = run(experiment)
    records.facts.update(store.provenance(experiment))
    return digest(records)


@cache
def _summary() -> str:
    return store.digest(SUMMARISES)


def _read(experiment: Experiment) -> Digest:
    return Digest.load(path_of(experiment))


@contextmanager
def _workers(
    executor: Executor | None, workers: int | None, runs: int
) -> Iterator[tuple[Executor, int]]:
    """Who trains, and how many they are."""
    if executor is not None:
        yield executor, max(1, getattr(executor, "workers", os.cpu_count() or 1))
        return
    count = min(workers or os.cpu_count() or 1, runs)
    with store.processes(count) as pool:
        yield pool, count


def _harvest(
    missing: list[Experiment], executor: Executor, workers: int, progress: bool
) -> dict[Experiment, str]:
    """Store every digest as it comes; return what failed, with the reasons."""
    compile_ahead(missing)
    failures: dict[Experiment, str] = {}
    waiting = iter(missing)
    pending: dict[Future[Digest], Experiment] = {}
    with (
        tqdm(
            total=len(missing), unit="run", disable=not progress, mininterval=store.interval()
        ) as bar,
        store.without_main(),
    ):
        while True:
            for experiment in _some(waiting, AHEAD * workers - len(pending)):
                pending[executor.submit(make, experiment)] = experiment
            if not pending:
                return failures
            bar.set_postfix_str(
                f"{min(workers, len(pending))} running, {len(failures)} failed", refresh=False
            )
            for future in wait(pending, timeout=1.0, return_when=FIRST_COMPLETED).done:
                experiment = pending.pop(future)
                reason = _keep(experiment, future)
                if reason:
                    failures[experiment] = reason
                bar.update()


def _some(waiting: Iterator[Experiment], most: int) -> list[Experiment]:
    return [experiment for _, experiment in zip(range(most), waiting, strict=False)]


def _keep(experiment: Experiment, future: "Future[Digest]") -> str:
    """Store what a worker made, or why it made nothing; that reason is returned."""
    path = path_of(experiment)
    reason = path.with_suffix(".failed.json")
    try:
        made = future.result()
    except BrokenProcessPool:
        raise
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
        trace = "".join(traceback.format_exception(error))
        _write(reason, {"experiment": asdict(experiment), "reason": said, "traceback": trace})
        return said
    made.save(path)
    reason.unlink(missing_ok=True)
    return ""


def _write(path: Path, content: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".half-", suffix=".tmp")
    with os.fdopen(handle, "w") as file:
        json.dump(content, file)
    Path(name).replace(path)

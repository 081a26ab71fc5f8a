"""Summaries of many runs: a study is trained once, run by run, wherever there is room.

A worker trains, summarises, and hands the summary back; who asked for it stores it. So an
interruption loses the runs in flight and no other, and workers need not share a disk.
"""

import json
import os
import sys
import tempfile
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from tqdm import tqdm

from nmpcrl.analysis.summary import RunSummary, summarise
from nmpcrl.study import paper, store
from nmpcrl.study.experiment import NETWORK_LEARNERS, Experiment, compile_ahead, run
from nmpcrl.study.records import DamagedRecords, Records

SUMMARISES = (
    "analysis/summary.py",
    "analysis/metrics.py",
    "analysis/imitation.py",
)  # besides the run itself
WAIT = 0.5  # [s]; what waits for longer may not notice an interrupt
ALONE = threading.Lock()  # of a process: torch's generator, which draws weights, is its only one


class Failed(RuntimeError):
    """Some runs of a study could not be made; the others are stored."""


class Killed(RuntimeError):
    """The worker of a run was killed, and so were those that tried again."""


class OtherCode(RuntimeError):
    """A worker would make other numbers than who asked for them."""


def fetch_summaries(
    experiments: Iterable[Experiment],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: bool = True,
    strict: bool = True,
) -> store.Study[RunSummary]:
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
    failures: dict[Experiment, str] = {}
    if missing:
        compile_ahead(missing)
        with nullcontext(executor) if executor else _processes(workers, len(missing)) as pool:
            failures = _harvest(missing, pool, progress=progress)
    if failures:
        first, reason = next(iter(failures.items()))
        said = (
            f"{len(failures)} of {len(wanted)} runs failed, {first} because of {reason};"
            f" each has its reason in {folder()}"
        )
        if strict:
            raise Failed(said)
        print(said, file=sys.stderr)
    return store.Study({e: _read(e) for e in wanted if e not in failures})


def folder() -> Path:
    """Where summaries are kept, among the runs."""
    return store.folder() / "summaries"


def path_of(experiment: Experiment) -> Path:
    """The file of one summary."""
    return folder() / f"{store.name_of(experiment)}-{key(experiment)[:10]}.npz"


def key(experiment: Experiment) -> str:
    """A hash of all that a summary's numbers depend on."""
    depends = [store.key(experiment), _summary()]
    return sha256(json.dumps(depends).encode()).hexdigest()


def is_stored(experiment: Experiment) -> bool:
    """Whether the summary of a run is there; a damaged one is put aside."""
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


def make(experiment: Experiment, expected: str) -> RunSummary:
    """What a worker does: train a run, unless it is stored whole, and summary it.

    Raises:
        OtherCode: this worker would make other numbers than who asked.
    """
    if key(experiment) != expected:
        raise OtherCode("the worker has other code, or other versions of what the numbers need")
    with ALONE:
        try:
            records = Records.load(store.path_of(experiment))
        except (FileNotFoundError, DamagedRecords):
            records = run(experiment)
        records.facts.update(store.provenance(experiment))
        return summarise(records)


@cache
def _summary() -> str:
    return store.source_hash(SUMMARISES)


def _read(experiment: Experiment) -> RunSummary:
    return RunSummary.load(path_of(experiment))


@contextmanager
def _processes(workers: int | None, runs: int) -> Iterator[Executor]:
    """Processes of this machine, no more than there are runs."""
    slots = Slots(min(workers or os.cpu_count() or 1, runs))
    try:
        yield slots
    except BaseException:
        slots.shutdown(wait=False, cancel_futures=True)
        raise
    slots.shutdown()


class Slots(Executor):
    """Processes of one worker each: one that is killed takes down no run but its own.

    That run is tried again in a new process, and fails after `store.ATTEMPTS`.
    """

    def __init__(self, slots: int) -> None:
        self._threads = ThreadPoolExecutor(slots)
        self._own = threading.local()  # each thread's process
        self._all: list[ProcessPoolExecutor] = []
        self._closing = threading.Lock()  # a process is started before the end, or not at all
        self._closed = False

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """As `Executor.submit`."""
        return self._threads.submit(self._call, partial(fn, *args, **kwargs))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """As `Executor.shutdown`; without waiting, processes are ended at once."""
        with self._closing:
            self._closed = not wait
            for process in self._all if self._closed else ():
                kill(process)
        self._threads.shutdown(wait=True, cancel_futures=cancel_futures)
        for process in self._all:
            process.shutdown()

    def _call(self, call: Callable[[], Any]) -> Any:
        for _ in range(store.ATTEMPTS):
            try:
                return self._begin(call).result()
            except BrokenProcessPool:
                del self._own.process
        raise Killed(f"its worker was killed {store.ATTEMPTS} times")

    def _begin(self, call: Callable[[], Any]) -> Future[Any]:
        """Let this thread's process begin, unless all have been ended."""
        with self._closing:
            if self._closed:
                raise Killed("the study was interrupted")
            if not hasattr(self._own, "process"):
                self._own.process = store.processes(1)
                self._all.append(self._own.process)
            return self._own.process.submit(call)


def kill(pool: ProcessPoolExecutor) -> None:
    """End the processes of a pool at once."""
    for process in list((pool._processes or {}).values()):
        process.kill()


def _harvest(
    missing: list[Experiment], executor: Executor, *, progress: bool
) -> dict[Experiment, str]:
    """Store every summary as it comes; return what failed, with the reasons."""
    failures: dict[Experiment, str] = {}
    with store.without_main():
        # the long ones first, so that no worker is alone with one at the end
        ordered = sorted(missing, key=seconds_of, reverse=True)
        pending = {executor.submit(make, e, key(e)): e for e in ordered}
        with tqdm(
            total=len(ordered), unit="run", disable=not progress, mininterval=store.interval()
        ) as bar:
            while pending:
                done = wait(pending, timeout=WAIT, return_when=FIRST_COMPLETED).done
                ended = len(done)
                while done:
                    failures |= _keep(done.pop(), pending)
                running = sum(one.running() for one in pending)  # a cluster does not tell
                said = [f"{running} running"] * (running > 0) + [f"{len(failures)} failed"]
                bar.set_postfix_str(", ".join(said), refresh=False)
                bar.update(ended)
    return failures


def _keep(
    future: Future[RunSummary], pending: dict[Future[RunSummary], Experiment]
) -> dict[Experiment, str]:
    """Store what a worker made, or why it made nothing, which is returned.

    The future is forgotten: as long as it is held, Dask makes a run again whose worker it loses.
    """
    experiment = pending.pop(future)
    path = path_of(experiment)
    reason = path.with_suffix(".failed.json")
    try:
        made = future.result()
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
        trace = "".join(traceback.format_exception(error))
        _write(reason, {"experiment": asdict(experiment), "reason": said, "traceback": trace})
        return {experiment: said}
    made.save(path)
    reason.unlink(missing_ok=True)
    return {}


def _write(path: Path, content: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".half-", suffix=".tmp")
    with os.fdopen(handle, "w") as file:
        json.dump(content, file)
    Path(name).replace(path)

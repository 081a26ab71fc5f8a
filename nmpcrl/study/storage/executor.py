"""One engine for many jobs: on processes of this machine, or on any executor that is given.

A job runs on any free worker, and the caller keeps each result as it arrives. An interruption
therefore loses only the jobs in progress, and workers need no shared disk.
"""

import os
import signal
import sys
import threading
from collections.abc import Callable, Hashable, Iterator, Mapping
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
from functools import partial
from multiprocessing import get_context
from types import ModuleType
from typing import Any, TypeVar

from tqdm import tqdm

from nmpcrl.study.storage.orphans import end_with_parent
from nmpcrl.study.storage.outcome import pack, unpack
from nmpcrl.study.storage.workers import check_workers as check_workers
from nmpcrl.study.storage.workers import told

SPAWN = get_context("spawn")  # a fork would copy the threads' locks but not the threads
ATTEMPTS = 3  # how often a job is begun whose worker is killed
THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
WAIT = 0.5  # [s]; what waits for longer may not notice an interrupt

Name = TypeVar("Name", bound=Hashable)
Result = TypeVar("Result")


class Killed(RuntimeError):
    """The worker of a job was killed, and so were those that tried again."""


def execute(
    jobs: Mapping[Name, Callable[[], Result]],
    keep: Callable[[Name, Result], str],
    *,
    begin: Callable[[Name], bool] = lambda _: True,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: bool = True,
    size: Callable[[Name], int] = lambda _: 1,
    unit: str = "run",
) -> dict[Name, Exception]:
    """Do every job, and keep each result as soon as it is there.

    Args:
        jobs: what is called in a worker, in the order in which they begin; to be pickled.
        keep: called in this process with each result; returns the text of the bar, or "".
        begin: called in this process before a job is submitted; if false, the job is left out.
        executor: runs the jobs; by default processes, one thread each. One that the caller gives is
            not replaced if it loses a worker.
        workers: how many processes; by default as many as there are cores and memory for.
            `check_workers` refuses more than that.
        progress: whether to print the memory of the processes, and to show a bar with the jobs
            that have ended or failed, and the time left.
        size: of a job, in units of the bar.
        unit: of the bar.

    Returns:
        The error of each job that failed: `Killed` if it lost its worker `ATTEMPTS` times, and
        `Unsendable` if its result cannot be pickled. A failure stops no other job.
    """
    if not jobs:
        return {}
    failures: dict[Name, Exception] = {}
    count = min(check_workers(workers, sure=True), len(jobs))
    if progress and not executor:
        print(told(count), file=sys.stderr)
    pool = nullcontext(executor) if executor else processes(count)
    ahead = len(jobs) if executor else 2 * count  # in flight: what waits there, others cannot take
    total = sum(map(size, jobs))
    with (
        without_main(),
        pool as chosen,
        tqdm(total=total, unit=unit, disable=not progress, mininterval=interval()) as bar,
    ):
        waiting, pending = [*jobs][::-1], dict[Future[bytes], Name]()

        def hand_over() -> bool:
            """Keep as many jobs in flight as there should be; whether any is."""
            while waiting and len(pending) < ahead:
                name = waiting.pop()
                if begin(name):
                    pending[chosen.submit(pack, jobs[name])] = name
                else:
                    bar.total -= size(name)
            return bool(pending)

        while hand_over():
            for future in wait(pending, timeout=WAIT, return_when=FIRST_COMPLETED).done:
                # The future is forgotten: as long as it is held, Dask does a job again whose
                # worker it loses.
                name, shown = pending.pop(future), ""
                try:
                    shown = keep(name, unpack(future.result()))
                except Exception as error:
                    failures[name] = error
                del future
                bar.update(size(name))
                ended = len(jobs) - len(waiting) - len(pending)
                _describe(bar, f"{ended}/{len(jobs)}", pending, len(failures), shown)
    return failures


def _describe(
    bar: "tqdm[Any]", ended: str, pending: Mapping[Future[Any], Any], failed: int, shown: str
) -> None:
    """What the bar says beside its numbers."""
    running = sum(future.running() for future in pending)  # a cluster does not tell
    parts = [f"{running} running"] * (running > 0) + [f"{failed} failed"] * (failed > 0)
    bar.set_description(f"{ended} done", refresh=False)
    bar.set_postfix_str(", ".join([*parts, *([shown] if shown else [])]), refresh=False)


@contextmanager
def processes(workers: int) -> Iterator[Executor]:
    """So many processes of this machine; an error ends them at once."""
    slots = Slots(workers)
    try:
        yield slots
    except BaseException:
        slots.shutdown(wait=False, cancel_futures=True)
        raise
    slots.shutdown()


class Slots(Executor):
    """Processes of one worker each: one that is killed takes down no job but its own.

    That job is tried again in a new process, and fails after `ATTEMPTS`.
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
        for _ in range(ATTEMPTS):
            try:
                return self._begin(call).result()
            except BrokenProcessPool:
                del self._own.process
        raise Killed(f"its worker was killed {ATTEMPTS} times")

    def _begin(self, call: Callable[[], Any]) -> Future[Any]:
        """Let this thread's process begin, unless all have been ended."""
        with self._closing:
            if self._closed:
                raise Killed("the study was interrupted")
            if not hasattr(self._own, "process"):
                self._own.process = _process()
                self._all.append(self._own.process)
            result: Future[Any] = self._own.process.submit(call)
            return result


def _process() -> ProcessPoolExecutor:
    """A worker process with one thread; the setting is inherited, so it is made here."""
    os.environ.update(dict.fromkeys(THREADS, "1"))
    return ProcessPoolExecutor(1, SPAWN, initializer=_begin_worker)


def _begin_worker() -> None:
    """What a worker does first."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the caller ends it; else it would be replaced
    end_with_parent()


def kill(pool: ProcessPoolExecutor) -> None:
    """End the processes of a pool at once."""
    for process in list((pool._processes or {}).values()):
        process.kill()


@contextmanager
def without_main() -> Iterator[None]:
    """Hide the caller's script from new processes, which would otherwise run it again.

    So a script needs no `if __name__ == "__main__"`, and one read from standard input works too.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def interval() -> float:
    """Seconds between two states of the bar: a log keeps every one, a terminal the last."""
    return 0.1 if sys.stderr.isatty() else 30.0

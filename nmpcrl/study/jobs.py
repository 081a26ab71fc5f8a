"""Jobs on many processes of this machine, or on any executor of `concurrent.futures`.

`parallel` yields each result as it arrives, so that an interruption loses only jobs in progress.
"""

import os
import pickle
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import psutil
from filelock import FileLock, Timeout
from tqdm import tqdm

from nmpcrl.study.files import lock, wait_for
from nmpcrl.study.refusal import ParameterError, Refusal

ATTEMPTS = 3  # how often a job is begun whose process is killed
AHEAD = 128  # jobs given to an executor of the caller's at a time
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
MEMORY = 0.45e9  # [bytes] of a worker at the end of a full run of RDES
LIMIT = Path("/sys/fs/cgroup/memory.max")  # of a Linux container
WAIT = 0.5  # [s] between two looks for an interrupt, which Windows keeps from a waiting thread

Item = TypeVar("Item")
Result = TypeVar("Result")
Pool = Callable[[int], AbstractContextManager[Executor]]  # of so many workers


class Failure(NamedTuple):
    """A job that failed, and why."""

    item: Any
    error: str  #: type and message
    traceback: str = ""


class Failed(Refusal):
    """Some jobs failed; the results of all others were yielded. The message names the first."""

    def __init__(self, failures: Sequence[Failure], jobs: int) -> None:
        first = failures[0]
        super().__init__(f"{len(failures)} of {jobs} failed, {first.item} because of {first.error}")
        self.failures = tuple(failures)
        self.add_note(first.traceback)

    def _render_traceback_(self) -> list[str]:
        """The sentence and the traceback of the worker, as IPython shows them."""
        return [*super()._render_traceback_(), *self.__notes__]


def parallel(
    function: Callable[[Item], Result],
    items: Collection[Item],
    workers: int | None = None,
    label: str = "",
    executor: Executor | None = None,
    ready: Callable[[Item], bool] = lambda item: True,
) -> Iterator[tuple[Item, Result]]:
    """Call a function with every item; yield each item and its result as soon as it has one.

    A failed job stops no other one, and `Failed` is raised at the end. When a process is killed,
    each job in progress is begun again alone, so that no job fails because of another. Leaving
    the loop early ends all processes.

    Args:
        function: called in a worker; it may be defined in a notebook.
        items: one a job, in the order in which jobs begin.
        workers: processes with one thread each; by default `usable_workers()`.
        label: of a progress bar; without a label there is none.
        executor: makes the calls in place of new processes, `AHEAD` at a time.
        ready: called here shortly before a worker is free for an item, which False skips.
    """
    if workers is not None and (type(workers) is not int or workers < 1):
        raise ParameterError(f"workers = {workers!r} must be a whole number, 1 or more")
    count = max(1, min(workers or usable_workers(), len(items)))
    pool: Pool = processes if executor is None else lambda _: nullcontext(executor)
    ahead = count + 1 if executor is None else AHEAD  # one job waits while results are stored
    outcomes = _outcomes(pool, count, ahead, function, filter(ready, items))
    interval = 0.1 if sys.stderr.isatty() else 30.0  # [s]; a log keeps every state of the bar
    failures, ended = list[Failure](), 0
    with (
        closing(outcomes),
        tqdm(total=len(items), desc=label, disable=not label, mininterval=interval) as bar,
    ):
        for item, made in outcomes:
            ended += 1
            bar.update()
            if isinstance(made, Failure):
                failures.append(made)
                bar.set_postfix_str(f"{len(failures)} failed", refresh=False)
            else:
                yield item, made
    if failures:
        raise Failed(failures, ended)


def make_once(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    name: Callable[[Item], str],
    read: Callable[[Item], Result | None],
    save: Callable[[Item, Result], object],
    **how: Any,
) -> tuple[dict[str, Result], list[Failure]]:
    """Make the values that are not stored, each in one process at a time, and read the others.

    Args:
        function: makes the value of an item, as in `parallel`.
        items: one a value, in the order in which jobs begin.
        name: under which the value of an item is stored.
        read: the stored value of an item, or None.
        save: stores the value of an item.
        how: further arguments of `parallel`.

    Returns:
        The values by name, and the failures of items without a value.
    """
    found, failures, left = dict[str, Result](), list[Failure](), {name(one): one for one in items}
    locks = dict[str, FileLock]()

    def is_free(item: Item) -> bool:
        one = lock(name(item))
        try:
            one.acquire(timeout=0)
        except Timeout:
            return False
        locks[name(item)], value = one, read(item)
        if value is not None:
            keep(item, value)
        return value is None

    def keep(item: Item, value: Result) -> None:
        found[name(item)] = value
        locks.pop(name(item)).release()

    while left:
        try:
            for item, value in parallel(function, [*left.values()], ready=is_free, **how):
                save(item, value)
                keep(item, value)
        except Failed as error:
            failures += error.failures
        finally:
            for one in locks.values():
                one.release()
        left = {key: one for key, one in left.items() if key not in {*found, *locks}}
        if left:  # other processes are making these
            wait_for(next(iter(left))).lock.release()
    return found, failures


def _outcomes(
    pool: Pool, count: int, ahead: int, function: Callable[[Item], Any], items: Iterator[Item]
) -> Generator[tuple[Item, Any]]:
    """Every item with its result or its `Failure`."""
    while lost := (yield from _until_broken(pool(count), ahead, function, items)):
        for item in lost:
            for _ in range(ATTEMPTS - 1):
                if not (yield from _until_broken(pool(1), 1, function, iter([item]))):
                    break
            else:
                yield item, Failure(item, f"the loss of its process, {ATTEMPTS} times")


def _until_broken(
    pool: AbstractContextManager[Executor],
    ahead: int,
    function: Callable[[Item], Any],
    items: Iterator[Item],
) -> Generator[tuple[Item, Any], None, list[Item]]:
    """Yield items with their outcomes; return the jobs that were in progress when it broke."""
    pending, lost = dict[Future[bytes], Item](), list[Item]()
    with pool as executor:
        while True:
            for item in islice(items, 0 if lost else ahead - len(pending)):
                try:
                    pending[executor.submit(_call, function, item)] = item
                except BrokenExecutor:
                    lost.append(item)
            if not pending:
                return lost
            for future in wait(pending, WAIT, FIRST_COMPLETED).done:
                item = pending.pop(future)
                try:
                    made = pickle.loads(future.result())
                except BrokenExecutor:
                    lost.append(item)
                    continue
                except Exception as error:  # of the executor
                    made = _failure(error)
                del future  # as long as it is referenced, Dask repeats a job whose worker is lost
                yield item, made._replace(item=item) if isinstance(made, Failure) else made


def _call(function: Callable[[Item], Any], item: Item) -> bytes:
    """Make a call in a worker; executors lose errors and results that cannot be pickled."""
    try:
        return pickle.dumps(function(item))
    except (Exception, SystemExit) as error:
        return pickle.dumps(_failure(error))


def _failure(error: BaseException) -> Failure:
    """The failure of a job, whose item no worker may be able to pickle."""
    return Failure(None, f"{type(error).__name__}: {error}", traceback.format_exc())


@contextmanager
def processes(count: int) -> Iterator[Executor]:
    """A pool of fresh interpreters with one thread each, which end with the context."""
    from joblib.externals.loky import ProcessPoolExecutor

    # loky warns in its own thread of a worker that it replaces; an error would end that thread
    warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
    pool = ProcessPoolExecutor(
        count, env=ONE_THREAD, initializer=_end_with_parent, initargs=(os.getpid(),)
    )
    try:
        yield pool
    finally:
        pool.shutdown(kill_workers=True)


def _end_with_parent(parent: int) -> None:
    """End this worker when its parent has ended in any way; the parent handles Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WAIT)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def usable_workers() -> int:
    """The number of processes that cores and memory of this machine or container allow."""
    from joblib.externals.loky import cpu_count

    free = float(psutil.virtual_memory().available)
    if LIMIT.exists() and (limit := LIMIT.read_text().strip()).isdigit():
        free = min(free, float(limit))
    return max(1, min(int(cpu_count()), int(free / MEMORY)))

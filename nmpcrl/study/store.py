"""Where runs are kept: `fetch` and `fetch_all` train what is missing and read what is there.

A run's file is named by its experiment and by a key of everything that its numbers depend on: the
fields, the source of the mathematics (without comments and docstrings) and the library versions.
"""

import ast
import hashlib
import json
import os
import platform
import signal
import sys
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from multiprocessing import get_context
from pathlib import Path
from queue import Empty
from types import ModuleType
from typing import Any, TypeVar

from tqdm import tqdm

import nmpcrl
from nmpcrl.study.experiment import Experiment, compile_ahead, run
from nmpcrl.study.records import DamagedRecords, Records

LIBRARIES = ("casadi", "numba", "numpy", "torch")
MATHEMATICS = ("control", "learning", "study/paper.py", "study/experiment.py")
SPAWN = get_context("spawn")  # a fork would copy the threads' locks but not the threads
ATTEMPTS = 3  # how often a run is started whose worker was killed
THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")


Run = TypeVar("Run")  # Records, or the RunSummary of them


class Study(Mapping[Experiment, Run]):
    """Runs by experiment, in the order they were asked for."""

    def __init__(self, runs: Mapping[Experiment, Run]) -> None:
        self._runs = dict(runs)

    def __getitem__(self, experiment: Experiment) -> Run:
        return self._runs[experiment]

    def __iter__(self) -> Iterator[Experiment]:
        return iter(self._runs)

    def __len__(self) -> int:
        return len(self._runs)

    def select(self, **fields: Any) -> "Study[Run]":
        """The runs whose experiment has these field values: `select(learner="ES", seed=0)`."""
        return Study(
            {
                experiment: records
                for experiment, records in self.items()
                if all(getattr(experiment, name) == value for name, value in fields.items())
            }
        )

    def values_of(self, field: str) -> tuple[Any, ...]:
        """The values that a field takes, in order of appearance."""
        return tuple(dict.fromkeys(getattr(experiment, field) for experiment in self))


def fetch(experiment: Experiment, **options: Any) -> Records:
    """The run of `experiment`: read if it is stored, otherwise trained and stored.

    Args:
        experiment: names the run.
        options: as `run` takes them.
    """
    path = path_of(experiment)
    try:
        return Records.load(path)
    except FileNotFoundError:
        pass
    except DamagedRecords as error:
        aside = path.with_suffix(".damaged")
        path.replace(aside)
        print(f"{error}; it is kept as {aside.name} and the run is done again", file=sys.stderr)
    records = run(experiment, **options)
    records.facts.update(provenance(experiment))
    records.save(path)
    return records


def fetch_all(
    experiments: Iterable[Experiment],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> Study[Records]:
    """`fetch` for many: what is missing is trained in parallel, one thread a process.

    Args:
        experiments: the runs wanted.
        executor: runs them; by default processes, as many as `workers`. One that lost a worker is
            replaced only if it is the default.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar with episodes done, time left and the latest cost.

    Raises:
        RuntimeError: workers were killed again and again.
    """
    experiments = tuple(dict.fromkeys(experiments))
    for left in reversed(range(ATTEMPTS + 1)):
        missing = [e for e in experiments if not _is_whole(path_of(e))]
        if not missing:
            return Study({e: fetch(e) for e in experiments})
        if not left:
            break
        compile_ahead(missing)
        try:
            if executor is not None:
                _train(missing, executor, progress=progress)
            else:
                with processes(min(workers or os.cpu_count() or 1, len(missing))) as pool:
                    _train(missing, pool, progress=progress)
        except BrokenProcessPool:
            if executor is not None:
                raise
    names = ", ".join(str(e) for e in missing)
    raise RuntimeError(f"workers were killed {ATTEMPTS} times; these runs are missing: {names}")


def stored() -> dict[Path, tuple[dict[str, Any], dict[str, Any]]]:
    """Every whole run in the folder: its experiment's fields and its facts, by path."""
    whole = {}
    for path in sorted(folder().glob("*.npz")):
        try:
            whole[path] = Records.about(path)
        except DamagedRecords as error:
            print(f"{error}; it is left alone", file=sys.stderr)
    return whole


def folder() -> Path:
    """Where runs are kept: `runs`, or what the environment variable NMPCRL_RUNS says."""
    return Path(os.environ.get("NMPCRL_RUNS", "runs"))


def path_of(experiment: Experiment) -> Path:
    """The file of one experiment."""
    return folder() / f"{name_of(experiment)}-{key(experiment)[:10]}.npz"


def name_of(experiment: Experiment) -> str:
    """The run's name for people; the key says the rest."""
    e = experiment
    return f"{e.learner}-{e.layout}-{e.decay}-seed{e.seed}-{e.episodes}ep"


def provenance(experiment: Experiment) -> dict[str, Any]:
    """The facts that say where a run was made, and what its numbers depend on."""
    return {"versions": versions(), "machine": platform.machine(), "key": key(experiment)}


def key(experiment: Experiment) -> str:
    """A hash of all that the run's numbers depend on."""
    depends = [asdict(experiment), versions(), _mathematics()]
    return hashlib.sha256(json.dumps(depends, sort_keys=True).encode()).hexdigest()


def versions() -> dict[str, str]:
    """The versions that a run depends on."""
    return {"python": platform.python_version(), **{name: _version(name) for name in LIBRARIES}}


def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:  # only numba may be missing: fatrop then solves
        return "absent"


@cache
def _mathematics() -> str:
    return source_hash(MATHEMATICS)


def source_hash(places: Iterable[str]) -> str:
    """A hash of the source in some places, without comments, docstrings and layout."""
    root = Path(nmpcrl.__file__).parent
    found = hashlib.sha256()
    for place in places:
        path = root / place
        for file in sorted(path.glob("*.py")) if path.is_dir() else [path]:
            tree = ast.parse(file.read_text())
            for node in ast.walk(tree):
                documented = ast.Module | ast.ClassDef | ast.FunctionDef
                if isinstance(node, documented) and ast.get_docstring(node) is not None:
                    del node.body[0]
            found.update(ast.dump(tree).encode())
    return found.hexdigest()


def _is_whole(path: Path) -> bool:
    try:
        Records.about(path)
    except DamagedRecords:
        return False
    return True


def processes(workers: int) -> ProcessPoolExecutor:
    """Worker processes with one thread each; the setting is inherited, so it is made here."""
    os.environ.update(dict.fromkeys(THREADS, "1"))
    quiet = (signal.SIGINT, signal.SIG_DFL)  # an interrupt ends a worker without a traceback
    return ProcessPoolExecutor(workers, SPAWN, initializer=signal.signal, initargs=quiet)


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


def _train(missing: list[Experiment], executor: Executor, *, progress: bool) -> None:
    """Run `missing` and show how far they are; the first failure is raised when all have ended."""
    total = sum(e.episodes for e in missing)
    with (
        tqdm(total=total, unit="ep", disable=not progress, mininterval=interval()) as bar,
        without_main(),
        SPAWN.Manager() as manager,
    ):
        reports = manager.Queue()
        pending = {executor.submit(_fetch_and_report, e, reports) for e in missing}
        ended: set[Future[None]] = set()
        while pending:
            done, pending = wait(pending, timeout=0.3)
            ended |= done
            bar.set_description(f"{len(ended)}/{len(missing)} runs", refresh=False)
            _show(reports, bar)
        for future in ended:
            future.result()


def interval() -> float:
    """Seconds between two states of the bar: a log keeps every one, a terminal the last."""
    return 0.1 if sys.stderr.isatty() else 30.0


def _fetch_and_report(experiment: Experiment, reports: Any) -> None:
    """What a worker does; its records go to disk, not through the pipe."""
    done = 0

    def on_episode(episode: int, cost: float) -> None:
        nonlocal done
        reports.put((str(experiment), episode - done, cost))
        done = episode

    fetch(experiment, on_episode=on_episode)
    reports.put((str(experiment), experiment.episodes - done, None))


def _show(reports: Any, bar: tqdm) -> None:
    """Move the bar by all that has been reported."""
    while True:
        try:
            name, episodes, cost = reports.get_nowait()
        except Empty:
            return
        bar.update(episodes)
        if cost is not None:
            bar.set_postfix_str(f"{name}: cost {cost:.0f}", refresh=False)

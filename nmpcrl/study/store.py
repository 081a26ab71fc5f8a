"""Runs on disk: `fetch` and `fetch_all` read stored runs, and train and store the others.

A file is named by its experiment or trial and by the key of `provenance`. The lock `.locks/NAME`
lets one process at a time train a run; the system frees it when the process ends.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from filelock import FileLock, Timeout

from nmpcrl.study import lock
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.files import DamagedRecords, say, unwritable
from nmpcrl.study.files import StoreError as StoreError
from nmpcrl.study.files import check_folder as check_folder
from nmpcrl.study.files import folder as folder
from nmpcrl.study.geometry import short_name
from nmpcrl.study.jobs import Failed, Failure, parallel
from nmpcrl.study.limits import seconds_of
from nmpcrl.study.lock import is_accepted, signature, warn_of_changes
from nmpcrl.study.machine import fingerprint
from nmpcrl.study.provenance import before, environment, identity, key
from nmpcrl.study.records import About, Facts, Records
from nmpcrl.study.run import run
from nmpcrl.study.setup import compile_ahead
from nmpcrl.study.trial import Trial

Run = TypeVar("Run")
Named = Experiment | Trial  # names a run
TRIALS = "trials"  # subfolder of their runs
LOCKS = ".locks"
STEP, REST = 350, 20_000  # bytes of a file, at most


class OtherCode(RuntimeError):
    """A worker has other code, or other versions of libraries."""


class Runs(Mapping[Experiment, Run]):
    """Runs by experiment, in the order they were asked for."""

    def __init__(self, runs: Mapping[Experiment, Run]) -> None:
        self._runs = dict(runs)

    def __getitem__(self, experiment: Experiment) -> Run:
        return self._runs[experiment]

    def __iter__(self) -> Iterator[Experiment]:
        return iter(self._runs)

    def __len__(self) -> int:
        return len(self._runs)

    def select(self, **fields: Any) -> "Runs[Run]":
        """The runs whose experiment has these field values: `select(learner="ES", seed=0)`."""
        return Runs(
            {
                experiment: records
                for experiment, records in self.items()
                if all(getattr(experiment, name) == value for name, value in fields.items())
            }
        )

    def values_of(self, field: str) -> tuple[Any, ...]:
        """The values that a field takes, in order of appearance."""
        return tuple(dict.fromkeys(getattr(experiment, field) for experiment in self))


Value = TypeVar("Value")  # Records or a summary: has experiment, facts, save, load and about


class Store(Generic[Value]):
    """Values of one kind in files, one for each experiment or trial."""

    def __init__(
        self, kind: Any, make: Callable[..., Value], key: Callable[[Any], str], subfolder: str = ""
    ) -> None:
        """A store in a subfolder of the runs, by the class of its values.

        `make` is called in workers; the beginning of `key` is part of a file's name.
        """
        self.kind, self.make, self.key, self.subfolder = kind, make, key, subfolder

    def path_of(self, named: Named) -> Path:
        """The file of one value."""
        place = folder() / (TRIALS if isinstance(named, Trial) else self.subfolder)
        return place / f"{name_of(named)}-{self.key(named)[:10]}.npz"

    def read(self, named: Named) -> Value:
        """The stored value.

        Raises:
            FileNotFoundError: there is none.
            DamagedRecords: the file is damaged, or of another run.
        """
        warn_of_changes()
        path = self.path_of(named)
        value: Any = self.kind.load(path)
        check_run(path, named, value.experiment, value.facts)
        return value  # type: ignore[no-any-return]

    def is_stored(self, named: Named) -> bool:
        """Whether a file names the value and its key; `read` alone checks its tables."""
        path = self.path_of(named)
        try:
            check_run(path, named, *self.kind.about(path))
        except (FileNotFoundError, DamagedRecords):
            return False
        return True

    def fetch(self, named: Named, **options: Any) -> Value:
        """The value: read if it is stored, otherwise made with these options and stored.

        Raises:
            StoreError: it is not stored, and cannot be.
        """
        try:
            return self.read(named)
        except (FileNotFoundError, DamagedRecords):
            check_folder(_size_of(named))
        with self._alone(named):
            value = self.read_or_set_aside(named)
            if value is None:
                value = self.make(named, **options)
                self.keep(named, value)
            return value

    def fetch_all(
        self, names: Iterable[Named], *, label: str = "", strict: bool = True, **options: Any
    ) -> dict[Any, Value]:
        """`fetch` for many: `parallel` makes missing values with these options, the longest first.

        Values that another process is making come last.

        Raises:
            StoreError: values are missing and cannot be stored.
            Failed: values could not be made, and `strict` holds; all others are stored.
        """
        wanted, found = tuple(dict.fromkeys(names)), dict[Any, Value]()
        for named in wanted:
            with suppress(FileNotFoundError, DamagedRecords):
                found[named] = self.read(named)
        missing = sorted((one for one in wanted if one not in found), key=_seconds_of, reverse=True)
        if missing:
            check_folder(sum(map(_size_of, missing)))
            compile_ahead(missing)
        failures, make = list[Failure](), partial(_make, self.make, signature())
        while missing:
            left = _Reserved(self, missing, found)
            try:
                for named, value in parallel(make, left, label=label, **options):
                    self.keep(named, value)
                    found[named] = value
                    left.locks.pop(named).release()
            except Failed as error:
                failures += error.failures
            finally:
                for lock in left.locks.values():
                    lock.release()
            if missing := left.others:
                self._alone(missing[0]).lock.release()
        if failures and strict:
            raise Failed(failures, len(wanted))
        if failures:
            say(str(Failed(failures, len(wanted))))
        return {one: found[one] for one in wanted if one in found}

    def keep(self, named: Named, value: Any) -> None:
        """Store a value, unless another solver than the experiment's made it.

        Raises:
            StoreError: the file cannot be written.
        """
        if other := solved_by_another(named, value.facts):
            say(f"{named} is not stored: it was {other}")
            return
        path = self.path_of(named)
        try:
            value.save(path)
        except OSError as error:
            raise unwritable(path, error) from error

    def lock(self, named: Named) -> FileLock:
        """The lock of a value; not acquired."""
        locks = folder() / LOCKS
        locks.mkdir(parents=True, exist_ok=True)
        return FileLock(locks / self.path_of(named).stem, thread_local=False)

    def _alone(self, named: Named) -> Any:
        """Wait for the lock of a value."""
        lock = self.lock(named)
        try:
            return lock.acquire(timeout=0)
        except Timeout:
            say(f"{named} is being trained by another process; waiting for it")
            return lock.acquire()

    def read_or_set_aside(self, named: Named) -> Value | None:
        """The stored value; a damaged file is renamed. For the process that has the lock."""
        path = self.path_of(named)
        try:
            return self.read(named)
        except FileNotFoundError:
            return None
        except DamagedRecords as error:
            aside = path.with_suffix(".damaged")
            path.replace(aside)
            say(f"{error}; it is now {aside.name}, and the run is made again")
            return None


class _Reserved(Generic[Value]):
    """Missing values whose lock this process gets; each is locked when it is drawn."""

    def __init__(self, store: Store[Value], names: list[Named], found: dict[Any, Value]) -> None:
        self.store, self.names, self.found = store, names, found
        self.locks = dict[Named, FileLock]()
        self.others = list[Named]()  # locked by other processes

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[Named]:
        for named in self.names:
            lock = self.store.lock(named)
            try:
                lock.acquire(timeout=0)
            except Timeout:
                self.others.append(named)
                continue
            self.locks[named] = lock
            value = self.store.read_or_set_aside(named)
            if value is None:
                yield named
            else:  # stored meanwhile
                self.found[named] = value
                self.locks.pop(named).release()


def _make(make: Callable[[Named], Value], expected: str, named: Named) -> Value:
    """Make a value in a worker that has the `signature` of the process that asked."""
    if signature() != expected:
        raise OtherCode("the worker has other code, or other versions of libraries")
    return make(named)


def _size_of(named: Named) -> int:
    """Bytes of a file, at most."""
    return named.episodes * named.steps * STEP + REST


def _seconds_of(named: Named) -> float:
    return seconds_of(named) if isinstance(named, Experiment) else 0.0


def train(named: Named, **options: Any) -> Records:
    """The records of a run; their facts name versions, machine, key and sources."""
    records = run(named, **options)
    facts: Facts = records.facts | {
        "versions": environment(),
        "machine": fingerprint(),
        "key": key(named),
        "sources": lock.sources_hash(),
    }
    return replace(records, facts=facts)


RUNS = Store(Records, train, key)


def fetch(experiment: Named, **options: Any) -> Records:
    """The run of an experiment or a trial: read if it is stored, otherwise trained and stored.

    A run that another solver had to solve is returned, and not stored.

    Args:
        experiment: names the run.
        options: as `run` takes them.

    Raises:
        StoreError: the run is not stored, and could not be.
    """
    return RUNS.fetch(experiment, **options)


def fetch_all(
    experiments: Iterable[Named],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> Runs[Records]:
    """`fetch` for many: missing runs are trained in parallel, one thread a process.

    Args:
        experiments: the runs wanted, trials among them.
        executor: trains them, such as a Dask client's; by default new processes.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar.

    Raises:
        StoreError: runs are missing and cannot be stored.
        Failed: runs could not be trained; the others are stored.
    """
    label = "runs" if progress else ""
    return Runs(RUNS.fetch_all(experiments, executor=executor, workers=workers, label=label))


path_of, read, is_stored = RUNS.path_of, RUNS.read, RUNS.is_stored


def solved_by_another(experiment: Named, facts: Facts) -> str:
    """By which solver a run was solved, if not by the one that its experiment names."""
    solver = facts["solver"]
    same = solver == experiment.solver
    return "" if same else f"solved by {solver} and not by {experiment.solver}"


def check_run(path: Path, experiment: Named, fields: Mapping[str, Any], facts: Facts) -> None:
    """Refuse a file of another run, or of code with other numbers, by what it states.

    Raises:
        DamagedRecords: the message says what the file holds.
    """
    if isinstance(experiment, Trial):
        if fields != experiment.stated or "key" not in facts:
            raise DamagedRecords(f"{path} holds another run")
    else:
        try:
            stated = Experiment(**{**before(), **fields})
        except (TypeError, ValueError) as error:
            raise DamagedRecords(f"{path} does not say which run it is") from error
        if identity(stated) != identity(experiment):
            raise DamagedRecords(f"{path} holds another run, {name_of(stated)}")
    if facts.get("key", key(experiment)) != key(experiment):
        raise DamagedRecords(f"{path} holds a run of other code or other versions than it says")
    if not is_accepted(facts.get("sources")):
        raise DamagedRecords(f"{path} holds a run of code that is neither this nor locked")
    if other := solved_by_another(experiment, facts):
        raise DamagedRecords(f"{path} holds a run {other}")


def stored() -> dict[Path, About]:
    """Every run in the folder: its experiment's fields and its facts, by path.

    Raises:
        StoreError: the folder cannot be read.
    """
    try:
        paths = sorted(folder().iterdir())
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise StoreError(f"{folder()} cannot be read ({error.strerror})") from error
    found = {}
    for path in filter(lambda path: path.suffix == ".npz", paths):
        try:
            found[path] = Records.about(path)
        except (OSError, DamagedRecords) as error:
            say(f"{error}; it is ignored")
    return found


def name_of(experiment: Named) -> str:
    """The run's name for people; the key says the rest."""
    e = experiment
    if isinstance(e, Trial):
        return e.name
    return f"{e.learner}-{short_name(e.layout)}-{e.decay}-seed{e.seed}-{e.episodes}ep"

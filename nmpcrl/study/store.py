"""Runs on disk: `fetch` and `fetch_all` read stored runs, and train and store the others.

A file is named by its experiment or trial and by the key of `provenance`. The lock `.locks/NAME`
lets one process at a time train a run; the system frees it when the process ends.
"""

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from nmpcrl.study import lock
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.files import StoreError, check_folder, folder, say, unwritable, wait_for
from nmpcrl.study.geometry import short_name
from nmpcrl.study.jobs import Failed, make_once
from nmpcrl.study.limits import seconds_of
from nmpcrl.study.machine import fingerprint
from nmpcrl.study.provenance import environment, key
from nmpcrl.study.records import About, DamagedRecords, Records, load_run
from nmpcrl.study.run import run
from nmpcrl.study.setup import compile_ahead
from nmpcrl.study.trial import Trial

Value = TypeVar("Value")  # of a store: Records or a RunSummary
Named = Experiment | Trial  # names a run


class Runs(dict[Experiment, Value]):
    """Runs by experiment, in the order they were asked for."""

    def select(self, **fields: Any) -> "Runs[Value]":
        """The runs whose experiment has these field values: `select(learner="ES", seed=0)`."""
        asked = fields.items()
        chosen = (e for e in self if all(getattr(e, name) == value for name, value in asked))
        return Runs({e: self[e] for e in chosen})

    def values_of(self, field: str) -> tuple[Any, ...]:
        """The values that a field takes, in order of appearance."""
        return tuple(dict.fromkeys(getattr(e, field) for e in self))


@dataclass(eq=False)
class Store(Generic[Value]):
    """Values of one class in files, one for each experiment or trial."""

    kind: Any  #: the class
    make: Callable[..., Value]  #: called in workers
    key: Callable[[Any], str]  #: its beginning is in the name of a file
    subfolder: str = ""  #: of the folder of the runs

    def path_of(self, named: Named) -> Path:
        """The file of a value."""
        if isinstance(named, Trial):
            place, name = "trials", named.name
        else:
            e, place = named, self.subfolder
            name = f"{e.learner}-{short_name(e.layout)}-{e.decay}-seed{e.seed}-{e.episodes}ep"
        return folder() / place / f"{name}-{self.key(named)[:10]}.npz"

    def read(self, named: Named, *, report: bool = False) -> Value | None:
        """The stored value, or None; `report` prints why a file that exists cannot be used."""
        lock.warn_of_changes()
        path = self.path_of(named)
        try:
            value: Any = self.kind.load(path)
            if why := refused(named, value.facts):
                raise DamagedRecords(f"{path} holds {why}")
        except FileNotFoundError:
            return None
        except DamagedRecords as error:
            if report:
                say(f"{error}; the run is made again")
            return None
        return value  # type: ignore[no-any-return]

    def fetch(self, named: Named, **options: Any) -> Value:
        """The run of an experiment or a trial: read if it is stored, otherwise made and stored.

        `options` are options of `run`. A run that another solver had to solve is returned, but not
        stored. StoreError says why no run can be stored.
        """
        value = self.read(named)
        if value is None:
            check_folder()
            with wait_for(self.path_of(named).stem):
                value = self.read(named, report=True)
                if value is None:
                    value = self.make(named, **options)
                    self.save(named, value)
        return value

    def fetch_all(
        self,
        names: Iterable[Named],
        *,
        executor: Executor | None = None,
        workers: int | None = None,
        progress: bool = True,
        strict: bool = True,
    ) -> Runs[Value]:
        """`fetch` for many: missing runs are made in parallel, one thread a process.

        Args:
            names: experiments and trials.
            executor: makes the runs, such as a Dask client's; by default new processes.
            workers: how many processes; by default as many as there are cores.
            progress: whether to show a bar.
            strict: whether `Failed` is raised once all other runs are stored, or only printed.
        """
        wanted: tuple[Any, ...] = tuple(dict.fromkeys(names))
        found = {one: value for one in wanted if (value := self.read(one)) is not None}
        missing = [one for one in wanted if one not in found]
        missing.sort(key=lambda one: -seconds_of(one) if isinstance(one, Experiment) else 0.0)
        if missing:
            check_folder()
            compile_ahead(missing)
        made, failures = make_once(
            self.make,
            missing,
            lambda one: self.path_of(one).stem,
            partial(self.read, report=True),
            self.save,
            workers=workers,
            label="runs" if progress else "",
            executor=executor,
        )
        found |= {one: made[name] for one in missing if (name := self.path_of(one).stem) in made}
        if failures:
            failed = Failed(failures, len(wanted))
            if strict:
                raise failed
            say(str(failed))
        return Runs({one: found[one] for one in wanted if one in found})

    def save(self, named: Named, value: Any) -> None:
        """Store a value, unless another solver than the experiment's made it.

        StoreError: a worker with other code made it, or the file cannot be written.
        """
        if why := refused(named, value.facts):
            sentence = f"{named} is not stored: the worker made {why}"
            if value.facts["solver"] == named.solver:
                raise StoreError(sentence)
            say(sentence)
            return
        path = self.path_of(named)
        try:
            value.save(path)
        except OSError as error:
            raise unwritable(path, error) from error


def train(named: Named, **options: Any) -> Records:
    """The records of a run; their facts name versions, machine, key and sources."""
    records = run(named, **options)
    facts = records.facts | {
        "versions": environment(),
        "machine": fingerprint(),
        "key": key(named),
        "sources": lock.sources_hash(),
    }
    return replace(records, facts=facts)


RUNS = Store(Records, train, key)
fetch, fetch_all = RUNS.fetch, RUNS.fetch_all


def refused(named: Named, facts: Mapping[str, Any]) -> str:
    """Why a run with these facts is not the named one, or not one of this code; empty if it is."""
    if facts.get("key") != key(named):
        return "another run, or one of other versions of libraries"
    if not lock.is_accepted(facts.get("sources")):
        return "a run of code that is neither this nor locked"
    solver = facts["solver"]
    return "" if solver == named.solver else f"a run solved by {solver} and not by {named.solver}"


def stored() -> dict[Path, About]:
    """Every run of an experiment in the folder, by path: its fields and its facts."""
    found = {}
    for path in sorted(folder().glob("*.npz")):
        try:
            found[path], _ = load_run(path, {})
        except (OSError, DamagedRecords) as error:
            say(f"{error}; it is ignored")
    return found

"""Where runs are kept: `fetch` and `fetch_all` train what is missing and read what is there.

A run's file is named by its experiment and by the key of `provenance`.
"""

import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from nmpcrl.study.executor import execute
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.provenance import key, provenance, warn_of_changes
from nmpcrl.study.records import DamagedRecords, Records
from nmpcrl.study.run import run
from nmpcrl.study.setup import compile_ahead

Run = TypeVar("Run")  # Records, or a summary of them


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


def fetch(experiment: Experiment, **options: Any) -> Records:
    """The run of `experiment`: read if it is stored, otherwise trained and stored.

    Args:
        experiment: names the run.
        options: as `run` takes them.
    """
    path = path_of(experiment)
    try:
        records = Records.load(path)
        warn_of_changes()
        return records
    except FileNotFoundError:
        pass
    except DamagedRecords as error:
        set_aside(path, error)
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
) -> Runs[Records]:
    """`fetch` for many: what is missing is trained in parallel, one thread a process.

    Args:
        experiments: the runs wanted.
        executor: trains them, on workers that see the same folder; by default processes.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar with episodes done, time left and the latest cost.

    Raises:
        Exception: what the first of them raised that could not be trained; the others are stored.
    """
    experiments = tuple(dict.fromkeys(experiments))
    missing = [e for e in experiments if not _is_whole(path_of(e))]
    compile_ahead(missing)
    failures = execute(
        {e: partial(_fetch_quietly, e) for e in missing},
        lambda e, cost: f"{e}: cost {cost:.0f}",
        executor=executor,
        workers=workers,
        progress=progress,
        size=lambda e: e.episodes,
        unit="ep",
    )
    for error in failures.values():
        raise error
    return Runs({e: fetch(e) for e in experiments})


def _fetch_quietly(experiment: Experiment) -> float:
    """What a worker does: its records go to disk, not through the pipe; the final cost does."""
    return float(fetch(experiment).facts["final_cost"])


def stored() -> dict[Path, tuple[dict[str, Any], dict[str, Any]]]:
    """Every whole run in the folder: its experiment's fields and its facts, by path."""
    whole = {}
    for path in sorted(folder().glob("*.npz")):
        try:
            whole[path] = Records.about(path)
        except DamagedRecords as error:
            print(f"{error}; it is left alone", file=sys.stderr)
    return whole


def set_aside(path: Path, error: DamagedRecords) -> None:
    """Keep a damaged file under another name, and say so."""
    aside = path.with_suffix(".damaged")
    path.replace(aside)
    print(f"{error}; it is kept as {aside.name} and made again", file=sys.stderr)


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


def _is_whole(path: Path) -> bool:
    try:
        Records.about(path)
    except DamagedRecords:
        return False
    return True

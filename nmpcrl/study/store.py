"""Where runs are kept: `fetch` and `fetch_all` train what is missing and read what is there.

A run's file is named by its experiment or its trial and by the key of `provenance`. A file that is
damaged or of another run is set aside, and the run is done again. A trained run is not lost, even
if it cannot be written. Runs that another process trains in the same folder are awaited.
"""

import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from nmpcrl.study.experiment import Experiment
from nmpcrl.study.geometry import short_name
from nmpcrl.study.provenance import (
    before,
    identity,
    is_accepted,
    key,
    locked_hash,
    provenance,
    warn_of_changes,
)
from nmpcrl.study.records import About, DamagedRecords, Facts, Records, most_evaluations
from nmpcrl.study.run import run
from nmpcrl.study.setup import compile_ahead
from nmpcrl.study.storage.executor import execute
from nmpcrl.study.storage.place import (
    StoreError,
    check_folder,
    folder,
    keep,
    refusal,
    say,
    set_aside,
)
from nmpcrl.study.storage.reservation import reservations, reserved
from nmpcrl.study.trial import Trial

__all__ = [
    "Runs",
    "StoreError",
    "check_folder",
    "fetch",
    "fetch_all",
    "folder",
    "is_stored",
    "name_of",
    "path_of",
    "stored",
]

Run = TypeVar("Run")  # Records, or a summary of them
Named = Experiment | Trial  # what names a run
TRIALS = "trials"  # the folder of their runs, in that of the others
NUMBERS = 20  # at most, of a step beside its vectors

POLL = 0.25  # seconds between two looks at what others are at
STEP, ROLLOUT_STEP, REST = 300, 40, 20_000  # bytes that a run's file takes at most


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


def fetch(experiment: Named, **options: Any) -> Records:
    """The run of an experiment or a trial: read if it is stored, otherwise trained and stored.

    A run that another solver had to solve is returned, and not stored.

    Args:
        experiment: names the run.
        options: as `run` takes them.

    Raises:
        StoreError: the run is not stored, and could not be.
    """
    try:
        return read(experiment)
    except (FileNotFoundError, DamagedRecords):
        check_folder(size_of(experiment))
    name = path_of(experiment).name
    with reserved(folder(), name, lambda: wait_for([name], experiment)):
        return _read_or_train(experiment, **options)[0]


def fetch_all(
    experiments: Iterable[Named],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> Runs[Records]:
    """`fetch` for many: what is missing is trained in parallel, one thread a process.

    Args:
        experiments: the runs wanted, trials among them.
        executor: trains them, on workers that see the same folder; by default processes.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar with episodes done, time left and the latest cost.

    Raises:
        StoreError: runs are missing and cannot be stored; nothing is trained.
        Exception: what the first of them raised that could not be trained; the others are stored.
    """
    experiments = tuple(dict.fromkeys(experiments))
    missing = [e for e in experiments if not is_stored(e)]
    if missing:
        check_folder(sum(map(size_of, missing)))
        compile_ahead(missing)
    unstored: dict[Named, Records] = {}
    options = {"executor": executor, "workers": workers, "progress": progress}
    while missing:
        missing = _train(missing, unstored, **options)
    found: dict[Any, Records] = {e: unstored[e] if e in unstored else fetch(e) for e in experiments}
    return Runs(found)


def _train(missing: list[Named], unstored: dict[Named, Records], **options: Any) -> list[Named]:
    """Train what nobody else is at; what is left, once one of those is no longer."""
    left = _elsewhere(missing)

    def keep(experiment: Named, trained: _Trained | None) -> str:
        if trained is None:
            left.append(experiment)
            return ""
        if trained.unstored:
            unstored[experiment] = trained.unstored
        return f"{experiment}: cost {trained.cost:.0f}"

    failures = execute(
        {e: partial(_fetch_quietly, e) for e in missing if e not in left},
        keep,
        size=lambda e: e.episodes,
        unit="ep",
        **options,
    )
    for error in failures.values():
        raise error
    if left:
        wait_for([path_of(e).name for e in left], left[0])
    return left


def _elsewhere(experiments: list[Named]) -> list[Named]:
    """Those that somebody is at."""
    taken = reservations(folder()).taken(path_of(e).name for e in experiments)
    return [e for e in experiments if path_of(e).name in taken]


class _Trained(NamedTuple):
    """What a worker hands back: its records go to disk and not through the pipe, if they can."""

    cost: float
    unstored: Records | None


def _fetch_quietly(experiment: Named) -> _Trained | None:
    """What a worker does; None if somebody else is at the run."""
    mine, name = reservations(folder()), path_of(experiment).name
    if not mine.take([name]):
        return None
    try:
        records, is_kept = _read_or_train(experiment)
    finally:
        mine.release([name])
    return _Trained(float(records.facts["final_cost"]), None if is_kept else records)


def read(experiment: Named) -> Records:
    """The stored run.

    Raises:
        FileNotFoundError: there is none.
        DamagedRecords: it is not whole, or another run.
    """
    path = path_of(experiment)
    records = Records.load(path)
    check_run(path, experiment, records.experiment, records.facts)
    warn_of_changes()
    return records


def _read_or_train(experiment: Named, **options: Any) -> tuple[Records, bool]:
    """The run, and whether it is where it belongs; for who has reserved it."""
    path = path_of(experiment)
    try:
        return read(experiment), True
    except FileNotFoundError:
        pass
    except DamagedRecords as error:
        set_aside(path, error)
    records = run(experiment, **options)
    records = replace(records, facts={**records.facts, **provenance(experiment)})
    if other := solved_by_another(experiment, records.facts):
        say(f"{experiment} is not stored: it was {other}")
        return records, False
    return records, keep(path, records.save)


def solved_by_another(experiment: Named, facts: Facts) -> str:
    """By which solver a run was solved, if not by the one that its experiment names."""
    solver = facts["solver"]
    same = solver == experiment.solver
    return "" if same else f"solved by {solver} and not by {experiment.solver}"


def check_run(path: Path, experiment: Named, fields: Mapping[str, Any], facts: Facts) -> None:
    """See that a file is of the run asked for.

    Args:
        path: of the file.
        experiment: names the run.
        fields: of the experiment that the file names, or what a trial states.
        facts: that it states.

    Raises:
        DamagedRecords: it is of another run, or of code with other numbers.
    """
    if isinstance(experiment, Trial):
        if fields != experiment.stated or "key" not in facts:
            raise DamagedRecords(f"{path} holds another run")
    else:
        stated = Experiment(**{**before(), **fields})
        if identity(stated) != identity(experiment):
            raise DamagedRecords(f"{path} holds another run, {name_of(stated)}")
    if facts.get("key", key(experiment)) != key(experiment):
        raise DamagedRecords(f"{path} holds a run of other code or other versions than it says")
    if not is_accepted(facts.get("sources", locked_hash())):
        raise DamagedRecords(f"{path} holds a run of code that is neither this nor locked")
    if other := solved_by_another(experiment, facts):
        raise DamagedRecords(f"{path} holds a run {other}")


def is_stored(experiment: Named) -> bool:
    """Whether there is a file that says it is the run; all of it is read only by `fetch`."""
    return is_there(path_of(experiment), experiment, Records.about)


def is_there(
    path: Path,
    experiment: Named,
    about: Callable[[Path], About],
) -> bool:
    """Whether a file says that it is of a run; `about` reads that."""
    try:
        check_run(path, experiment, *about(path))
    except (FileNotFoundError, DamagedRecords):
        return False
    return True


def stored() -> dict[Path, About]:
    """Every run in the folder: its experiment's fields and its facts, by path.

    Raises:
        StoreError: there is no such folder, but something else, or it cannot be read.
    """
    try:
        paths = sorted(folder().iterdir())
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise StoreError(refusal(f"cannot be read ({error.strerror})")) from error
    whole = {}
    for path in filter(lambda path: path.suffix == ".npz", paths):
        try:
            about = Records.about(path)
            _check_name(path, about)
            whole[path] = about
        except (FileNotFoundError, DamagedRecords) as error:
            say(f"{error}; it is ignored")
    return whole


def _check_name(path: Path, about: About) -> None:
    """See that a file which has the name of a run has that of its own."""
    own = f"{name_of(Experiment(**about.experiment))}-{about.facts.get('key', '')[:10]}"
    if re.fullmatch(r".*-seed\d+-\d+ep-[0-9a-f]{10}", path.stem) and path.stem != own:
        raise DamagedRecords(f"{path} holds another run, {own}")


def size_of(experiment: Named) -> int:
    """How many bytes the file of a run takes at most."""
    e, step = experiment, STEP
    if isinstance(e, Trial):
        step = 8 * (NUMBERS + e.nmpc.n + e.nmpc.m + 3 * len(e.theta))
    return e.steps * (step * e.episodes + ROLLOUT_STEP * most_evaluations(e)) + REST


def wait_for(names: list[str], first: Named) -> None:
    """Say that another process is training runs, and wait until it has finished one."""
    more = len(names) - 1
    others = f"{more} other{'s' * (more > 1)}"
    said = f"{first} and {others} are" if more else f"{first} is"
    say(f"{said} being trained by another process; waiting for it")
    while len(reservations(folder()).taken(names)) == len(names):
        time.sleep(POLL)


def path_of(experiment: Named) -> Path:
    """The file of one run."""
    place = folder() / TRIALS if isinstance(experiment, Trial) else folder()
    return place / f"{name_of(experiment)}-{key(experiment)[:10]}.npz"


def name_of(experiment: Named) -> str:
    """The run's name for people; the key says the rest."""
    e = experiment
    if isinstance(e, Trial):
        return e.name
    return f"{e.learner}-{short_name(e.layout)}-{e.decay}-seed{e.seed}-{e.episodes}ep"

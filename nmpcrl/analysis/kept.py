"""Results kept one by one in the folder of the runs, so that what was interrupted goes on.

A file holds what an entry did with one budget, by layout and seed. It is named by both, and by a
hash of all that the numbers depend on besides. Whoever makes the same at the same time does it
twice, with the same result.
"""

import json
import re
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from filelock import FileLock

from nmpcrl.study.provenance import hash_of, is_accepted, sources_hash
from nmpcrl.study.storage.atomic import write_json
from nmpcrl.study.storage.executor import execute
from nmpcrl.study.storage.place import check_folder, folder, keep, say


class Wanted(NamedTuple):
    """An entry in one layout with one seed."""

    entry: str
    budget: int  # episodes
    layout: str  # its name
    seed: int


class Timed(Protocol):
    """A result that says what it took."""

    @property
    def seconds(self) -> float:
        """Of processor time."""


Result = TypeVar("Result", bound=Timed)


@dataclass(frozen=True)
class Kept(Generic[Result]):
    """The results of one kind."""

    place: str  # a folder in that of the runs
    result: type[Result]  # a dataclass whose fields JSON can hold
    depends_on: Callable[[], dict[str, Any]]  # all that the numbers do, beside what is wanted

    def complete(
        self,
        wanted: Iterable[Wanted],
        make: Callable[[Wanted], Result],
        *,
        before: Callable[[Iterable[Wanted]], None],
        said: Callable[[Wanted, Result], str],
        workers: int | None = None,
        progress: bool = True,
    ) -> dict[Wanted, Result]:
        """Read what is kept, make the rest in parallel, and keep it as soon as it is there.

        Args:
            wanted: in the order in which they begin.
            make: what is missing, in a process of its own.
            before: called once with what is missing, if anything is.
            said: what the bar says of a result.
            workers: how many processes; by default as many as there are cores.
            progress: whether to show a bar.

        Raises:
            StoreError: something is missing and could not be kept; nothing is made.
            Exception: what the first raised that failed; the others are kept.
        """
        every = tuple(dict.fromkeys(wanted))
        found = self.stored(every)
        missing = [one for one in every if one not in found]
        if missing:
            check_folder()
            before(missing)

        def put(one: Wanted, made: Result) -> str:
            found[one] = made
            self._keep(one, made)
            return said(one, made)

        failures = execute(
            {one: partial(make, one) for one in missing},
            put,
            workers=workers,
            progress=progress,
            size=lambda one: one.budget,
            unit="ep",
        )
        for error in failures.values():
            raise error
        return {one: found[one] for one in every}

    def stored(self, wanted: Iterable[Wanted]) -> dict[Wanted, Result]:
        """Those of them that are kept."""
        every = tuple(wanted)
        paths = {one: self.path_of(one) for one in every}
        files = {path: self._read(path) for path in {*paths.values()}}
        return {
            one: files[path][one.layout, one.seed]
            for one, path in paths.items()
            if (one.layout, one.seed) in files[path]
        }

    def path_of(self, one: Wanted) -> Path:
        """The file in which it is kept."""
        plain = re.sub(r"[^\w.+-]+", "_", one.entry).strip("_")
        depends = hash_of([one.entry, one.budget, self.depends_on()])[:10]
        return folder() / self.place / f"{plain}-{one.budget}ep-{depends}.json"

    def _keep(self, one: Wanted, made: Result) -> None:
        """Put it beside what is in its file."""
        path = self.path_of(one)
        path.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(path.with_suffix(".lock")):
            both: dict[tuple[str, int], Any] = {
                **self._read(path), (one.layout, one.seed): made,
            }  # fmt: skip
            content = {
                "entry": one.entry,
                "budget": one.budget,
                "depends on": self.depends_on(),
                "sources": sources_hash(),
                "judged": [[layout, seed, asdict(it)] for (layout, seed), it in both.items()],
            }
            keep(path, partial(write_json, content=content))

    def _read(self, path: Path) -> dict[tuple[str, int], Result]:
        """What a file holds; nothing if it is not there, or damaged, which is said."""
        try:
            found = json.loads(path.read_text("utf-8"))
            if not is_accepted(found.get("sources")):
                say(f"{path} is of code that is neither this nor locked, and is judged again")
                return {}
            return {
                (layout, seed): self.result(**fields) for layout, seed, fields in found["judged"]
            }
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, LookupError, TypeError) as error:
            say(f"{path} is damaged ({error}), and is judged again")
            return {}


def price(
    runs: Iterable[Wanted],
    measured: Mapping[Wanted, Timed],
    alike: Callable[[Wanted], Hashable],
    otherwise: Callable[[Wanted], float],
) -> float:
    """Seconds of processor time that some runs take: the mean of those that are known to be alike.

    Args:
        runs: which.
        measured: those that are known.
        alike: two runs of which this is the same take as long.
        otherwise: the seconds of a run to which none is alike.
    """
    known: dict[Hashable, list[float]] = {}
    for one, made in measured.items():
        known.setdefault(alike(one), []).append(made.seconds)
    means = {kind: sum(times) / len(times) for kind, times in known.items()}
    return sum(means[alike(one)] if alike(one) in means else otherwise(one) for one in runs)

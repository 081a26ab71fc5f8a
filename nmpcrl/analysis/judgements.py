"""Entries judged and kept in the folder of the runs, so that what was interrupted goes on.

A file holds what an entry with one setting did with one budget, by layout and seed. It is named by
both, and by a hash of the epochs and versions on which the numbers depend. Whoever judges the same
at the same time does it twice, with the same result.
"""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

from filelock import FileLock

from nmpcrl.analysis.entries import ENTRIES
from nmpcrl.analysis.leaderboard import HELD_OUT, MOST_SEEDS, Judged, judge_once
from nmpcrl.study import paper
from nmpcrl.study.geometry import Centres
from nmpcrl.study.population import JUDGE, TUNE
from nmpcrl.study.provenance import epochs, hash_of, versions
from nmpcrl.study.storage.atomic import write_json
from nmpcrl.study.storage.executor import execute
from nmpcrl.study.storage.place import check_folder, folder, keep, say

EPOCH = 1  # raised by hand where an edit of the suite or its entries changes a number
FOLDER = "suite"  # in that of the runs
LIBRARIES = ("cma", "optuna")  # beside those of every run
LAYOUTS: Mapping[str, Centres] = {**JUDGE, **TUNE, **paper.LAYOUTS}


class Wanted(NamedTuple):
    """An entry that is judged in one layout with one seed."""

    entry: str  # one that ships, as `entries.called` names it
    budget: int  # episodes
    layout: str  # its name in `LAYOUTS`
    seed: int


def seed_of(layout: str, k: int) -> int:
    """The seed number k of a layout, which no other has; on `JUDGE` those of `leaderboard.judge`.

    Raises:
        KeyError: there is no such layout.
    """
    for further, names in enumerate((JUDGE, TUNE, paper.LAYOUTS)):
        if layout in names:
            return HELD_OUT * (1 + further) + MOST_SEEDS * [*names].index(layout) + k
    raise KeyError(layout)


def judge_all(
    wanted: Iterable[Wanted], *, workers: int | None = None, progress: bool = True
) -> dict[Wanted, Judged]:
    """Read what is kept, judge the rest in parallel, and keep it as soon as it is there.

    Args:
        wanted: in the order in which they begin.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar.

    Raises:
        StoreError: something is missing and could not be kept; nothing is judged.
        Exception: what the first raised that failed; the others are kept.
    """
    every = tuple(dict.fromkeys(wanted))
    found = stored(every)
    missing = [one for one in every if one not in found]
    if missing:
        check_folder()
        _compile_ahead(missing)

    def put(one: Wanted, judged: Judged) -> str:
        found[one] = judged
        _keep(one, judged)
        return f"{one.entry} in {one.layout}: {judged.gain:.1%}"

    failures = execute(
        {one: partial(judge_named, one) for one in missing},
        put,
        workers=workers,
        progress=progress,
        size=lambda one: one.budget,
        unit="ep",
    )
    for error in failures.values():
        raise error
    return {one: found[one] for one in every}


def judge_named(one: Wanted) -> Judged:
    """Judge one."""
    return judge_once(one.entry, LAYOUTS[one.layout], one.budget, one.seed)


def stored(wanted: Iterable[Wanted]) -> dict[Wanted, Judged]:
    """Those of them that are kept."""
    every = tuple(wanted)
    files = {path: _read(path) for path in {path_of(one) for one in every}}
    return {
        one: files[path_of(one)][one.layout, one.seed]
        for one in every
        if (one.layout, one.seed) in files[path_of(one)]
    }


def path_of(one: Wanted) -> Path:
    """The file in which it is kept."""
    plain = re.sub(r"[^\w.+-]+", "_", one.entry).strip("_")
    name = f"{plain}-{one.budget}ep-{hash_of([one.entry, one.budget, depends_on()])[:10]}"
    return folder() / FOLDER / f"{name}.json"


def depends_on() -> dict[str, Any]:
    """All that the numbers depend on, beside the entry, the layout and the seed."""
    return {"epochs": epochs(), "suite": EPOCH, **versions(), **_libraries()}


def _libraries() -> dict[str, str]:
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # the extra is not installed
            found[name] = "absent"
    return found


def _compile_ahead(missing: Iterable[Wanted]) -> None:
    """Call each kind of entry once, so that no processor time of a first compilation is counted."""
    kinds = dict.fromkeys(one.entry.partition("[")[0] for one in missing)
    for entry in kinds:
        if entry in ENTRIES:
            judge_once(entry, next(iter(LAYOUTS.values())), 3, 0)


def _keep(one: Wanted, judged: Judged) -> None:
    """Put it beside what is in its file."""
    path = path_of(one)
    path.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(path.with_suffix(".lock")):
        both = {**_read(path), (one.layout, one.seed): judged}
        content = {
            "entry": one.entry,
            "budget": one.budget,
            "depends on": depends_on(),
            "judged": [[layout, seed, asdict(it)] for (layout, seed), it in both.items()],
        }
        keep(path, partial(write_json, content=content))


def _read(path: Path) -> dict[tuple[str, int], Judged]:
    """What a file holds; nothing if it is not there, or damaged, which is said."""
    try:
        found = json.loads(path.read_text("utf-8"))
        return {(layout, seed): Judged(**fields) for layout, seed, fields in found["judged"]}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, LookupError, TypeError) as error:
        say(f"{path} is damaged ({error}), and is judged again")
        return {}

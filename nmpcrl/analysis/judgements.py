"""Entries of the suite judged and kept: one that ships, as `entries.called` names it, by layout."""

from collections.abc import Iterable, Mapping
from typing import Any

from nmpcrl.analysis.entries import ENTRIES
from nmpcrl.analysis.kept import Kept, Wanted
from nmpcrl.analysis.leaderboard import HELD_OUT, MOST_SEEDS, Judged, judge_once
from nmpcrl.study import paper
from nmpcrl.study.geometry import Centres
from nmpcrl.study.population import JUDGE, TUNE
from nmpcrl.study.provenance import epochs, installed, versions

EPOCH = 1  # raised by hand where an edit of the suite or its entries changes a number
FOLDER = "suite"  # in that of the runs
LIBRARIES = ("cma", "optuna")  # beside those of every run
LAYOUTS: Mapping[str, Centres] = {**JUDGE, **TUNE, **paper.LAYOUTS}


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
    """Judge what is missing: `Kept.complete`."""
    return KEPT.complete(
        wanted,
        judge_named,
        before=_compile_ahead,
        said=lambda one, judged: f"{one.entry} in {one.layout}: {judged.gain:.1%}",
        workers=workers,
        progress=progress,
    )


def judge_named(one: Wanted) -> Judged:
    """Judge one."""
    return judge_once(one.entry, LAYOUTS[one.layout], one.budget, one.seed)


def stored(wanted: Iterable[Wanted]) -> dict[Wanted, Judged]:
    """Those of them that are kept."""
    return KEPT.stored(wanted)


def depends_on() -> dict[str, Any]:
    """All that the numbers depend on, beside the entry, the layout and the seed."""
    return {"epochs": epochs(), "suite": EPOCH, **versions(), **_libraries()}


def _libraries() -> dict[str, str]:
    return {name: installed(name) for name in LIBRARIES}


def _compile_ahead(missing: Iterable[Wanted]) -> None:
    """Call each kind of entry once, so that no processor time of a first compilation is counted."""
    kinds = dict.fromkeys(one.entry.partition("[")[0] for one in missing)
    for entry in kinds:
        if entry in ENTRIES:
            judge_once(entry, next(iter(LAYOUTS.values())), 3, 0)


KEPT: Kept[Judged] = Kept(FOLDER, Judged, lambda: depends_on())  # as it is when it is asked

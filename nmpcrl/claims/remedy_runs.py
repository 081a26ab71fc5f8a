"""The runs of the comparison of remedies: which are wanted, and what is there of them.

The parts come in an order: J_best of every layout, the tuning, and what the best settings are
judged in. All are kept by `analysis.judgements`, so that an interrupted call goes on.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from nmpcrl.analysis import kept
from nmpcrl.analysis.judgements import judge_all, stored
from nmpcrl.analysis.kept import Wanted
from nmpcrl.analysis.suite import ENTRIES, Judgement, seed_of
from nmpcrl.analysis.suite import entry as entry_named
from nmpcrl.claims.remedies import COLUMNS, best_setting
from nmpcrl.claims.remedy_questions import PARTS, SETTINGS, YARDSTICK, YARDSTICK_SEED
from nmpcrl.study.storage.refusal import Refusal

BEST, TUNE = "best", "tune"  # the parts that come before the others
ORDER = (BEST, *PARTS)
SEARCH = "CMA-ES"  # as it ships, with which J_best is found
SECONDS = 0.013  # of processor time an episode, where none of an entry is known


class NotTuned(Refusal):
    """An entry cannot be judged before its tuning, or anything without J_best."""


def yardsticks(parts: Iterable[str] = tuple(PARTS)) -> dict[str, Wanted]:
    """The search for J_best, by layout of some parts."""
    layouts = dict.fromkeys(name for part in parts for name in PARTS[part].layouts)
    return {name: Wanted(SEARCH, YARDSTICK, name, YARDSTICK_SEED) for name in layouts}


def settings(entry: str) -> tuple[str, ...]:
    """The names that an entry has in its tuning, that of the one it ships with first."""
    return tuple(str(ENTRIES[entry].with_settings(**one)) for one in SETTINGS[entry])


def tuning(entry: str) -> tuple[Wanted, ...]:
    """Its runs of the part `tune`: nothing where nothing can be set."""
    return _runs(settings(entry), TUNE, entry)


def judging(entry: str, part: str, name: str) -> tuple[Wanted, ...]:
    """Its runs of another part.

    Args:
        entry: of `SETTINGS`.
        part: of `PARTS`.
        name: with what is set.
    """
    return _runs((name,), part, entry)


def _runs(names: Iterable[str], part: str, entry: str) -> tuple[Wanted, ...]:
    one = PARTS[part]
    return tuple(
        Wanted(name, one.budget, layout, seed_of(layout, k))
        for name in names
        for layout in one.layouts_of(entry)
        for k in range(one.seeds)
    )


def chosen(entry: str) -> str:
    """The entry with its best setting.

    Raises:
        NotTuned: its tuning is not kept whole, or J_best of a layout is missing.
    """
    if not SETTINGS[entry]:
        return entry
    tuned = table(TUNE, entry, tuning(entry))
    if len(tuned) < len(tuning(entry)):
        raise NotTuned(
            f"{entry} is not tuned yet: `nmpcrl remedies --part best --part tune --entry"
            f" {entry}` does that"
        )
    return best_setting(tuned)


def wanted(part: str, entries: Iterable[str] = tuple(SETTINGS)) -> tuple[Wanted, ...]:
    """All runs of a part.

    Raises:
        NotTuned: as `chosen`, of an entry that is judged.
    """
    if part == BEST:
        return tuple(yardsticks().values())
    if part == TUNE:
        return tuple(one for entry in entries for one in tuning(entry))
    return tuple(one for entry in entries for one in judging(entry, part, chosen(entry)))


def planned(part: str, entries: Iterable[str] = tuple(SETTINGS)) -> tuple[Wanted, ...]:
    """As `wanted`; of entries that are not tuned yet as they ship."""
    if part in (BEST, TUNE):
        return wanted(part, entries)
    names = {entry: _chosen_or_shipped(entry) for entry in entries}
    return tuple(one for entry, name in names.items() for one in judging(entry, part, name))


def _chosen_or_shipped(entry: str) -> str:
    try:
        return chosen(entry)
    except NotTuned:
        return entry


def judge_parts(
    parts: Iterable[str], entries: Iterable[str] = tuple(SETTINGS), **options: Any
) -> None:
    """Judge what is missing, part by part; options as `judgements.judge_all` takes them.

    Raises:
        NotTuned: as `wanted`.
    """
    some = tuple(entries)
    for part in sorted(parts, key=ORDER.index):
        judge_all(wanted(part, some), **options)


def whole(entries: Iterable[str] = tuple(SETTINGS)) -> pd.DataFrame:
    """The table of all that is kept of some entries, but parts that are not there whole."""
    tables = []
    for entry in entries:
        for part in PARTS:
            runs = tuning(entry) if part == TUNE else _judged(entry, part)
            if runs and len(stored(runs)) == len(runs):
                found = table(part, entry, runs)
                tables += [found] if len(found) == len(runs) else []
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=[*COLUMNS])


def _judged(entry: str, part: str) -> tuple[Wanted, ...]:
    """Its runs of a part; none if it is not known yet with which setting."""
    try:
        return judging(entry, part, chosen(entry))
    except NotTuned:
        return ()


def table(part: str, entry: str, runs: Iterable[Wanted]) -> pd.DataFrame:
    """What is kept of some runs, with `COLUMNS`; a layout without J_best is left out."""
    best = {one.layout: it.cost for one, it in stored(yardsticks([part]).values()).items()}
    found = [
        _row(part, entry, one, judged, best[one.layout])
        for one, judged in stored(runs).items()
        if one.layout in best
    ]
    return pd.DataFrame(found, columns=[*COLUMNS])


def _row(part: str, entry: str, one: Wanted, judged: Judgement, best: float) -> dict[str, Any]:
    return {
        "part": part, "entry": entry, "name": one.entry, "layout": one.layout,
        "k": one.seed - seed_of(one.layout, 0),
        "initial": judged.initial, "best": best, "cost": judged.cost,
        "arrived": judged.arrived, "episodes": judged.episodes, "over": judged.over,
        "seconds": judged.seconds,
    }  # fmt: skip


def price(runs: Iterable[Wanted], measured: Mapping[Wanted, Judgement]) -> float:
    """Seconds of processor time that some runs take, by those that are known of the same entry."""
    return kept.price(
        runs,
        measured,
        alike=lambda one: (_ships(one), one.budget),
        otherwise=lambda one: SECONDS * one.budget,
    )


def _ships(one: Wanted) -> str:
    return entry_named(one.entry).name

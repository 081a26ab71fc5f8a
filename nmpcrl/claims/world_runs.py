"""The runs of worlds that move, change, or are not the model: which are wanted, and what is kept.

Those with a richer terminal cost are beside them, since they have the same controller.

All are kept by `analysis.worlds`, so that an interrupted call goes on.
"""

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

import pandas as pd

from nmpcrl.analysis import kept
from nmpcrl.analysis.kept import Wanted
from nmpcrl.analysis.worlds import KEPT, Ran, compile_ahead, run, seed_of
from nmpcrl.claims import remedies, remedy_published
from nmpcrl.claims.extendable import RUN, whole_arms
from nmpcrl.claims.published import Damaged
from nmpcrl.claims.remedy_questions import EXPECTED_FIRST, FIRST
from nmpcrl.claims.terminal_questions import TERMINAL
from nmpcrl.claims.world_questions import PARTS as OF_WORLDS
from nmpcrl.claims.world_questions import REMEDY, Part
from nmpcrl.study.storage.refusal import Refusal

PARTS: Mapping[str, Part] = {**OF_WORLDS, "terminal": TERMINAL}
ORDER = tuple(PARTS)
COLUMNS = (*RUN, *(one.name for one in fields(Ran)))
SECONDS: Mapping[str, float] = {  # of processor time an episode, by a word of an arm or its part
    "init": 0.002, "oracle": 0.002, "grid": 0.007, "remedy": 0.03, "RDES": 0.076, "DES": 0.07,
    "moving": 0.035, "model": 0.03, "carry": 0.035, "gradient": 0.06,
    "once": 0.027, "every": 0.027, "random": 0.027, "terminal": 0.05,
}  # fmt: skip


class NoRemedy(Refusal):
    """It is not known yet which remedy is to be tried first."""


def remedy() -> str:
    """The entry that the published comparison says is to be tried first.

    Raises:
        NoRemedy: it says of none, or is not published.
    """
    try:
        advice = remedies.advice(remedy_published.load().table)
    except Damaged as error:
        raise NoRemedy(f"the part 'once' has the remedy to try first: {error}") from error
    first = next((one for one in advice if one.word == FIRST), None)
    if first is None:
        raise NoRemedy("the published comparison of remedies advises on none to try first")
    return max(first.rows.values(), key=lambda row: row.rollouts).name


def wanted(part: str) -> tuple[Wanted, ...]:
    """All runs of a part.

    Raises:
        NoRemedy: as `remedy`, of a part which has it.
    """
    named = {REMEDY: f"{REMEDY} {remedy()}"} if REMEDY in PARTS[part].arms else {}
    return _runs(part, named)


def planned(part: str) -> tuple[Wanted, ...]:
    """As `wanted`; with the remedy that was expected to be the first where none is known."""
    try:
        return wanted(part)
    except NoRemedy:
        return _runs(part, {REMEDY: f"{REMEDY} {EXPECTED_FIRST[max(EXPECTED_FIRST)]}"})


def _runs(part: str, named: Mapping[str, str]) -> tuple[Wanted, ...]:
    one = PARTS[part]
    return tuple(
        Wanted(f"{part}: {named.get(arm, arm)}", one.budget, place, seed_of(place, k))
        for arm in one.arms
        for place, k in one.runs(arm)
    )


def run_parts(parts: Iterable[str], **options: Any) -> None:
    """Run what is missing, part by part; options as `Kept.complete` takes them.

    Raises:
        NoRemedy: as `wanted`.
    """
    for part in sorted(parts, key=ORDER.index):
        KEPT.complete(
            wanted(part),
            run,
            before=compile_ahead,
            said=lambda one, ran: f"{one.entry} in {one.layout}: {ran.cost:.4g}",
            **options,
        )


def whole(parts: Iterable[str] = ORDER) -> pd.DataFrame:
    """The table of all that is kept of some parts, but arms that are not there whole."""
    runs = (one for part in parts for one in planned(part))
    return whole_arms(KEPT, runs, seed_of)


def price(runs: Iterable[Wanted], measured: Mapping[Wanted, Ran]) -> float:
    """Seconds of processor time that some runs take, by those that are known of the same arm."""
    return kept.price(
        runs,
        measured,
        alike=lambda one: one.entry,
        otherwise=lambda one: one.budget * _rate(one.entry),
    )


def _rate(entry: str) -> float:
    part, _, arm = entry.partition(": ")
    return next(SECONDS[word] for word in (*arm.split(), *part.split()) if word in SECONDS)

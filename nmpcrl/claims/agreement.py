"""Whether a verdict that is found here contradicts the published one on the same claim.

It does if all of this holds:

- both are decided; what is not decidable, for want of runs or on a busy machine, contradicts
  nothing;
- the outcomes differ;
- chance does not explain it. Where both rest on a share or on a ratio, their 95 % intervals do not
  overlap; of two samples from the same source, fewer than one pair in a hundred is so far apart.
  What rests on no sample (C8: assumptions hold or do not) leaves nothing to chance.

Numbers on pages disagree if they are of one quantity and not the same: see `disagreements`.

Runs that were trained here are judged alone, and compared with the published runs in the same
layouts and readings of the decay, so that a choice of layouts contradicts nothing. A time belongs
to a machine: on another one than that of the published times, another verdict is a finding.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import pandas as pd

from nmpcrl.analysis.rows import row, table
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims.comparison import nearly_equal, unequal
from nmpcrl.claims.own_claims import judge_own
from nmpcrl.claims.paper_claims import judge_runs, judge_times
from nmpcrl.claims.published import Published
from nmpcrl.claims.rule import CELL, Paths
from nmpcrl.claims.verdict import UNDECIDABLE, Verdict
from nmpcrl.claims.wider_claims import judge_wider
from nmpcrl.study import design
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.storage.machine import fingerprint

SHARED = ["layout", "decay"]  # what runs here and published ones have in common


def contradictions(found: Iterable[Verdict], known: Iterable[Verdict]) -> tuple[str, ...]:
    """Which verdicts that were found contradict known ones, a sentence each."""
    there = {verdict.claim: verdict for verdict in known}
    pairs = [(one, there[one.claim]) for one in found if one.claim in there]
    return tuple(
        f"{here.claim} is {_shown(here)} here, and {_shown(other)} as published"
        for here, other in pairs
        if contradict(here, other)
    )


def contradict(first: Verdict, second: Verdict) -> bool:
    """Whether two verdicts on a claim cannot both be right: see the top."""
    if UNDECIDABLE in (first.outcome, second.outcome) or first.outcome == second.outcome:
        return False
    if first.interval is None or second.interval is None:
        return True
    (low, high), (other_low, other_high) = first.interval, second.interval
    return high < other_low or other_high < low


@dataclass(frozen=True)
class Statement:
    """A number on a page."""

    quantity: str  # what it is of, whose, and from where
    value: str  # to all digits
    page: str


def disagreements(statements: Iterable[Statement]) -> tuple[str, ...]:
    """Of which quantities pages say different numbers, a sentence each."""
    said: dict[str, dict[str, str]] = {}
    for one in statements:
        said.setdefault(one.quantity, {}).setdefault(one.value, one.page)
    return tuple(
        f"{quantity}: " + ", ".join(f"{value} on {page}" for value, page in values.items())
        for quantity, values in said.items()
        if len(values) > 1
    )


@dataclass(frozen=True)
class Repeated:
    """Published runs that were trained again here, and what they come to."""

    runs: int
    equal: int  # have every published number in every digit
    close: int  # of the others, have it to `comparison.EXACT`
    here: tuple[Verdict, ...]  # on these runs alone
    there: tuple[Verdict, ...]  # on the published ones in the same layouts and readings


def repeated(fresh: Mapping[Experiment, RunSummary], published: Published) -> Repeated:
    """How runs that were trained here compare with the published ones of the same name.

    Args:
        fresh: any runs; those that are not in the published main table are left out.
        published: what they are compared with.
    """
    mine = {e: one for e, one in fresh.items() if published.variants.get(e) == design.MAIN_TABLE}
    rows = {e: row(one) for e, one in mine.items()}
    differing = [e for e in mine if unequal(e, rows[e], published.rows[e])]
    close = sum(nearly_equal(e, rows[e], published.rows[e]) for e in differing)
    here, there = _in_both(mine, published)
    return Repeated(len(mine), len(mine) - len(differing), close, here, there)


def of_runs(fresh: Mapping[Experiment, RunSummary], published: Published) -> tuple[str, ...]:
    """Which verdicts of the runs that were trained here contradict those of the published ones.

    Args:
        fresh: any runs; those that are not as the main table's are left out.
        published: what they are compared with.
    """
    return contradictions(*_in_both(fresh, published))


def _in_both(
    fresh: Mapping[Experiment, RunSummary], published: Published
) -> tuple[tuple[Verdict, ...], tuple[Verdict, ...]]:
    """The verdicts on these runs alone, and on the published ones in the same cells."""
    mine = {e: one for e, one in fresh.items() if _main(e)}
    if not mine:
        return (), ()
    paths = {e: one.states for e, one in mine.items()}
    here = table(mine)
    cells = set(here[SHARED].itertuples(index=False, name=None))
    shared = [
        part == design.MAIN_TABLE and tuple(getattr(e, name) for name in SHARED) in cells
        for e, part in published.variants.items()
    ]
    if not any(shared):
        return (), ()
    return _judged(here, paths), _judged(published.table[shared], published.paths)


def of_times(timings: pd.DataFrame, published: Published) -> tuple[str, ...]:
    """Which verdicts on times that were taken here contradict those taken on this very machine."""
    if published.about.get("timings", {}).get("machine") != fingerprint():
        return ()
    return contradictions(judge_times(timings), published.verdicts)


def _judged(runs: pd.DataFrame, paths: Paths) -> tuple[Verdict, ...]:
    return (*judge_runs(runs, paths), *judge_wider(runs, paths), *judge_own(runs))


def _main(e: Experiment) -> bool:
    """Whether nothing but learner, layout, decay and seed is chosen."""
    return e == Experiment(**{name: getattr(e, name) for name in ("learner", *CELL)})


def _shown(verdict: Verdict) -> str:
    """The outcome with what it rests on."""
    if verdict.interval is None:
        return verdict.words
    low, high = verdict.interval
    if verdict.share is None:
        return f"{verdict.words} ({verdict.ratio:.2f} [{low:.2f}, {high:.2f}])"
    return f"{verdict.words} ({verdict.share:.0%} [{low:.0%}, {high:.0%}])"

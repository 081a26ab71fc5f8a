"""Whether a verdict that is found here contradicts the published one on the same claim.

It does if all of this holds:

- both are decided; what is not decidable, for want of runs or on a busy machine, contradicts
  nothing;
- the outcomes differ;
- chance does not explain it. Where both rest on a share or on a ratio, their 95 % intervals do not
  overlap; of two samples from the same source, fewer than one pair in a hundred is so far apart.
  What rests on no sample (C8: assumptions hold or do not) leaves nothing to chance.

Runs that were trained here are judged alone, and compared with the published runs in the same
layouts and readings of the decay, so that a choice of layouts contradicts nothing. A time belongs
to a machine: on another one than that of the published times, another verdict is a finding.
"""

from collections.abc import Iterable, Mapping

import pandas as pd

from nmpcrl.analysis.summary import RunSummary, cost_ratios, table
from nmpcrl.claims.own_claims import judge_own
from nmpcrl.claims.paper_claims import judge_runs, judge_times
from nmpcrl.claims.published import Published
from nmpcrl.claims.rule import CELL, UNDECIDABLE, Paths, Verdict
from nmpcrl.study import design
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.machine import fingerprint

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


def of_runs(fresh: Mapping[Experiment, RunSummary], published: Published) -> tuple[str, ...]:
    """Which verdicts of the runs that were trained here contradict those of the published ones.

    Args:
        fresh: any runs; those that are not as the main table's are left out.
        published: what they are compared with.
    """
    mine = {e: one for e, one in fresh.items() if _main(e)}
    if not mine:
        return ()
    paths = {e: one.states for e, one in mine.items()}
    here = table(mine)
    cells = set(here[SHARED].itertuples(index=False, name=None))
    theirs = [
        e
        for e, part in published.variants.items()
        if part == design.MAIN_TABLE and tuple(getattr(e, name) for name in SHARED) in cells
    ]
    if not theirs:
        return ()
    ratios = cost_ratios(published.rows)
    there = pd.DataFrame([published.rows[e] | {"cost_ratio": ratios[e]} for e in theirs])
    their_paths = {e: published.summaries[e].states for e in theirs}
    return contradictions(_judged(here, paths), _judged(there, their_paths))


def of_times(timings: pd.DataFrame, published: Published) -> tuple[str, ...]:
    """Which verdicts on times that were taken here contradict those taken on this very machine."""
    if published.about.get("machine") != fingerprint():
        return ()
    return contradictions(judge_times(timings), published.verdicts)


def _judged(runs: pd.DataFrame, paths: Paths) -> tuple[Verdict, ...]:
    return (*judge_runs(runs, paths), *judge_own(runs))


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

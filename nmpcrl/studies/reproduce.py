"""Runs made on this machine against the published ones, and the proof that an edit changes no bit.

Where code, versions and machine are the published ones, a run must be equal to the last bit.
Elsewhere the cost of theta_init must agree to `EXACT`, and of `FEWEST` or more runs of one learner,
layout and reading of the decay at least half must lie in the range of the published runs, widened
on both sides by its width and by `SLACK`. If none of ten published runs failed and each fails with
probability p, most of three fail in at most 1.2 % of all cases, for any p.
"""

from collections.abc import Iterable, Mapping
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.rows import FIELDS, THETA, row, table
from nmpcrl.analysis.summaries import SUMMARIES, make
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import BY_RUNS, BY_TIME, WIDER_CLAIMS
from nmpcrl.claims.published import Published
from nmpcrl.claims.rule import judge
from nmpcrl.claims.verdict import Verdict, differ
from nmpcrl.study import lock, provenance
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.jobs import parallel
from nmpcrl.study.limits import seconds_of
from nmpcrl.study.machine import fingerprint
from nmpcrl.study.refusal import Refusal
from nmpcrl.study.setup import compile_ahead

Row = Mapping[str, Any]
Interval = tuple[float, float] | None
Pairs = tuple[tuple[Verdict, Verdict], ...]  # found here, published
GROUP = [name for name in FIELDS if name != "seed"]  # fields that runs of a range have in common
CELL = ["learner", "layout", "decay"]  # columns that name a group in the table of `compare`
MEASURES = ("final_cost", "training_cost")  # compared with a range on another machine
NUMBERS = (*MEASURES, "initial_cost", *THETA)  # compared bit for bit on the same machine
SLACK = 0.01  # of the cost of theta_init
FEWEST = 3  # runs of a group: one or two of a chaotic learner may fail by chance
EXACT = 1e-6  # relative


def compare(fresh: Mapping[Experiment, RunSummary], published: Published) -> pd.DataFrame:
    """The numbers of runs made here that contradict published ones, one row each."""
    rows = {e: row(one) for e, one in fresh.items() if e in published.rows}
    exact = comparable(rows, published)
    wrong = [unequal(e, rows[e], published.rows[e]) for e in sorted(exact, key=str)]
    wrong += _out_of_range([one for e, one in rows.items() if e not in exact], published)
    names = [*CELL, "seed", "what", "here", "published"]
    return pd.DataFrame([one for one in wrong if one], columns=names)


def comparable(runs: Iterable[Experiment], published: Published) -> set[Experiment]:
    """The runs that were published with this code, these versions and on this machine."""
    here = fingerprint(), provenance.environment()
    batches = (one for one in published.batches if (one["machine"], one["versions"]) == here)
    parts = {part for batch in batches for part in batch["runs"]}
    rows = {e: one for e in runs if (one := published.rows.get(e)) and one["variant"] in parts}
    return {e for e, one in rows.items() if one["key"] == provenance.summary_key(e)}


def unequal(e: Experiment, here: Row, there: Row) -> tuple[Any, ...] | None:
    """The first number that differs between two rows of one run, as a row of `compare`."""
    for name in NUMBERS:
        if here[name] != there[name]:
            return e.learner, e.layout, e.decay, e.seed, name, here[name], str(there[name])
    return None


def _out_of_range(rows: list[dict[str, Any]], published: Published) -> list[tuple[Any, ...]]:
    """The rows of `compare` by the rule for another machine."""
    wrong: list[tuple[Any, ...]] = []
    known = dict(iter(published.runs.groupby(GROUP)))
    for name, group in pd.DataFrame(rows).groupby(GROUP) if rows else ():
        there, cell = known[name], tuple(group[CELL].iloc[0])
        start = float(there.initial_cost.iloc[0])
        for seed, here in zip(group.seed, group.initial_cost, strict=True):
            if abs(here / start - 1) > EXACT:
                wrong.append((*cell, seed, "initial_cost", here, str(start)))
        for measure in MEASURES if len(group) >= FEWEST else ():
            finite = there[measure][np.isfinite(there[measure])]
            width = finite.max() - finite.min() + SLACK * start
            failed = len(finite) < len(there)  # then no upper end; nan where each one failed
            low, high = finite.min() - width, np.inf if failed else finite.max() + width
            if finite.size and (~group[measure].between(low, high)).mean() > 0.5:
                middle = float(group[measure].median())
                wrong.append((*cell, "all", measure, middle, f"{low:.1f} to {high:.1f}"))
    return wrong


def contradictions(found: Iterable[Verdict], known: Iterable[Verdict]) -> Pairs:
    """The pairs of verdicts on one claim whose outcomes differ by more than chance.

    Of two samples from one source, fewer than one pair in a hundred has intervals of 95 % that do
    not overlap. A verdict without an interval rests on no sample.
    """
    there = {verdict.claim: verdict for verdict in known}
    pairs = [(one, there[one.claim]) for one in found if one.claim in there]
    return tuple(
        (one, other)
        for one, other in pairs
        if differ(one.outcome, other.outcome) and not _overlap(one.interval, other.interval)
    )


def _overlap(one: Interval, other: Interval) -> bool:
    return bool(one and other and one[0] <= other[1] and other[0] <= one[1])


def of_runs(fresh: Mapping[Experiment, RunSummary], published: Published) -> Pairs:
    """The contradictions between verdicts on runs made here and on the published main table.

    Both are of the same layouts and readings of the decay. Runs with other fields are skipped.
    """
    mine = {
        e: one
        for e, one in fresh.items()
        if e == Experiment(e.learner, layout=e.layout, decay=e.decay, seed=e.seed)
    }
    cells, main = {(e.layout, e.decay) for e in mine}, published.main
    there = main.where([(e.layout, e.decay) in cells for e in main.summaries])
    if not there.summaries:
        return ()
    paths = {e: one.states for e, one in mine.items()}
    claims = BY_RUNS | WIDER_CLAIMS | OWN_CLAIMS
    return contradictions(judge(claims, table(mine), paths), judge(claims, there.runs, there.paths))


def of_times(timings: pd.DataFrame, published: Published) -> Pairs:
    """The contradictions with times taken here; none if another machine took the published ones."""
    if published.timed.get("machine") != fingerprint():
        return ()
    here, there = (judge(BY_TIME, timings=one) for one in (timings, published.timings))
    return contradictions(here, there)


def sample(variants: Mapping[Experiment, str], count: int) -> tuple[Experiment, ...]:
    """Some of these runs, spread over the parts of the study and in each part over its learners."""
    parts: dict[str, dict[str, list[Experiment]]] = {}
    for experiment, part in variants.items():
        parts.setdefault(part, {}).setdefault(experiment.learner, []).append(experiment)
    ordered = _interleaved([_interleaved(learners.values()) for learners in parts.values()])
    if count >= len(parts):
        return tuple(ordered[:count])
    return tuple(ordered[i * len(parts) // count] for i in range(count))


def _interleaved(groups: Iterable[Iterable[Experiment]]) -> list[Experiment]:
    """The first of each group, the second of each, and so on."""
    return [e for turn in zip_longest(*groups) for e in turn if e is not None]


def relock(known: Published, count: int, *, workers: int | None = None) -> tuple[Path, int, int]:
    """Train `count` runs afresh, and write the lock if all have the bits that locked code made.

    Returned are the lock, and how many runs have the bits of published and of stored ones.

    A fresh run is compared with the published run, if a machine like this one made it, else with
    the run that is stored here. In a raised epoch the lock is written without any training. A
    `Refusal` names a changed bit, or the number of runs without a comparison.
    """
    if lock.locked()["epochs"] != provenance.EPOCHS:
        return lock.relock(), 0, 0
    drawn = sample(known.variants, count)
    exact = comparable(drawn, known)
    before: dict[Experiment, Row] = {e: known.rows[e] for e in exact}
    before |= {e: row(one) for e in drawn if e not in exact and (one := _stored_by_lock(e))}
    if len(before) < len(drawn):
        raise Refusal(
            f"only {len(before)} of {len(drawn)} runs can be compared with runs that locked code"
            f" made on such a machine: with that code, `nmpcrl verify --sample {count}` makes them"
        )
    compile_ahead(drawn)
    ordered = sorted(drawn, key=seconds_of, reverse=True)
    fresh = dict(parallel(partial(make, afresh=True), ordered, workers, "runs"))
    wrong = [found for e in drawn if (found := unequal(e, row(fresh[e]), before[e]))]
    if wrong:
        learner, layout, decay, seed, what, now, then = wrong[0]
        raise Refusal(
            f"{len(wrong)} of {len(drawn)} runs have other bits, first {learner} in layout"
            f" {layout}, decay per {decay}, seed {seed}: {what} is {now!r} and was {then}; if that"
            " is intended, raise the epoch of the package in nmpcrl/study/provenance.py"
        )
    for experiment, one in fresh.items():  # the next edit is compared with these
        SUMMARIES.save(experiment, one)
    return lock.relock(), len(exact), len(drawn) - len(exact)


def _stored_by_lock(e: Experiment) -> RunSummary | None:
    """The stored summary, if locked code made it on a machine like this one with these versions."""
    one, here = SUMMARIES.read(e), (fingerprint(), provenance.environment())
    if one is None or one.facts.get("sources") not in lock.locks():
        return None
    return one if (one.facts.get("machine"), one.facts.get("versions")) == here else None

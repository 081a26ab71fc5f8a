"""Do runs still have the numbers that are known of them, bit for bit, after an edit of the code?

`relock` trains some runs afresh, of every part of the study, and compares each with what the code
of the lock made of it: the published run, where that was made on such a machine with such versions,
or else the one that is stored here.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any

from nmpcrl.analysis import summaries
from nmpcrl.analysis.rows import row
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims.comparison import comparable, unequal
from nmpcrl.claims.published import Published
from nmpcrl.study import provenance
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.limits import seconds_of
from nmpcrl.study.setup import compile_ahead
from nmpcrl.study.storage.executor import execute
from nmpcrl.study.storage.machine import fingerprint

Row = Mapping[str, Any]


class CannotRelock(RuntimeError):
    """The lock stays as it is; the message says why."""


@dataclass(frozen=True)
class Relocked:
    """What was shown before the lock was written anew."""

    lock: Path
    published: int  # runs with the bits of the published ones
    stored: int  # runs with the bits of those that the code of the lock made here


def sample(known: Published, count: int) -> tuple[Experiment, ...]:
    """So many published runs, spread over the parts of the study and in each over its learners."""
    parts: dict[str, dict[str, list[Experiment]]] = {}
    for experiment, part in known.variants.items():
        parts.setdefault(part, {}).setdefault(experiment.learner, []).append(experiment)
    by_part = [_interleaved(learners.values()) for learners in parts.values()]
    ordered = _interleaved(by_part)
    if count >= len(by_part):
        return tuple(ordered[:count])
    return tuple(ordered[i * len(by_part) // count] for i in range(count))


def relock(known: Published, count: int, *, workers: int | None = None) -> Relocked:
    """Show that no bit of `count` fresh runs has changed, and write the lock anew.

    Raises:
        CannotRelock: a bit has changed, a run failed, or too few can be compared with anything.
    """
    drawn = sample(known, count)
    exact = comparable(drawn, known)
    before: dict[Experiment, Row] = {e: known.rows[e] for e in exact}
    before |= {e: row(one) for e, one in _stored_by_lock(drawn) if e not in exact}
    if len(before) < len(drawn):
        raise CannotRelock(
            f"only {len(before)} of {len(drawn)} runs can be compared with what the code of"
            " the lock made on such a machine: with that code,"
            f" `nmpcrl verify --sample {count}` makes them"
        )
    fresh = _trained_afresh(drawn, workers)
    wrong = [found for e in drawn if (found := unequal(e, row(fresh[e]), before[e]))]
    if wrong:
        learner, layout, decay, seed, what, now, then = wrong[0]
        raise CannotRelock(
            f"{len(wrong)} of {len(drawn)} runs have other bits, first {learner} in layout"
            f" {layout}, decay per {decay}, seed {seed}: {what} is {now!r} and was {then}; if that"
            " is meant, raise the epoch of the room in nmpcrl/study/provenance.py"
        )
    for experiment, made in fresh.items():  # what the next edit is compared with
        summaries.keep(experiment, made)
    return Relocked(provenance.relock(), len(exact), len(drawn) - len(exact))


def _interleaved(groups: Iterable[Iterable[Experiment]]) -> list[Experiment]:
    """The first of each group, the second of each, and so on."""
    return [e for turn in zip_longest(*groups) for e in turn if e is not None]


def _stored_by_lock(drawn: Iterable[Experiment]) -> list[tuple[Experiment, RunSummary]]:
    """The stored summaries that the code of the lock made on such a machine with such versions."""
    made = {
        "sources": provenance.locked_hash(),
        "machine": fingerprint(),
        "versions": provenance.environment(),
    }
    stored = [(e, one) for e in drawn if (one := summaries.read(e))]
    return [(e, one) for e, one in stored if all(one.facts.get(k) == v for k, v in made.items())]


def _trained_afresh(
    drawn: tuple[Experiment, ...], workers: int | None
) -> dict[Experiment, RunSummary]:
    fresh: dict[Experiment, RunSummary] = {}

    def keep(experiment: Experiment, made: RunSummary) -> str:
        fresh[experiment] = made
        return ""

    compile_ahead(drawn)
    ordered = sorted(drawn, key=seconds_of, reverse=True)
    signature = provenance.signature()
    jobs = {e: partial(summaries.make, e, signature, afresh=True) for e in ordered}
    for experiment, error in execute(jobs, keep, workers=workers).items():
        raise CannotRelock(f"{experiment} failed with {type(error).__name__}: {error}") from error
    return fresh

"""Sentences about claims that join two statements, or that speak of several learners."""

from collections.abc import Iterable, Iterator
from itertools import groupby

import pandas as pd

from nmpcrl.analysis.statistics import rate
from nmpcrl.claims.paper_claims import BY_RUNS, kept_without_noise
from nmpcrl.claims.verdict import WHOLE, Halves, Verdict
from nmpcrl.claims.wider_claims import WIDER_CLAIMS
from nmpcrl.report.text import listed


def items(verdicts: Iterable[Verdict], runs: pd.DataFrame) -> str:
    """One item a claim that joins statements or learners: each by itself, and what is clear.

    Args:
        verdicts: on the claims.
        runs: those that were judged; of C7, some were stopped.
    """
    return "\n".join(
        "\n".join([f"- **{v.claim}.** {apart(v)}", *(f"  - {one}" for one in _beside(v, runs))])
        for v in verdicts
        if apart(v)
    )


def apart(verdict: Verdict) -> str:
    """What a claim comes to for each learner that it is about, in sentences; "" for one learner."""
    groups = groupby(verdict.halves, key=lambda one: one.wrong)
    return verdict.each or " ".join(_counted(list(group)) for _, group in groups)


def clear(verdict: Verdict) -> tuple[str, ...]:
    """Where its two learners clearly differ, as claimed and then the other way round."""
    return (
        *_sentences(verdict.as_claimed, reverse=False),
        *_sentences(verdict.reverse, reverse=True),
    )


def stopped_early(runs: pd.DataFrame, learners: tuple[str, ...]) -> str:
    """How many runs count as keeping C7's constraints that were stopped in training."""
    asked = kept_without_noise(runs, learners)
    counts = (asked.kept & asked.stopped).groupby(level="learner", sort=False).sum()
    parts = listed(f"{count} of {name}" for name, count in counts.items() if count)
    return (
        f"Of those that kept them, {parts} had to be stopped in training; they are judged by their"
        " rollouts before that."
    )


def differ(verdict: Verdict) -> str:
    """In which readings of the decay two learners clearly differ, in a few words; "" if in none."""
    parts = {"as claimed": verdict.as_claimed, "the reverse": verdict.reverse}
    listing = (
        f"{way} with noise that decays {listed(dict.fromkeys(f'per {one.decay}' for one in found))}"
        for way, found in parts.items()
        if found
    )
    return ", ".join(listing)


def differences(verdicts: Iterable[Verdict]) -> str:
    """Of which claims two learners clearly differ, and which way round, in a sentence."""
    found = [f"{v.claim} ({differ(v)})" for v in verdicts if differ(v)]
    if not found:
        return "Nowhere do two learners of a claim clearly differ."
    return f"Where two learners of a claim clearly differ: {listed(found)}."


def _beside(verdict: Verdict, runs: pd.DataFrame) -> tuple[str, ...]:
    asked_twice = {"C7": BY_RUNS["C7"], "W7": WIDER_CLAIMS["W7"]}.get(verdict.claim)
    if asked_twice:
        return (stopped_early(runs, asked_twice.learners),)
    return clear(verdict)


def _counted(readings: list[Halves]) -> str:
    first, second = readings[0].learners
    parts = [
        f"with noise that decays per {one.decay} in {one.counts[0]} of {one.pairs} runs of {first}"
        f" and {one.counts[1]} of {second}"
        for one in readings
    ]
    return f"{readings[0].wrong.capitalize()}: {', '.join(parts)}."


def _sentences(found: Iterable[Halves], *, reverse: bool) -> Iterator[str]:
    """How the two differ in each, with the counts and the interval."""
    for one in found:
        learners, counts = one.learners, one.counts
        seen, going = "as claimed", one.apart - one.against
        if reverse:
            learners, counts = learners[::-1], counts[::-1]
            seen, going = "the reverse was seen", one.against
        several = "s" if len(one.layouts) > 1 else ""
        where = (
            "" if one.layouts == (WHOLE,) else f", in layout{several} {' and '.join(one.layouts)}"
        )
        yield (
            f"With noise that decays per {one.decay}{where}, {seen}: {learners[0]} {one.wrong} in"
            f" {counts[0]} of {one.pairs} runs and {learners[1]} in {counts[1]} ({going} of"
            f" {one.apart} pairs that differ: {rate(going, one.apart):.0%})."
        )

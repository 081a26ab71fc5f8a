"""Sentences about claims that join two statements, or that speak of several learners."""

from collections.abc import Iterable, Sequence
from itertools import groupby

import pandas as pd

from nmpcrl.claims.paper_claims import BY_RUNS, WIDER_CLAIMS, kept_without_noise
from nmpcrl.claims.verdict import Halves, Verdict
from nmpcrl.report.text import listed
from nmpcrl.report.verdicts import by_learner


def items(verdicts: Iterable[Verdict], runs: pd.DataFrame) -> str:
    """One item a claim that joins statements or learners: each by itself.

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
    return by_learner(verdict) or " ".join(_counted(list(group)) for _, group in groups)


def own(verdict: Verdict) -> str:
    """The same by the claim's own measure alone; "" for a claim that joins no statements."""
    return _counted(verdict.own_halves) if verdict.halves else ""


def stopped_early(runs: pd.DataFrame, learners: tuple[str, ...]) -> str:
    """How many runs count as keeping C7's constraints that were stopped in training."""
    asked = kept_without_noise(runs, learners)
    counts = (asked.kept & asked.stopped).groupby(level="learner", sort=False).sum()
    parts = listed(f"{count} of {name}" for name, count in counts.items() if count)
    return (
        f"Of those that kept them, {parts} had to be stopped in training; they are judged by their"
        " rollouts before that."
    )


def _beside(verdict: Verdict, runs: pd.DataFrame) -> tuple[str, ...]:
    asked_twice = {"C7": BY_RUNS["C7"], "W7": WIDER_CLAIMS["W7"]}.get(verdict.claim)
    if asked_twice:
        return (stopped_early(runs, asked_twice.learners),)
    return ()


def _counted(readings: Sequence[Halves]) -> str:
    first, second = readings[0].learners
    parts = [
        f"with noise that decays per {one.decay} in {one.counts[0]} of {one.pairs} runs of {first}"
        f" and {one.counts[1]} of {second} (pairs that differ: {one.apart}, as claimed:"
        f" {one.as_claimed}; McNemar's p = {one.p:.2g})"
        for one in readings
    ]
    return f"{readings[0].wrong.capitalize()}: {'; '.join(parts)}."

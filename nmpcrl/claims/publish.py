"""Publication of the study with times and searches made on this machine."""

from collections.abc import Mapping
from pathlib import Path

from nmpcrl.analysis.gradient_td import dropped_curvature
from nmpcrl.analysis.search import Search, search_all
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.bench.processes import time_learners_repeatedly
from nmpcrl.claims import published
from nmpcrl.claims.assumptions import measured
from nmpcrl.claims.paper_claims import BY_TIME
from nmpcrl.claims.rule import judge
from nmpcrl.claims.verdict import UNDECIDABLE, Verdict
from nmpcrl.study.design import LAYOUTS
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.store import fetch


def publish_study(
    runs: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]
) -> Path:
    """Write `book/published` anew, with searches, the audit of C8 and times of steps made here.

    Args:
        runs: all of `design.whole_study`.
        variants: the part of the study that each belongs to.
    """
    timings, searches = time_learners_repeatedly(), search_all([*map(Search, LAYOUTS)])
    records = fetch(published.AUDITED)
    audit = measured(published.AUDITED, records, dropped_curvature(records))
    return published.publish(runs, variants, timings=timings, searches=searches, audit=audit)


def publish_timing() -> tuple[Verdict, ...]:
    """Time the learners here, in ten rounds of fresh processes, and publish the times.

    Nothing is published unless the times decide all claims about time, since the machine may be
    busy.

    Returns:
        The verdicts on these claims.
    """
    timings = time_learners_repeatedly()
    judged = judge(BY_TIME, timings=timings)
    if UNDECIDABLE not in {verdict.outcome for verdict in judged}:
        published.republish(timings)
    return judged

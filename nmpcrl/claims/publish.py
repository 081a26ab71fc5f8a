"""The whole study judged: everything that `published` keeps, from the summaries of all runs."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from nmpcrl.analysis import summary
from nmpcrl.analysis.gradient_td import dropped_curvature
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.bench.processes import time_learners_afresh
from nmpcrl.claims import published
from nmpcrl.claims.assumptions import audit
from nmpcrl.claims.own_claims import judge_own
from nmpcrl.claims.paper_claims import judge, judge_times
from nmpcrl.claims.rule import UNDECIDABLE, Verdict
from nmpcrl.study.design import MAIN_TABLE
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.store import fetch_all

AUDITED = Experiment("GES")  # whose whole run C8 is measured in


def publish_study(
    runs: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]
) -> Path:
    """Judge the study, and write `book/published` anew.

    Args:
        runs: all of `design.whole_study`.
        variants: the part of the study that each belongs to.
    """
    timings = time_learners_afresh()
    return published.publish(runs, variants, verdicts(runs, variants, timings), timings)


def publish_timing() -> tuple[Verdict, ...]:
    """Time the learners here, and publish the verdicts that rest on it anew; all else stays.

    They are timed in several fresh processes. Nothing is published unless all verdicts are decided,
    since the machine may be busy.

    Returns:
        The verdicts.
    """
    timings = time_learners_afresh()
    judged = judge_times(timings)
    if UNDECIDABLE not in {verdict.outcome for verdict in judged}:
        published.republish(judged, timings)
    return judged


def verdicts(
    runs: Mapping[Experiment, RunSummary],
    variants: Mapping[Experiment, str],
    timings: pd.DataFrame,
) -> tuple[Verdict, ...]:
    """The verdicts on the paper's claims and on our own."""
    table = summary.table(runs)
    parts = [variants[e] for e in runs]
    main = table[[part == MAIN_TABLE for part in parts]]
    added = table[[part in (MAIN_TABLE, "controls") for part in parts]]
    study = fetch_all([AUDITED], progress=False)
    claimed = judge(
        main,
        paths={e: one.states for e, one in runs.items()},
        timings=timings,
        assumptions=audit(study, dropped_curvature(study[AUDITED])),
    )
    return (*claimed, *judge_own(added))

"""The whole study judged: everything that `published` keeps, from the summaries of all runs."""

from collections.abc import Mapping
from pathlib import Path

from nmpcrl.analysis import summary
from nmpcrl.analysis.gradient_td import dropped_curvature
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.bench.learners import time_learners
from nmpcrl.claims import published
from nmpcrl.claims.assumptions import audit
from nmpcrl.claims.own_claims import judge_additions
from nmpcrl.claims.paper_claims import judge
from nmpcrl.claims.rule import Verdict
from nmpcrl.study.design import MAIN_TABLE
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.store import fetch_all

AUDITED = Experiment("GES")  # whose whole run C8 is measured in
TIMED = 200  # steps of each learner, for C3 and C4


def publish_study(
    runs: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]
) -> Path:
    """Judge the study, and write `book/published` anew.

    Args:
        runs: all of `design.whole_study`.
        variants: the part of the study that each belongs to.
    """
    return published.publish(runs, variants, verdicts(runs, variants))


def verdicts(
    runs: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]
) -> tuple[Verdict, ...]:
    """The verdicts on the paper's claims and on our additions."""
    table = summary.table(runs)
    parts = [variants[e] for e in runs]
    main = table[[part == MAIN_TABLE for part in parts]]
    added = table[[part in (MAIN_TABLE, "controls") for part in parts]]
    study = fetch_all([AUDITED], progress=False)
    claimed = judge(
        main,
        paths={e: one.states for e, one in runs.items()},
        timings=time_learners(steps=TIMED),
        assumptions=audit(study, dropped_curvature(study[AUDITED])),
    )
    return (*claimed, *judge_additions(added))

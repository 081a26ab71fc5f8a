"""The whole study judged: everything that `published` keeps, from the summaries of all runs."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd

from nmpcrl.analysis.gradient_td import dropped_curvature
from nmpcrl.analysis.policy_search import Search, search_all
from nmpcrl.analysis.rows import cost_ratios, table
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.bench.processes import time_learners_repeatedly
from nmpcrl.claims import published
from nmpcrl.claims.assumptions import audit
from nmpcrl.claims.own_claims import judge_own
from nmpcrl.claims.paper_claims import judge, judge_times
from nmpcrl.claims.rule import Assumption, Paths
from nmpcrl.claims.thetas import FOLLOWED
from nmpcrl.claims.verdict import UNDECIDABLE, Verdict
from nmpcrl.claims.wider_claims import WIDER_THAN, judge_wider
from nmpcrl.study.design import LAYOUTS, MAIN_TABLE
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
    timings = time_learners_repeatedly()
    searches = search_all(map(Search, LAYOUTS))
    judged = verdicts(runs, variants, timings)
    return published.publish(runs, variants, judged, timings, searches)


def publish_timing() -> tuple[Verdict, ...]:
    """Time the learners here, and publish the verdicts that rest on it anew; all else stays.

    They are timed in fresh processes, ten times over. Nothing is published unless all verdicts are
    decided, since the machine may be busy.

    Returns:
        The verdicts.
    """
    timings = time_learners_repeatedly()
    judged = judge_times(timings)
    if UNDECIDABLE not in {verdict.outcome for verdict in judged}:
        published.republish(judged, timings)
    return judged


def publish_parts(
    runs: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]
) -> Path:
    """Publish some runs beside those that are there.

    Args:
        runs: of whole parts of the study that are not published yet.
        variants: the part that each belongs to.

    Raises:
        Unpublishable: as `published.extend`.
    """
    further = {e: one for e, one in runs.items() if variants[e] not in FOLLOWED}
    if len(further) < len(runs):
        raise published.Unpublishable(
            f"the parts {' and '.join(FOLLOWED)} are published with the whole study only"
        )
    return published.extend(further, variants)


def rejudge() -> tuple[Verdict, ...]:
    """Judge what is published, and publish the verdicts in the place of those that are there.

    No run is trained but the one that C8 is measured in, which takes seconds.

    Returns:
        The verdicts.
    """
    study = fetch_all([AUDITED], progress=False)
    judged = judge_published(published.load(), audit(study, dropped_curvature(study[AUDITED])))
    published.republish(judged)
    return judged


def judge_published(
    found: published.Published, assumptions: Iterable[Assumption] = ()
) -> tuple[Verdict, ...]:
    """The verdicts on what is published, from its tables alone.

    Args:
        found: what is published.
        assumptions: of `audit`, for C8; without them its published verdict stays.
    """
    rows = pd.DataFrame(list(found.rows.values()))
    ratios = cost_ratios(found.rows)
    paths = {e: one.states for e, one in found.summaries.items()}
    rows["cost_ratio"] = [ratios[e] for e in found.rows]
    made = _verdicts(rows, paths, found.timings, tuple(assumptions))
    kept = {v.claim: v for v in found.verdicts if not assumptions}
    return tuple(kept.get(v.claim, v) if v.claim == "C8" else v for v in made)


def verdicts(
    runs: Mapping[Experiment, RunSummary],
    variants: Mapping[Experiment, str],
    timings: pd.DataFrame,
) -> tuple[Verdict, ...]:
    """The verdicts on the paper's claims, on the wider ones and on our own."""
    rows = table(runs).assign(variant=[variants[e] for e in runs])
    study = fetch_all([AUDITED], progress=False)
    assumptions = audit(study, dropped_curvature(study[AUDITED]))
    return _verdicts(rows, {e: one.states for e, one in runs.items()}, timings, assumptions)


def _verdicts(
    rows: pd.DataFrame,
    paths: Paths,
    timings: pd.DataFrame,
    assumptions: tuple[Assumption, ...],
) -> tuple[Verdict, ...]:
    """All verdicts in the order of the paper's claims, each wider one after the one it widens."""
    main = rows[rows.variant == MAIN_TABLE]
    added = rows[rows.variant.isin([MAIN_TABLE, "controls"])]
    claimed = judge(main, paths=paths, timings=timings, assumptions=assumptions)
    wider = {WIDER_THAN[v.claim]: v for v in judge_wider(main, paths)}
    ordered = [v for one in claimed for v in (one, wider.get(one.claim)) if v]
    return (*ordered, *judge_own(added))

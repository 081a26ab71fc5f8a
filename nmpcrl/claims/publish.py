"""The study published and judged: verdicts are made from what is published alone."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from nmpcrl.analysis.gradient_td import dropped_curvature
from nmpcrl.analysis.policy_search import Search, search_all
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.bench.processes import time_learners_repeatedly
from nmpcrl.claims import published
from nmpcrl.claims.assumptions import audit
from nmpcrl.claims.own_claims import judge_own
from nmpcrl.claims.paper_claims import judge, judge_times
from nmpcrl.claims.rule import Assumption
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
    """Write `book/published` anew, with the times of learning steps here; `rejudge` judges it.

    Args:
        runs: all of `design.whole_study`.
        variants: the part of the study that each belongs to.
    """
    timings, searches = time_learners_repeatedly(), search_all(map(Search, LAYOUTS))
    return published.publish(runs, variants, timings=timings, searches=searches)


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

    They come in the order of the paper's claims, each wider one after the one it widens, and ours.

    Args:
        found: what is published.
        assumptions: of `audit`, for C8; without them its published verdict stays.
    """
    rows, paths, given = found.table, found.paths, tuple(assumptions)
    main = rows[rows.variant == MAIN_TABLE]
    added = rows[rows.variant.isin([MAIN_TABLE, "controls"])]
    claimed = judge(main, paths=paths, timings=found.timings, assumptions=given)
    wider = {WIDER_THAN[v.claim]: v for v in judge_wider(main, paths)}
    ordered = [v for one in claimed for v in (one, wider.get(one.claim)) if v]
    kept = {v.claim: v for v in found.verdicts if v.claim == "C8" and not given}
    return (*(kept.get(v.claim, v) for v in ordered), *judge_own(added))

"""The main study: runs of a chapter, published or trained here, and publication.

It is no `Investigation`: an `Experiment` of 26 fields names a row, the cost ratio and the failure
mode of a row depend on the row of its frozen arm, and `runs.npz` has arrays of its own.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.gradient_td import dropped_curvature
from nmpcrl.analysis.search import BUDGET, SearchResult, search
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.bench.learners import time_learners_repeatedly
from nmpcrl.claims import published
from nmpcrl.claims.assumptions import Measurement, measured
from nmpcrl.claims.paper_claims import BY_TIME
from nmpcrl.claims.published import BITS, COLUMNS, FOLLOWED, Evidence, Published
from nmpcrl.claims.rule import judge
from nmpcrl.claims.verdict import UNDECIDABLE
from nmpcrl.study import design, paper
from nmpcrl.study import published as store
from nmpcrl.study.experiment import Experiment, frozen_arm
from nmpcrl.study.jobs import parallel
from nmpcrl.study.parameters import one_of
from nmpcrl.study.provenance import EPOCHS, made_here
from nmpcrl.study.published import Unpublishable
from nmpcrl.study.records import Column
from nmpcrl.study.store import fetch


def needed(source: str, **asked: Any) -> tuple[Experiment, ...]:
    """The runs of `design.main_table` to train here, and the run with theta frozen beside each.

    The source is "fresh" for all runs, or "published" for the runs that are not published.
    """
    one_of(("published", "fresh")).check("study", source)
    runs, known = _asked(**asked), published.load().summaries
    return tuple(e for e in runs if source == "fresh" or e not in known)


def gather(source: str, *, variants: bool = False, **asked: Any) -> Evidence:
    """The runs of a chapter; runs of `needed` are trained if they are not stored.

    With `variants` the published controls and variants are added.
    """
    runs, known = dict.fromkeys(_asked(**asked), design.MAIN_TABLE), published.load()
    parts = {e: part for e, part in known.variants.items() if part != design.MAIN_TABLE}
    parts = (parts if variants else {}) | runs
    found = known.joined(fetch_summaries(needed(source, **asked)), runs).among(parts)
    return replace(found, runs=found.runs.assign(variant=[*parts.values()]))


def _asked(**asked: Any) -> tuple[Experiment, ...]:
    runs = design.main_table(**asked)
    return tuple(dict.fromkeys((*runs, *map(frozen_arm, runs))))


def publish_study(
    runs: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str], *, anew: bool
) -> Path:
    """As `publish_runs`, with the main table also the audit of C8 and the searches, made here.

    The whole study is published `anew`, with times of steps that are taken here.
    """
    timings = time_learners_repeatedly() if anew else None
    if design.MAIN_TABLE not in {variants[e] for e in runs}:
        return publish_runs(runs, variants, anew=anew)
    records = fetch(published.AUDITED)
    audit = measured(published.AUDITED, records, dropped_curvature(records))
    place = publish_runs(runs, variants, anew=anew, audit=audit)
    best = dict(parallel(search, design.LAYOUTS))
    publish_searches({layout: best[layout] for layout in design.LAYOUTS})
    if timings is not None:
        publish_times(timings)
    return place


def publish_runs(
    runs: Mapping[Experiment, RunSummary],
    variants: Mapping[Experiment, str],
    *,
    anew: bool = False,
    audit: Measurement | None = None,
) -> Path:
    """Publish runs that were trained here beside the published ones, in the folder returned.

    The run with theta frozen beside each must be among these or those. Parts that were published in
    earlier epochs are replaced, and must be whole; all published runs are forgotten if `anew`.
    """
    earlier = Published() if anew else published.load()
    known = {*earlier.rows, *runs}
    older = {part for part in earlier.parts if store.epochs(earlier.about, part) != EPOCHS}
    for e in runs:
        part = earlier.variants.get(e)
        if part is not None and part not in older:
            raise Unpublishable(f"{e} is published already, in the part {part!r}")
        if frozen_arm(e) not in known:
            raise Unpublishable(f"{frozen_arm(e)}, with which {e} is compared, is not published")
    replaced = older & {earlier.variants.get(e, "") for e in runs}
    for e, part in earlier.variants.items():
        if part in replaced and e not in runs:
            raise Unpublishable(f"{e} is missing: the part {part!r} is of earlier epochs")
    every = earlier.joined(runs, variants)
    new = every.runs[every.runs.source == "fresh"]
    counts = new.variant.value_counts(sort=False).to_dict()
    batch = made_here() | {"runs": counts, "hours": _hours(new)}
    batch |= {"audit": asdict(audit)} if audit else {}
    rows, arrays = every.runs[[*COLUMNS]], _curves(every)
    kept = store.without(earlier.batches, replaced)
    for one in (one for one in kept if one not in earlier.batches):
        one |= {"hours": _hours(earlier.runs[earlier.runs.variant.isin(one["runs"])])}
        for name in ("audit", "thetas") if design.MAIN_TABLE in replaced else ():
            one.pop(name, None)
    return _written(published.RUNS, rows, batch, kept, arrays)


def _hours(runs: pd.DataFrame) -> float:
    """The hours that runs took on one core."""
    return float(runs.seconds.sum() / 3600)


def publish_searches(searches: Mapping[str, SearchResult]) -> Path:
    """Replace the published searches by those of some layouts, with seed 0 and `BUDGET`."""
    rows = [{"layout": n, "seed": 0, "budget": BUDGET} | asdict(one) for n, one in searches.items()]
    return _written(published.SEARCHES, pd.DataFrame(rows), made_here())


def publish_times(timings: pd.DataFrame) -> Path:
    """Replace the published times by those of `time_learners_repeatedly`, taken here.

    Raises:
        Unpublishable: they do not decide all claims about time, as of a busy machine.
    """
    judged = judge(BY_TIME, timings=timings)
    open_claims = ", ".join(one.claim for one in judged if one.outcome == UNDECIDABLE)
    if open_claims:
        raise Unpublishable(f"times that leave {open_claims} open: take them on an idle machine")
    return _written(published.TIMINGS, timings, made_here())


def _written(
    name: str,
    table: pd.DataFrame,
    batch: Mapping[str, Any],
    earlier: Iterable[Mapping[str, Any]] = (),
    arrays: Mapping[str, Column] | None = None,
) -> Path:
    path = store.write(name, table, arrays, batch=batch, earlier=earlier)
    published._load.cache_clear()
    return path.parent


def _curves(found: Evidence) -> dict[str, Column]:
    """The columns of all runs, padded with nan; shape (runs, ...)."""
    runs, parts = found.summaries.values(), found.variants.values()
    none = np.empty((0, len(paper.THETA_INIT)))
    thetas = [
        one.episodes.get("theta", none) if part in FOLLOWED else none
        for one, part in zip(runs, parts, strict=True)
    ]
    return {
        "cost": _padded([one.episodes["cost"] for one in runs]),
        "judged_after": _padded([one.evaluations["episode"] for one in runs]),
        "judged_cost": _padded([one.evaluations["cost"] for one in runs]),
        "judged_theta": _padded([one.evaluations["theta"] for one in runs]),
        "states": _padded([one.states for one in runs]),
        BITS: np.diff(_padded(thetas).view(np.int32), axis=1, prepend=np.int32(0)),
    }


def _padded(columns: list[Column]) -> Column:
    longest = max(map(len, columns))
    result = np.full((len(columns), longest, *columns[0].shape[1:]), np.nan, np.float32)
    for into, column in zip(result, columns, strict=True):
        into[: len(column)] = column
    return result

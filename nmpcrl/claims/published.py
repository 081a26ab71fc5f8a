"""The published study of layouts A to F, in `book/published`.

- `runs.csv`: one row a run, `rows.row`, with its part of the study, its key and its failure mode;
- `runs.npz`: the arrays that figures need, in the same order: training cost by episode, cost and
  theta of the rollouts without noise, the states of the last one, and theta after every episode of
  the runs that a reader can follow (see `thetas`);
- `searches.csv`: the best theta that `analysis.search` finds in each layout;
- `timings.csv`: of `time_learners`, for the verdicts on time.

The verdicts are computed from these when they are read.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cache, cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.rows import FIELDS, OLDER, OUTCOME, cost_ratios, experiment_of, row
from nmpcrl.analysis.search import Found, Search
from nmpcrl.analysis.summary import Outline, RunSummary
from nmpcrl.claims import assumptions, thetas
from nmpcrl.claims.assumptions import Measured
from nmpcrl.claims.failure_modes import FAILURE_MODE, failure_mode, failure_modes, went_wrong
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import CLAIMS, WIDER_CLAIMS, WIDER_THAN
from nmpcrl.claims.rule import Claim, Observations
from nmpcrl.claims.verdict import Verdict
from nmpcrl.study import design
from nmpcrl.study import published as store
from nmpcrl.study.experiment import Experiment, frozen_arm
from nmpcrl.study.provenance import made_here, summary_key
from nmpcrl.study.published import Damaged, Unpublishable
from nmpcrl.study.published import folder as place
from nmpcrl.study.records import Column

__all__ = ["Damaged", "Published", "Unpublishable", "extend", "load", "place", "publish"]

RUNS, SEARCHES, TIMINGS = "runs", "searches", "timings"
COLUMNS = (*FIELDS, *OUTCOME, "variant", "key", *FAILURE_MODE)
AUDITED = Experiment("GES")  # the run in which the assumptions of C8 are measured

WIDER = {narrow: wider for wider, narrow in WIDER_THAN.items()}
ORDER = [one for claim in CLAIMS for one in (claim, WIDER.get(claim)) if one]
EVERY: dict[str, Claim] = {  # in the order of the verdicts
    **{one: {**CLAIMS, **WIDER_CLAIMS}[one] for one in ORDER},
    **OWN_CLAIMS,
}


@dataclass(frozen=True, eq=False)
class Published:
    """The published study; `thetas` says which runs have theta after every episode."""

    summaries: Mapping[Experiment, Outline] = field(default_factory=dict)  # single precision
    variants: Mapping[Experiment, str] = field(default_factory=dict)  # the part each belongs to
    rows: Mapping[Experiment, dict[str, Any]] = field(default_factory=dict)  # of `runs.csv`
    timings: pd.DataFrame = field(default_factory=pd.DataFrame)  # of `time_learners`
    about: Mapping[str, Any] = field(default_factory=dict)  # the manifest's entry of the runs
    searches: Mapping[Search, Found] = field(default_factory=dict)
    timed: Mapping[str, Any] = field(default_factory=dict)  # date, machine and so on of `timings`

    @cached_property
    def table(self) -> pd.DataFrame:
        """All rows, with `cost_ratio` as `rows.table` has it."""
        ratios = [*cost_ratios(self.rows).values()]
        return pd.DataFrame([*self.rows.values()]).assign(cost_ratio=ratios)

    @property
    def paths(self) -> dict[Experiment, Column]:
        """States of each run's last rollout, as `rule.Observations` takes them."""
        return {e: one.states for e, one in self.summaries.items()}

    @property
    def main(self) -> pd.DataFrame:
        """The rows of the main table."""
        parts = self.variants.items()
        return pd.DataFrame([self.rows[e] for e, part in parts if part == design.MAIN_TABLE])

    @property
    def batches(self) -> tuple[Mapping[str, Any], ...]:
        """Date, machine, versions, hours and numbers of runs of each publication, in order."""
        return tuple(self.about.get("batches", ()))

    @property
    def parts(self) -> dict[str, int]:
        """The number of runs of each part of the study."""
        return {part: n for batch in self.batches for part, n in batch["runs"].items()}

    @cached_property
    def verdicts(self) -> tuple[Verdict, ...]:
        """On the paper's claims, each followed by its wider one, and on our own."""
        return tuple(map(self.verdict, EVERY)) if self.rows else ()

    @cache  # noqa: B019 - one study a process
    def verdict(self, claim: str) -> Verdict:
        """The verdict on a claim, from the published data alone."""
        return EVERY[claim].judge(self._added if claim in OWN_CLAIMS else self._main)

    @cached_property
    def _main(self) -> Observations:
        runs, found = self.table, [one["audit"] for one in self.batches if "audit" in one]
        made = assumptions.audit(AUDITED, Measured(**found[0])) if found else ()
        return Observations(runs[runs.variant == design.MAIN_TABLE], self.paths, self.timings, made)

    @cached_property
    def _added(self) -> Observations:
        return Observations(self.table[self.table.variant.isin(thetas.FOLLOWED)])


def load() -> Published:
    """The published study.

    Raises:
        Damaged: a file is missing, or is not the file that was written.
    """
    return _load(place())


@cache
def _load(folder: Path) -> Published:
    about, runs = store.about(RUNS, folder), store.read(RUNS, folder).to_dict("records")
    rows = {
        experiment_of(one): {name: one.get(name, OLDER.get(name, np.nan)) for name in COLUMNS}
        for one in runs
    }
    curves = store.arrays(RUNS, folder)
    followed = thetas.unpacked(curves)
    timed = store.about(TIMINGS, folder).get("batches", [{}])[-1]
    searches = {
        Search(one.layout, one.seed, one.budget): Found(
            tuple(one.theta), one.made, tuple(one.rollouts), tuple(one.best)
        )
        for one in _table(SEARCHES, folder).itertuples()
    }
    return Published(
        {e: _outline_of(one, curves, i, followed) for i, (e, one) in enumerate(rows.items())},
        {e: one["variant"] for e, one in rows.items()},
        rows,
        _table(TIMINGS, folder),
        about,
        searches,
        timed,
    )


def _table(name: str, folder: Path) -> pd.DataFrame:
    """A published table; empty if none is published."""
    return store.read(name, folder) if store.about(name, folder) else pd.DataFrame()


def publish(
    summaries: Mapping[Experiment, RunSummary],
    variants: Mapping[Experiment, str],
    timings: pd.DataFrame | None = None,
    searches: Mapping[Search, Found] = MappingProxyType({}),
    audit: Measured | None = None,
) -> Path:
    """Publish the whole study anew, in the folder that is returned.

    Args:
        summaries: the runs.
        variants: the part of the study of each run.
        timings: of `time_learners`.
        searches: for the best theta.
        audit: of `AUDITED`.
    """
    labels = {e: {"variant": variants[e], "key": summary_key(e)} for e in summaries}
    runs = pd.DataFrame([row(one) | labels[e] for e, one in summaries.items()])
    runs = runs.join(failure_modes(summaries))
    arrays = _curves(summaries.values()) | thetas.packed(summaries, variants)
    measured = {"audit": asdict(audit)} if audit else {}
    store.write(RUNS, runs, arrays, batch=_batch(runs) | measured, anew=True)
    if timings is not None:
        republish(timings)
    if searches:
        found = pd.DataFrame([asdict(one) | asdict(result) for one, result in searches.items()])
        store.write(SEARCHES, found, batch=made_here(), anew=True)
    _load.cache_clear()
    return place()


def republish(timings: pd.DataFrame) -> Path:
    """Replace the published times by times of `time_learners` that were taken here."""
    path = store.write(TIMINGS, timings, batch=made_here(), anew=True)
    _load.cache_clear()
    return path.parent


def extend(summaries: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]) -> Path:
    """Publish further runs beside the published ones; arguments as for `publish`.

    Raises:
        Damaged: a file is missing, or is not the file that was written.
        Unpublishable: a run is published already, or its frozen arm is not published, or its part
            is published with the complete study only.
    """
    found, before = load(), store.arrays(RUNS)
    runs = pd.DataFrame([_row_beside(found, e, one, variants[e]) for e, one in summaries.items()])
    table = pd.DataFrame([*found.rows.values(), *runs.to_dict("records")])
    curves = before | _curves(summaries.values(), before)
    store.write(RUNS, table, curves, batch=_batch(runs))
    _load.cache_clear()
    return place()


def _batch(runs: pd.DataFrame) -> dict[str, Any]:
    """Where and how rows were made, how many of each part, and in how many hours of one core."""
    counts = runs.variant.value_counts(sort=False).to_dict()
    return made_here() | {"runs": counts, "hours": float(runs.seconds.sum() / 3600)}


def _row_beside(found: Published, e: Experiment, one: RunSummary, part: str) -> dict[str, Any]:
    """The row of a further run, with its failure mode beside the published frozen arm."""
    arm = frozen_arm(e)
    if part in thetas.FOLLOWED:
        raise Unpublishable(f"the part {part!r} is published with the complete study only")
    if e in found.rows:
        raise Unpublishable(f"{e} is published already, in the part {found.variants[e]!r}")
    if arm not in found.rows:
        raise Unpublishable(f"the frozen arm of {e} is not published, so it has nothing beside it")
    made = row(one)
    ratio = made["training_cost"] / found.rows[arm]["training_cost"]
    (wrong,) = went_wrong(pd.DataFrame([made | {"cost_ratio": ratio}]))
    mode = failure_mode(one, wrong, found.summaries[arm].states)
    return made | {"variant": part, "key": summary_key(e)} | mode


def _curves(
    summaries: Iterable[RunSummary], before: Mapping[str, Column] = MappingProxyType({})
) -> dict[str, Column]:
    """Columns of all runs below those of earlier runs, padded with nan; shape (runs, ...)."""
    made = [*summaries]
    columns = {
        "cost": [one.episodes["cost"] for one in made],
        "judged_after": [one.evaluations["episode"] for one in made],
        "judged_cost": [one.evaluations["cost"] for one in made],
        "judged_theta": [one.evaluations["theta"] for one in made],
        "states": [one.states for one in made],
    }
    return {name: _padded([*before.get(name, ()), *new]) for name, new in columns.items()}


def _padded(columns: list[Column]) -> Column:
    longest = max(map(len, columns))
    result = np.full((len(columns), longest, *columns[0].shape[1:]), np.nan, np.float32)
    for into, column in zip(result, columns, strict=True):
        into[: len(column)] = column
    return result


def _outline_of(
    row: dict[str, Any], curves: Mapping[str, Column], i: int, followed: Mapping[int, Column]
) -> Outline:
    experiment, judged = asdict(experiment_of(row)), np.isfinite(curves["judged_after"][i])
    known = {"cost": curves["cost"][i]} | ({"theta": followed[i]} if i in followed else {})
    evaluations = {
        "episode": curves["judged_after"][i][judged].astype(int),
        "theta": curves["judged_theta"][i][judged],
        "cost": curves["judged_cost"][i][judged],
    }
    facts = {"stopped": row["stopped"], "seconds": row["seconds"]}
    episodes = {name: column[: experiment["episodes"]] for name, column in known.items()}
    states = curves["states"][i][: experiment["steps"]]
    return Outline(experiment, episodes, evaluations, states, None, facts)

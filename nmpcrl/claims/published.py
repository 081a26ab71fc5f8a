"""The published study of layouts A to F, in `book/published`.

- `runs.csv`: one row a run, `rows.row`, with its part of the study, its key and its failure mode;
- `runs.npz`: the arrays that figures need, in the same order: training cost by episode, cost and
  theta of the rollouts without noise, the states of the last one, and theta after every episode of
  runs in `FOLLOWED` (the differences of its bits along the episodes, which compress better);
- `searches.csv`: the best theta that `analysis.search` finds in each layout;
- `timings.csv`: of `time_learners`, for the verdicts on time.

The verdicts are computed from these when they are read.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.rows import FIELDS, OLDER, OUTCOME, THETA, cost_ratios, experiment_of, row
from nmpcrl.analysis.search import SearchResult
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims import assumptions
from nmpcrl.claims.assumptions import Measurement
from nmpcrl.claims.failure_modes import FAILURE_MODE, WELL, failure_modes
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import CLAIMS, WIDER_CLAIMS
from nmpcrl.claims.rule import Claim, Observations
from nmpcrl.claims.verdict import Verdict
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import design
from nmpcrl.study import published as store
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.provenance import summary_key
from nmpcrl.study.published import Damaged as Damaged
from nmpcrl.study.published import folder as folder
from nmpcrl.study.records import Column, Stopped
from nmpcrl.study.setup import controller_of
from nmpcrl.study.store import Runs

RUNS, SEARCHES, TIMINGS = "runs", "searches", "timings"
COLUMNS = (*FIELDS, *OUTCOME, "variant", "key", *FAILURE_MODE)  # of `runs.csv`
BITS = "theta_bits"
FOLLOWED = (design.MAIN_TABLE, "controls")  # parts of the study; the variants change one thing
AUDITED = Experiment("GES")  # the run in which the assumptions of C8 are measured

EVERY: dict[str, Claim] = {  # in the order of the verdicts: C7 before W7
    **dict(sorted({**CLAIMS, **WIDER_CLAIMS}.items(), key=lambda one: one[0][::-1])),
    **OWN_CLAIMS,
}


@dataclass(frozen=True, eq=False)
class Evidence:
    """Runs and their summaries, in the same order."""

    summaries: Runs[RunSummary] = field(default_factory=lambda: Runs({}))
    runs: pd.DataFrame = field(  # `COLUMNS`, with `cost_ratio` as in `rows.table`
        default_factory=lambda: pd.DataFrame(columns=[*COLUMNS, "source", "cost_ratio"])
    )

    @cached_property
    def rows(self) -> dict[Experiment, dict[str, Any]]:
        """The row of each run."""
        return dict(zip(self.summaries, self.runs.to_dict("records"), strict=True))

    @property
    def variants(self) -> dict[Experiment, str]:
        """The part of the study that each run belongs to."""
        return dict(zip(self.summaries, self.runs.variant, strict=True))

    @property
    def paths(self) -> dict[Experiment, Column]:
        """States of each run's last rollout, as `rule.Observations` takes them."""
        return {e: one.states for e, one in self.summaries.items()}

    @cached_property
    def main(self) -> "Evidence":
        """The runs of the main table alone."""
        return self.where(self.runs.variant == design.MAIN_TABLE)

    def where(self, holds: Iterable[bool]) -> "Evidence":
        """The runs with a true value in `holds`."""
        return self.among(compress(self.summaries, holds))

    def among(self, experiments: Iterable[Experiment]) -> "Evidence":
        """These runs alone, in this order."""
        at, chosen = {e: i for i, e in enumerate(self.summaries)}, [*experiments]
        runs = self.runs.iloc[[at[e] for e in chosen]].reset_index(drop=True)
        return Evidence(Runs({e: self.summaries[e] for e in chosen}), runs)

    def joined(
        self, fresh: Mapping[Experiment, RunSummary], variants: Mapping[Experiment, str]
    ) -> "Evidence":
        """These runs and fresh ones, trained here, which replace runs of the same name.

        `variants` name the part of the study of each fresh run.
        """
        if not fresh:
            return self
        every: dict[Experiment, RunSummary] = {**self.summaries, **fresh}
        made = {
            e: row(one) | {"variant": variants[e], "key": summary_key(e), "source": "fresh"}
            for e, one in fresh.items()
        }
        ratios = cost_ratios(self.rows | made)
        new = pd.DataFrame([one | {"cost_ratio": ratios[e]} for e, one in made.items()])
        new = new.join(failure_modes(fresh, new, every))
        rows = self.rows | dict(zip(fresh, new.to_dict("records"), strict=True))
        runs = pd.DataFrame([one | {"cost_ratio": ratios[e]} for e, one in rows.items()])
        return Evidence(Runs(every), runs)

    @property
    def mark(self) -> str:
        """How many runs were trained here and how many are published, for a caption."""
        names = {"fresh": "trained for this page", "published": "published"}
        counts = {name: int((self.runs.source == source).sum()) for source, name in names.items()}
        return ", ".join(f"{n} runs {name}" for name, n in counts.items() if n) or "no runs"

    @property
    def origin(self) -> str:
        """The origin of the runs, for numbers on pages."""
        return "the published main table" if self.is_published else self.mark

    @property
    def is_published(self) -> bool:
        """Whether these runs are the complete published main table."""
        fresh = (self.runs.source == "fresh").any()
        return not fresh and {*self.summaries} == {*load().main.summaries}

    @property
    def wrong(self) -> pd.DataFrame:
        """The runs that went wrong; `run` is each one's experiment."""
        runs = self.runs.assign(run=list(self.summaries))
        return runs[~runs.mechanism.isin(("", WELL))]


@dataclass(frozen=True, eq=False)
class Published(Evidence):
    """The published study; numbers by episode are in single precision."""

    timings: pd.DataFrame = field(default_factory=pd.DataFrame)  # of `time_learners`
    about: Mapping[str, Any] = field(default_factory=dict)  # the manifest's entry of the runs
    searches: Mapping[str, SearchResult] = field(default_factory=dict)  # by layout
    timed: Mapping[str, Any] = field(default_factory=dict)  # date, machine and so on of `timings`

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
        return tuple(map(self.verdict, EVERY)) if len(self.runs) else ()

    @cache  # noqa: B019 - one study a process
    def verdict(self, claim: str) -> Verdict:
        """The verdict on a claim, from the published data alone."""
        if claim in OWN_CLAIMS:
            return EVERY[claim].judge(Observations(self.runs[self.runs.variant.isin(FOLLOWED)]))
        found = [one["audit"] for one in self.batches if "audit" in one]
        made = assumptions.audit(AUDITED, Measurement(**found[-1])) if found else ()
        return EVERY[claim].judge(Observations(self.main.runs, self.paths, self.timings, made))


def load() -> Published:
    """The published study; `Damaged` if a file is missing, or is not the one that was written."""
    return _load(folder())


@cache
def _load(place: Path) -> Published:
    runs, curves = store.read(RUNS, place), store.arrays(RUNS, place)
    runs = runs.assign(**{name: OLDER[name] for name in FIELDS if name not in runs})
    curves["theta"] = np.cumsum(curves[BITS], axis=1, dtype=np.int32).view(np.float32)
    rows = {experiment_of(one): one for one in runs.to_dict("records")}
    outlines = {
        e: _outline(e, one, {name: column[i] for name, column in curves.items()})
        for i, (e, one) in enumerate(rows.items())
    }
    ratios = [*cost_ratios(rows).values()]
    searches = {
        one.layout: SearchResult(tuple(one.theta), one.made, tuple(one.rollouts), tuple(one.best))
        for one in _table(SEARCHES, place).itertuples()
    }
    return Published(
        Runs(outlines),
        runs.reindex(columns=COLUMNS).assign(source="published", cost_ratio=ratios),
        _table(TIMINGS, place),
        store.about(RUNS, place),
        searches,
        store.about(TIMINGS, place).get("batches", [{}])[-1],
    )


def _table(name: str, place: Path) -> pd.DataFrame:
    """A published table; empty if none is published."""
    return store.read(name, place) if store.about(name, place) else pd.DataFrame()


def _outline(e: Experiment, row: Mapping[str, Any], curves: Mapping[str, Column]) -> RunSummary:
    judged = np.isfinite(curves["judged_after"])
    known = ["cost", "theta"] if np.isfinite(curves["theta"]).any() else ["cost"]
    evaluations = {
        "episode": curves["judged_after"][judged].astype(int),
        "theta": curves["judged_theta"][judged],
        "cost": curves["judged_cost"][judged],
    }
    facts = {"stopped": row["stopped"], "seconds": row["seconds"]}
    episodes = {name: curves[name][: e.episodes] for name in known}
    states, no_actions = curves["states"][: e.steps], np.empty((0, 2))
    return RunSummary(asdict(e), episodes, evaluations, states, no_actions, facts)


def with_inputs(found: Evidence) -> Evidence:
    """The finished runs with the inputs of their last rollouts, solved for from the final theta.

    Published runs lack inputs, and stopped runs have no final policy.
    """
    finished = found.where(found.runs.stopped == Stopped.FINISHED)
    thetas = finished.runs[[*THETA]].to_numpy(float)
    made: dict[Experiment, RunSummary] = {
        e: one if len(one.actions) else replace(one, actions=_inputs(e, theta))
        for (e, one), theta in zip(finished.summaries.items(), thetas, strict=True)
    }
    return replace(finished, summaries=Runs(made))


def _inputs(experiment: Experiment, theta: Vector) -> Column:
    """Inputs of a rollout without noise, shape (K + 1, m); nan after a failed solve."""
    actions = evaluate(controller_of(experiment), theta, experiment.steps).actions
    missing = ((0, experiment.steps - len(actions)), (0, 0))
    return np.pad(actions, missing, constant_values=np.nan)

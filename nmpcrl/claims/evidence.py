"""Where a chapter's evidence comes from: runs trained here, published ones, or both.

`book/published` holds the whole study as it was trained once. A reader's machine trains a part of
it afresh, which takes the place of the published runs of the same name; so a figure or a verdict
can rest on both, and says so.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import pandas as pd

from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.analysis.summary import RunSummary, cost_ratios, table
from nmpcrl.claims.failure_modes import WELL
from nmpcrl.claims.published import failure_modes_of, load
from nmpcrl.study import design, paper
from nmpcrl.study.experiment import MAIN, Experiment, frozen_arm
from nmpcrl.study.parameters import OneOf, ParameterError
from nmpcrl.study.records import Column
from nmpcrl.study.store import Runs

SOURCES = ("fresh", "published")


@dataclass(frozen=True, eq=False)
class Evidence:
    """Runs, their summaries, and where each comes from."""

    summaries: Runs[RunSummary]  # a published one has fewer columns: see `Published`
    runs: pd.DataFrame  # `summary.table` with `variant` and `source`, one row a run, in that order

    @cached_property
    def main(self) -> "Evidence":
        """The runs of the main table alone."""
        return self.where(self.runs.variant == design.MAIN_TABLE)

    def where(self, holds: Iterable[bool]) -> "Evidence":
        """The runs for which it holds."""
        kept = list(holds)
        chosen = {
            one: summary
            for (one, summary), keep in zip(self.summaries.items(), kept, strict=True)
            if keep
        }
        return Evidence(Runs(chosen), self.runs[kept].reset_index(drop=True))

    @property
    def mark(self) -> str:
        """What was trained here and what is published, for a caption."""
        fresh = int((self.runs.source == "fresh").sum())
        counts = {"trained for this page": fresh, "published": len(self.runs) - fresh}
        parts = [f"{count} runs {where}" for where, count in counts.items() if count]
        return ", ".join(parts) or "no runs"

    @property
    def wrong(self) -> pd.DataFrame:
        """The runs that went wrong, those trained here first; `run` is each one's experiment."""
        runs = self.runs.assign(run=list(self.summaries))
        runs = runs[~runs.mechanism.isin(("", WELL))]
        return runs.sort_values("source", kind="stable")

    @property
    def examples(self) -> dict[str, Experiment]:
        """The first run that went wrong of each mechanism."""
        return dict(self.wrong.drop_duplicates("mechanism").set_index("mechanism").run)


def needed(
    source: str,
    *,
    learners: Sequence[str] = MAIN,
    layouts: Sequence[str] = design.LAYOUTS,
    seeds: Sequence[int] = design.SEEDS,
    episodes: int = paper.EPISODES,
) -> tuple[Experiment, ...]:
    """The runs of the main table that have to be trained here.

    All that is asked for and not published, if `source` is "fresh", and of what is published
    `design.fresh`; none if it is "published".

    Raises:
        ParameterError: a value is not what it may be, or something asked for is not published.
    """
    OneOf(SOURCES).check("study", source)
    asked = _asked(learners, layouts, seeds, episodes)
    known = load().summaries
    if source == "published":
        for experiment in asked:
            if experiment not in known:
                raise ParameterError(
                    f"study = 'published' holds no run of {experiment} over {experiment.episodes}"
                    " episodes; study = 'fresh' trains it"
                )
        return ()
    afresh = set(design.fresh())
    return tuple(e for e in asked if e in afresh or e not in known)


def gather(
    source: str, *, variants: bool = False, **asked: Sequence[str] | Sequence[int] | int
) -> Evidence:
    """The runs that a chapter rests on; what `needed` names is trained if it is not stored.

    Args:
        source: "fresh" or "published".
        variants: whether to add the published controls and variants.
        asked: as `needed` takes it.

    Raises:
        ParameterError: as `needed`.
    """
    here = fetch_summaries(needed(source, **asked))  # type: ignore[arg-type]
    published = load()
    wanted: dict[Experiment, str] = dict.fromkeys(_asked(**asked), design.MAIN_TABLE)  # type: ignore[arg-type]
    if variants:
        wanted = {
            e: name for e, name in published.variants.items() if name != design.MAIN_TABLE
        } | wanted
    summaries: dict[Experiment, RunSummary] = {
        e: here[e] if e in here else published.summaries[e] for e in wanted
    }
    made = table(here).join(failure_modes_of(here)) if here else table(here)
    rows = {**published.rows, **dict(zip(here, made.to_dict("records"), strict=True))}
    runs = pd.DataFrame([rows[e] for e in wanted])
    runs["variant"] = list(wanted.values())
    runs["source"] = ["fresh" if e in here else "published" for e in wanted]
    ratios = cost_ratios(rows)
    runs["cost_ratio"] = [ratios[e] for e in wanted]
    return Evidence(Runs(summaries), runs)


def paths(evidence: Evidence) -> Mapping[Experiment, Column]:
    """States of each run's last rollout, as `paper_claims.judge` takes them."""
    return {experiment: summary.states for experiment, summary in evidence.summaries.items()}


def _asked(
    learners: Sequence[str] = MAIN,
    layouts: Sequence[str] = design.LAYOUTS,
    seeds: Sequence[int] = design.SEEDS,
    episodes: int = paper.EPISODES,
) -> tuple[Experiment, ...]:
    runs = design.main_table(learners, layouts, seeds, episodes)
    return tuple(dict.fromkeys((*runs, *map(frozen_arm, runs))))

"""Where a chapter's evidence comes from: published runs, or runs trained here.

`book/published` holds the whole study as it was trained once, and the book speaks of that. Whoever
asks for other runs, or for runs of his own, gets those; every figure says whose it shows. What a
reader's machine makes of a part of the published study is a check, and stands by itself: see
`reproduce.agreement`.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.rows import THETA, cost_ratios, table
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.analysis.summary import Outline
from nmpcrl.claims.failure_modes import WELL
from nmpcrl.claims.published import failure_modes_of, load
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import design, paper
from nmpcrl.study.experiment import MAIN, Experiment, frozen_arm
from nmpcrl.study.parameters import TRUTH, one_of
from nmpcrl.study.records import Column, Stopped
from nmpcrl.study.setup import controller_of
from nmpcrl.study.store import Runs

SOURCES = ("published", "fresh")


@dataclass(frozen=True, eq=False)
class Evidence:
    """Runs, their summaries, and where each comes from."""

    summaries: Runs[Outline]
    runs: pd.DataFrame  # `rows.table` with `variant` and `source`, one row a run, in that order

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
    def origin(self) -> str:
        """Whose runs these are, where and in which readings, for numbers on pages."""
        if self.is_published:
            return "the published main table"
        names = {"layouts": "layout", "noise per": "decay"}
        parts = [f"{words} {_named(self.runs[column])}" for words, column in names.items()]
        return f"{self.mark}, of {_named(self.runs.learner)}; {'; '.join(parts)}"

    @property
    def is_published(self) -> bool:
        """Whether this is the published main table, whole."""
        parts = load().variants.items()
        main = {e for e, part in parts if part == design.MAIN_TABLE}
        return set(self.summaries) == main and set(self.runs.source) == {"published"}

    @property
    def wrong(self) -> pd.DataFrame:
        """The runs that went wrong; `run` is each one's experiment."""
        runs = self.runs.assign(run=list(self.summaries))
        return runs[~runs.mechanism.isin(("", WELL))]


def needed(
    source: str,
    *,
    learners: Sequence[str] = MAIN,
    layouts: Sequence[str] = design.LAYOUTS,
    seeds: Sequence[int] = design.SEEDS,
    episodes: int = paper.EPISODES,
) -> tuple[Experiment, ...]:
    """The runs of the main table that have to be trained here, with their frozen arms.

    All that are asked for if `source` is "fresh", and those that are not published if it is
    "published".

    Raises:
        ParameterError: a value is not what it may be.
    """
    one_of(SOURCES).check("study", source)
    asked, known = _asked(learners, layouts, seeds, episodes), load().summaries
    return tuple(e for e in asked if source == "fresh" or e not in known)


def repeatable(
    repeat: bool, **asked: Sequence[str] | Sequence[int] | int
) -> tuple[Experiment, ...]:
    """Of the runs asked for, the published ones that a build trains again: those of `design.fresh`.

    None unless `repeat` holds.

    Raises:
        ParameterError: `repeat` is neither true nor false, or a value is not what it may be.
    """
    again = set(design.fresh()) if TRUTH.check("repeat", repeat) else set()
    known = load().summaries
    return tuple(e for e in _asked(**asked) if e in again and e in known)  # type: ignore[arg-type]


def gather(
    source: str, *, variants: bool = False, **asked: Sequence[str] | Sequence[int] | int
) -> Evidence:
    """The runs that a chapter rests on; what `needed` names is trained if it is not stored.

    Args:
        source: "published" or "fresh".
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
    summaries: dict[Experiment, Outline] = {
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


def with_inputs(found: Evidence) -> Evidence:
    """The finished runs with the inputs of their last rollouts, which published runs lack.

    They are solved for again, from the final theta. A run that was stopped left no policy.
    """
    finished = found.where(found.runs.stopped == Stopped.FINISHED)
    thetas = finished.runs[[*THETA]].to_numpy(float)
    made: dict[Experiment, Outline] = {}
    for (e, summary), theta in zip(finished.summaries.items(), thetas, strict=True):
        known = summary.actions is not None
        made[e] = summary if known else replace(summary, actions=_inputs(e, theta))
    return replace(finished, summaries=Runs(made))


def _inputs(experiment: Experiment, theta: Vector) -> Column:
    """Of a rollout without noise, shape (K + 1, m); nan after a failed solve."""
    actions = evaluate(controller_of(experiment), theta, experiment.steps).actions
    missing = ((0, experiment.steps - len(actions)), (0, 0))
    return np.pad(actions, missing, constant_values=np.nan)


def _named(column: pd.Series) -> str:
    return ", ".join(map(str, column.unique()))


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

"""The runs that a chapter rests on: published ones, or runs trained here.

The book shows the published study. A reader who asks for other runs gets those, and every figure
names the origin of its runs. `reproduce.agreement` compares runs made again with published ones.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.rows import THETA, cost_ratios, table
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.analysis.summary import Outline
from nmpcrl.claims.failure_modes import WELL, failure_modes
from nmpcrl.claims.published import load
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import design
from nmpcrl.study.experiment import Experiment, frozen_arm
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
        """The runs with a true value in `holds`."""
        chosen = list(holds)
        summaries = Runs(dict(compress(self.summaries.items(), chosen)))
        return Evidence(summaries, self.runs[chosen].reset_index(drop=True))

    @property
    def mark(self) -> str:
        """How many runs were trained here and how many are published, for a caption."""
        fresh = int((self.runs.source == "fresh").sum())
        counts = {"trained for this page": fresh, "published": len(self.runs) - fresh}
        parts = [f"{count} runs {where}" for where, count in counts.items() if count]
        return ", ".join(parts) or "no runs"

    @property
    def origin(self) -> str:
        """The origin, learners, layouts and readings of the runs, for numbers on pages."""
        if self.is_published:
            return "the published main table"
        names = {"layouts": "layout", "noise per": "decay"}
        parts = [f"{words} {_named(self.runs[column])}" for words, column in names.items()]
        return f"{self.mark}, of {_named(self.runs.learner)}; {'; '.join(parts)}"

    @property
    def is_published(self) -> bool:
        """Whether these runs are the complete published main table."""
        main = {e for e, part in load().variants.items() if part == design.MAIN_TABLE}
        return set(self.summaries) == main and set(self.runs.source) == {"published"}

    @property
    def wrong(self) -> pd.DataFrame:
        """The runs that went wrong; `run` is each one's experiment."""
        runs = self.runs.assign(run=list(self.summaries))
        return runs[~runs.mechanism.isin(("", WELL))]


def needed(source: str, **asked: Any) -> tuple[Experiment, ...]:
    """The runs of the main table to train here, with their frozen arms.

    Args:
        source: "fresh" for all runs, "published" for the runs that are not published.
        asked: learners, layouts, seeds and episodes, as `design.main_table` takes them.

    Raises:
        ParameterError: a value is not allowed.
    """
    one_of(SOURCES).check("study", source)
    runs, known = _asked(**asked), load().summaries
    return tuple(e for e in runs if source == "fresh" or e not in known)


def repeatable(repeat: bool, **asked: Any) -> tuple[Experiment, ...]:
    """The published runs of `design.fresh` for a build to train again, if `repeat` holds.

    Raises:
        ParameterError: a value is not allowed.
    """
    again = set(design.fresh()) if TRUTH.check("repeat", repeat) else set()
    known = load().summaries
    return tuple(e for e in _asked(**asked) if e in again and e in known)


def gather(source: str, *, variants: bool = False, **asked: Any) -> Evidence:
    """The runs of a chapter; runs of `needed` are trained if they are not stored.

    Args:
        source: "published" or "fresh".
        variants: whether to add the published controls and variants.
        asked: as for `needed`.

    Raises:
        ParameterError: a value is not allowed.
    """
    here, published = fetch_summaries(needed(source, **asked)), load()
    parts = {e: part for e, part in published.variants.items() if part != design.MAIN_TABLE}
    asked_for = dict.fromkeys(_asked(**asked), design.MAIN_TABLE)
    parts = parts | asked_for if variants else asked_for
    made = table(here).join(failure_modes(here)) if here else table(here)
    rows = {**published.rows, **dict(zip(here, made.to_dict("records"), strict=True))}
    ratios = cost_ratios(rows)
    runs = pd.DataFrame([rows[e] for e in parts]).assign(
        variant=list(parts.values()),
        source=["fresh" if e in here else "published" for e in parts],
        cost_ratio=[ratios[e] for e in parts],
    )
    known: dict[Experiment, Outline] = {**published.summaries, **here}
    return Evidence(Runs({e: known[e] for e in parts}), runs)


def with_inputs(found: Evidence) -> Evidence:
    """The finished runs with the inputs of their last rollouts, solved for from the final theta.

    Published runs lack inputs, and stopped runs have no final policy.
    """
    finished = found.where(found.runs.stopped == Stopped.FINISHED)
    thetas = finished.runs[[*THETA]].to_numpy(float)
    made: dict[Experiment, Outline] = {
        e: one if one.actions is not None else replace(one, actions=_inputs(e, theta))
        for (e, one), theta in zip(finished.summaries.items(), thetas, strict=True)
    }
    return replace(finished, summaries=Runs(made))


def _inputs(experiment: Experiment, theta: Vector) -> Column:
    """Inputs of a rollout without noise, shape (K + 1, m); nan after a failed solve."""
    actions = evaluate(controller_of(experiment), theta, experiment.steps).actions
    missing = ((0, experiment.steps - len(actions)), (0, 0))
    return np.pad(actions, missing, constant_values=np.nan)


def _named(column: pd.Series) -> str:
    return ", ".join(map(str, column.unique()))


def paths(evidence: Evidence) -> Mapping[Experiment, Column]:
    """States of each run's last rollout, as `rule.Observations` takes them."""
    return {experiment: summary.states for experiment, summary in evidence.summaries.items()}


def _asked(**asked: Any) -> tuple[Experiment, ...]:
    runs = design.main_table(**asked)
    return tuple(dict.fromkeys((*runs, *map(frozen_arm, runs))))

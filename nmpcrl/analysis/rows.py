"""Tables of runs: one row a run, with the columns of `FIELDS` and `OUTCOME`.

`runs.csv`, every verdict and every table of the book use these columns.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis import metrics
from nmpcrl.analysis.metrics import LATE
from nmpcrl.analysis.summary import SIZES, RunSummary
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment, frozen_arm
from nmpcrl.study.provenance import ORIGINAL

FIELDS = tuple(one.name for one in fields(Experiment))
VECTORS = ("theta", "start", "target")  # fields written as text
THETA = tuple(f"theta_{i}" for i in range(len(paper.THETA_INIT)))  # the final theta, by component
INSIDE = tuple(f"inside_{size}" for size in SIZES)  # states in an obstacle: in training,
EVAL_INSIDE = tuple(f"eval_{name}" for name in INSIDE)  # and without noise


def _total(name: str, one: RunSummary) -> int:
    return int(one.episodes[name].sum())


def _late(name: str, one: RunSummary) -> float:
    """The median over the last episodes, as many as of `metrics.late_training_cost`."""
    values = one.episodes[name][-min(LATE, max(1, one.experiment["episodes"] // 2)) :]
    return float(np.nanmedian(values)) if np.isfinite(values).any() else np.nan


def _inside(table: str, i: int, one: RunSummary) -> int:
    return int(getattr(one, table)["inside"][:, i].sum())


def _last_theta(i: int, one: RunSummary) -> float:
    """A component of theta after the last episode that the run reached."""
    theta = one.episodes["theta"]
    reached = theta[np.isfinite(theta).all(axis=1)]
    return float(reached[-1, i] if len(reached) else one.experiment["theta"][i])


def _imitation(which: str, one: RunSummary) -> float:
    return float(one.facts.get("imitation", {}).get(which, np.nan))


OUTCOME: Mapping[str, Callable[[RunSummary], Any]] = {
    "stopped": lambda one: one.facts["stopped"],
    "initial_cost": metrics.initial_cost,
    "final_cost": metrics.final_cost,
    "best_cost": lambda one: float(one.evaluations["cost"].min()),
    "late_cost_range": metrics.late_cost_range,
    "training_cost": lambda one: metrics.late_training_cost(one.episodes["cost"]),
    "cut_short": lambda one: int(np.isnan(one.episodes["cost"]).sum()),
    **{name: partial(_total, name) for name in ("failed", "restarts", "outside", "inputs")},
    "steps_done": partial(_total, "steps"),
    "over": lambda one: _total("over", one) / max(1, _total("steps", one)),
    "bias": partial(_late, "bias"),
    "error": partial(_late, "error"),
    "distance": lambda one: float(one.evaluations["distance"][-1]),
    "iterations": lambda one: float(np.nanmean(one.episodes["iterations"])),
    "seconds": lambda one: float(one.facts["seconds"]),
    **{name: partial(_inside, "episodes", i) for i, name in enumerate(INSIDE)},
    **{name: partial(_inside, "evaluations", i) for i, name in enumerate(EVAL_INSIDE)},
    "worst_overlap": lambda one: float(np.nanmax(one.episodes["overlap"])),
    "eval_worst_overlap": lambda one: float(np.nanmax(one.evaluations["overlap"])),
    **{name: partial(_last_theta, i) for i, name in enumerate(THETA)},
    "imitation_with": partial(_imitation, "with_theta"),
    "imitation_without": partial(_imitation, "without_theta"),
}


def as_text(value: Any) -> Any:
    """A field in a table: a vector is written as its numbers between blanks."""
    return " ".join(map(repr, value)) if isinstance(value, tuple | list) else value


OLDER = {name: as_text(value) for name, value in ORIGINAL.items()}  # fields that came later


def row(summary: RunSummary) -> dict[str, Any]:
    """One flat row: the fields of the experiment, then the outcome."""
    experiment = summary.experiment
    named = {name: as_text(experiment.get(name, OLDER.get(name))) for name in FIELDS}
    return named | {name: measure(summary) for name, measure in OUTCOME.items()}


def experiment_of(row: Mapping[str, Any]) -> Experiment:
    """The experiment of a `row`; a field without a column has its value in all older runs."""
    named = {name: row[name] if name in row else OLDER[name] for name in FIELDS}
    vectors = {name: tuple(map(float, named[name].split())) for name in VECTORS}
    return Experiment(**named | vectors)


def table(summaries: Mapping[Experiment, RunSummary]) -> pd.DataFrame:
    """One `row` a run, with the column `cost_ratio` of `cost_ratios`."""
    rows = {e: row(one) for e, one in summaries.items()}
    return pd.DataFrame([*rows.values()]).assign(cost_ratio=[*cost_ratios(rows).values()])


def cost_ratios(rows: Mapping[Experiment, Mapping[str, Any]]) -> dict[Experiment, float]:
    """`metrics.cost_ratio` of each `row`; nan without the row of the frozen learner."""
    unknown = {"training_cost": np.nan}
    arms = {e: rows.get(frozen_arm(e), unknown) for e in rows}
    return {e: one["training_cost"] / arms[e]["training_cost"] for e, one in rows.items()}

"""Tables of runs: one row a run, with the columns of `FIELDS` and `OUTCOME`.

`runs.csv`, every verdict and every table of the book use these columns.
"""

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis import metrics
from nmpcrl.analysis.metrics import LATE
from nmpcrl.analysis.summary import SIZES, RunSummary
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment, frozen_arm
from nmpcrl.study.files import Column
from nmpcrl.study.provenance import before
from nmpcrl.study.records import final_cost

if TYPE_CHECKING:
    import pandas as pd

FIELDS = tuple(one.name for one in fields(Experiment))
NAMES = ("learner", "layout", "decay", "seed", "episodes")  # required to name a run
VECTORS = ("theta", "start", "target")  # fields written as text
THETA = tuple(f"theta_{i}" for i in range(len(paper.THETA_INIT)))  # the final theta, by component
INSIDE = tuple(f"inside_{size}" for size in SIZES)  # states in an obstacle: in training,
EVAL_INSIDE = tuple(f"eval_{name}" for name in INSIDE)  # and without noise
COUNTED = ("failed", "restarts", "outside", "inputs")  # summed over the episodes
OUTCOME = (
    *("stopped", "initial_cost", "final_cost", "best_cost", "late_cost_range", "training_cost"),
    *("cut_short", *COUNTED, "steps_done", "over"),
    *("bias", "error", "distance", "iterations", "seconds"),
    *INSIDE,
    *EVAL_INSIDE,
    *("worst_overlap", "eval_worst_overlap"),
    *THETA,
    *("imitation_with", "imitation_without"),
)


def as_text(value: Any) -> Any:
    """A field in a table: a vector is written as its numbers between blanks."""
    return " ".join(map(repr, value)) if isinstance(value, tuple | list) else value


OLDER = {name: as_text(value) for name, value in before().items()}  # fields that came later


def row(summary: RunSummary) -> dict[str, Any]:
    """One flat row: the fields of the experiment, then the outcome."""
    experiment, episodes, evaluations = summary.experiment, summary.episodes, summary.evaluations
    named = {name: as_text(experiment.get(name, OLDER.get(name))) for name in FIELDS}
    late = slice(-min(LATE, max(1, experiment["episodes"] // 2)), None)
    cost, steps = evaluations["cost"], episodes["steps"].sum()
    imitation = summary.facts.get("imitation", {})
    outcome = {
        "stopped": summary.facts["stopped"],
        "initial_cost": float(cost[0]),
        "final_cost": final_cost(cost),
        "best_cost": float(cost.min()),
        "late_cost_range": metrics.late_cost_range_of(
            evaluations["episode"], cost, experiment["episodes"]
        ),
        "training_cost": metrics.late_training_cost(episodes["cost"]),
        "cut_short": int(np.isnan(episodes["cost"]).sum()),
        **{name: int(episodes[name].sum()) for name in COUNTED},
        "steps_done": int(steps),
        "over": float(episodes["over"].sum() / max(1, steps)),
        "bias": _median(episodes["bias"][late]),
        "error": _median(episodes["error"][late]),
        "distance": float(evaluations["distance"][-1]),
        "iterations": float(np.nanmean(episodes["iterations"])),
        "seconds": float(summary.facts["seconds"]),
        **_totals(INSIDE, episodes),
        **_totals(EVAL_INSIDE, evaluations),
        "worst_overlap": float(np.nanmax(episodes["overlap"])),
        "eval_worst_overlap": float(np.nanmax(evaluations["overlap"])),
        **dict(zip(THETA, _last_known(episodes["theta"], experiment["theta"]), strict=True)),
        "imitation_with": imitation.get("with_theta", np.nan),
        "imitation_without": imitation.get("without_theta", np.nan),
    }
    return named | outcome


def experiment_of(row: Mapping[str, Any]) -> Experiment:
    """The experiment of a `row`; a field without a column has its value in all older runs.

    Raises:
        LookupError: one of `NAMES` is missing.
    """
    if nameless := set(NAMES) - row.keys():
        raise LookupError(f"there is no column {min(nameless)}")
    named = {name: row[name] if name in row else OLDER[name] for name in FIELDS}
    for name in VECTORS:
        named[name] = tuple(float(value) for value in named[name].split())
    return Experiment(**named)


def table(summaries: Mapping[Experiment, RunSummary] | Iterable[RunSummary]) -> "pd.DataFrame":
    """One `row` a run, with the column `cost_ratio` of `cost_ratios`."""
    import pandas as pd

    listed = list(summaries.values() if isinstance(summaries, Mapping) else summaries)
    rows = {one.name: row(one) for one in listed}
    ratios = cost_ratios(rows)
    return pd.DataFrame([values | {"cost_ratio": ratios[e]} for e, values in rows.items()])


def cost_ratios(rows: Mapping[Experiment, Mapping[str, Any]]) -> dict[Experiment, float]:
    """`metrics.cost_ratio` of each `row`; nan without the row of the frozen learner."""
    arms = {e: rows.get(frozen_arm(e)) for e in rows}
    return {
        e: one["training_cost"] / arm["training_cost"] if (arm := arms[e]) else np.nan
        for e, one in rows.items()
    }


def tidy(summaries: Iterable[RunSummary]) -> "pd.DataFrame":
    """One row an episode of each run: learner, layout, decay, seed and the columns of numbers."""
    import pandas as pd

    named = ("learner", "layout", "decay", "seed")
    frames = []
    for one in summaries:
        columns = {name: one.experiment[name] for name in named}
        columns |= {"episode": np.arange(one.experiment["episodes"])}
        columns |= {name: c for name, c in one.episodes.items() if c.ndim == 1}
        columns |= {
            f"theta_{name}": one.episodes["theta"][:, i] for i, name in enumerate(paper.THETA_NAMES)
        }
        frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame()


def _median(values: Vector) -> float:
    return float(np.nanmedian(values)) if np.isfinite(values).any() else np.nan


def _totals(names: Iterable[str], table: Mapping[str, Column]) -> dict[str, int]:
    """Number of states in an obstacle, by `SIZES`."""
    return dict(zip(names, map(int, table["inside"].sum(axis=0)), strict=True))


def _last_known(theta: Column, first: Iterable[float]) -> list[float]:
    """theta after the last episode that the run reached."""
    reached = np.flatnonzero(np.isfinite(theta).all(axis=1))
    return [*map(float, theta[reached[-1]] if reached.size else first)]

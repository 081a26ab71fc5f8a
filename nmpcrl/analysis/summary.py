"""What a study keeps of a run: tables by episode and by rollout instead of by step.

A run's records take megabytes, most of them noise, and are trained again in seconds; a summary
takes a hundredth of that and is enough for every figure, verdict and mechanism of the study.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis import metrics
from nmpcrl.analysis.imitation import imitate
from nmpcrl.analysis.metrics import LATE, TOUCH
from nmpcrl.control import Task
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import paper
from nmpcrl.study.archive import Column, Field, Form, Forms, load_about, load_arrays, save_arrays
from nmpcrl.study.experiment import Experiment, frozen_arm
from nmpcrl.study.records import (
    INPUTS,
    STATES,
    Records,
    StepStatus,
    final_cost,
    most_evaluations,
    named_in,
)
from nmpcrl.study.setup import controller_of

if TYPE_CHECKING:
    import pandas as pd

SIZES = {"small": (TOUCH, 0.01), "medium": (0.01, 0.1), "large": (0.1, np.inf)}  # of Xi
NAMES = ("learner", "layout", "decay", "seed", "episodes")  # of a row: without them it names no run
VECTORS = {"theta", "start", "target"}  # fields that a row holds as text
IMITATED = "RDES"  # whose runs a network with theta and one without are fitted to: claim C6


def as_text(value: Any) -> Any:
    """A field as a table holds it: a vector's numbers between blanks."""
    return " ".join(map(repr, value)) if isinstance(value, tuple | list) else value


DEFAULTS = {one.name: as_text(one.default) for one in fields(Experiment)}  # if a run is older


@dataclass(frozen=True, eq=False)
class RunSummary:
    """One run, in short.

    Columns of `episodes`, each of shape (episodes,) unless said: cost (summed RL cost; nan where
    the episode was cut short or never reached), steps, failed (0 or 1), restarts, inside (states
    in an obstacle, by `SIZES`, shape (episodes, 3)), overlap (largest Xi), outside (states out of
    the box), inputs (actions out of bounds), alpha_phi2 (largest alpha ||phi||^2), over (steps with
    that above `OVERSHOOT`), delta (root mean square), loss (mean), bias and error (mean and root
    mean square of the predicted minus the true next value), theta and w (at the end, shape
    (episodes, d)), iterations (mean), seconds.

    Columns of `evaluations`, one row per rollout without noise: episode (so many were trained),
    theta (d,), cost (infinite where a solve failed), inside (3 counts), overlap (largest Xi),
    distance (to the target at the end).
    """

    experiment: dict[str, Any]  # the fields of the Experiment
    episodes: dict[str, Column]
    evaluations: dict[str, Column]
    states: Column  # of the last rollout without noise, shape (K + 1, n); nan after a failed solve
    actions: Column  # shape (K + 1, m)
    facts: dict[str, Any]  # those of the records, and `imitation` where C6 asks for it

    def save(self, path: Path) -> None:
        """Write the whole file beside `path`, then rename it into place.

        Raises:
            OSError: it cannot be written; what was there stays.
        """
        rollout = {"states": self.states, "actions": self.actions}
        tables = {"episodes": self.episodes, "evaluations": self.evaluations, "rollout": rollout}
        save_arrays(path, {"experiment": self.experiment, "facts": self.facts}, tables)

    @classmethod
    def load(cls, path: Path) -> "RunSummary":
        """Read a file that `save` wrote.

        Raises:
            FileNotFoundError: there is none.
            DamagedRecords: it cannot be read whole, or is not a summary.
        """
        about, tables = load_arrays(path, _forms)
        return cls(
            about["experiment"],
            tables["episodes"],
            tables["evaluations"],
            tables["rollout"]["states"],
            tables["rollout"]["actions"],
            about["facts"],
        )

    @staticmethod
    def about(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
        """The experiment's fields and the facts, as `Records.about`."""
        about = load_about(path, _forms)
        return about["experiment"], about["facts"]

    @property
    def name(self) -> Experiment:
        """The experiment as the value that names the run."""
        return Experiment(**self.experiment)


def _forms(about: dict[str, Any]) -> Forms:
    """Of the tables of a summary."""
    experiment = named_in(about)
    d, sizes = len(experiment.theta), len(SIZES)
    counts = ("steps", "failed", "restarts", "outside", "inputs", "over")
    numbers = ("cost", "overlap", "alpha_phi2", "delta", "loss", "bias", "error", "iterations")
    episodes: list[Field] = [(name, int) for name in counts]
    episodes += [(name, float) for name in (*numbers, "seconds")]
    episodes += [("inside", int, sizes), ("theta", float, d), ("w", float, d)]
    evaluations: list[Field] = [("episode", int), ("theta", float, d), ("cost", float)]
    evaluations += [("inside", int, sizes), ("overlap", float), ("distance", float)]
    rollout: list[Field] = [("states", float, STATES), ("actions", float, INPUTS)]
    return {
        "episodes": Form(episodes, [experiment.episodes]),
        "evaluations": Form(evaluations, range(1, most_evaluations(experiment) + 1)),
        "rollout": Form(rollout, [experiment.steps]),
    }


def summarise(records: Records) -> RunSummary:
    """The summary of a run; for a whole run of RDES also how well networks imitate it."""
    experiment = Experiment(**records.experiment)
    nmpc = controller_of(experiment).nmpc
    facts = dict(records.facts)
    if experiment.learner == IMITATED and experiment.episodes >= paper.EPISODES:
        imitation = imitate(records)
        facts["imitation"] = {
            which: imitation.error(which) for which in ("with_theta", "without_theta")
        }
    evaluated = records.evaluations
    states, actions = metrics.final_rollout(records)
    evaluations = {name: evaluated[name] for name in ("episode", "theta", "cost")}
    overlap = nmpc.task.overlap(evaluated["states"]).max(axis=-1)
    evaluations["inside"] = _sizes(overlap).sum(axis=1)
    evaluations["overlap"] = np.fmax.reduce(overlap, axis=1)
    evaluations["distance"] = _distance(evaluated["states"], nmpc.task)
    episodes = _episodes(records, nmpc.task, nmpc.plant.lower, nmpc.plant.upper)
    return RunSummary(records.experiment, episodes, evaluations, states, actions, facts)


def row(summary: RunSummary) -> dict[str, Any]:
    """One flat row: the experiment's fields, then what became of it."""
    experiment, episodes, evaluations = summary.experiment, summary.episodes, summary.evaluations
    named = DEFAULTS | {name: as_text(value) for name, value in experiment.items()}
    late = slice(-min(LATE, max(1, experiment["episodes"] // 2)), None)
    cost = evaluations["cost"]
    columns = {
        "stopped": summary.facts["stopped"],
        "initial_cost": float(cost[0]),
        "final_cost": final_cost(cost),
        "best_cost": float(cost.min()),
        "late_cost_range": metrics.late_cost_range_of(
            evaluations["episode"], cost, experiment["episodes"]
        ),
        "training_cost": metrics.late_training_cost(episodes["cost"]),
        "cut_short": int(np.isnan(episodes["cost"]).sum()),
        "failed": int(episodes["failed"].sum()),
        "restarts": int(episodes["restarts"].sum()),
        "outside": int(episodes["outside"].sum()),
        "inputs": int(episodes["inputs"].sum()),
        "steps_done": int(episodes["steps"].sum()),
        "over": float(episodes["over"].sum() / max(1, episodes["steps"].sum())),
        "bias": _median(episodes["bias"][late]),
        "error": _median(episodes["error"][late]),
        "distance": float(evaluations["distance"][-1]),
        "iterations": float(np.nanmean(episodes["iterations"])),
        "seconds": float(summary.facts["seconds"]),
    }
    for name, table in (("inside", episodes), ("eval_inside", evaluations)):
        counts = table["inside"].sum(axis=0)
        columns |= {f"{name}_{size}": int(count) for size, count in zip(SIZES, counts, strict=True)}
    columns |= {
        "worst_overlap": float(np.nanmax(episodes["overlap"])),
        "eval_worst_overlap": float(np.nanmax(evaluations["overlap"])),
    }
    theta = _last_known(episodes["theta"], experiment["theta"])
    columns |= {f"theta_{i}": float(value) for i, value in enumerate(theta)}
    imitation = summary.facts.get("imitation", {})
    columns |= {
        "imitation_with": imitation.get("with_theta", np.nan),
        "imitation_without": imitation.get("without_theta", np.nan),
    }
    return named | columns


def experiment_of(row: Mapping[str, Any]) -> Experiment:
    """The experiment that a `row` summarises.

    A field for which an older table has no column takes its default.

    Raises:
        LookupError: one of `NAMES` is missing.
    """
    missing = {one.name for one in fields(Experiment)} - row.keys()
    if nameless := missing & set(NAMES):
        raise LookupError(f"there is no column {min(nameless)}")
    named = {one.name: row[one.name] for one in fields(Experiment) if one.name not in missing}
    for name in VECTORS & named.keys():
        named[name] = tuple(float(value) for value in named[name].split())
    return Experiment(**named)


def table(summaries: Mapping[Experiment, RunSummary] | Iterable[RunSummary]) -> "pd.DataFrame":
    """One `row` a run, with `cost_ratio` as `cost_ratios` gives it."""
    import pandas as pd  # not for those who only make summaries

    listed = list(summaries.values() if isinstance(summaries, Mapping) else summaries)
    rows = {one.name: row(one) for one in listed}
    ratios = cost_ratios(rows)
    return pd.DataFrame([values | {"cost_ratio": ratios[e]} for e, values in rows.items()])


def cost_ratios(rows: Mapping[Experiment, Mapping[str, Any]]) -> dict[Experiment, float]:
    """`metrics.cost_ratio` of each `row`; nan where its frozen arm is not among them."""
    arms = {e: rows.get(frozen_arm(e)) for e in rows}
    return {
        e: one["training_cost"] / arm["training_cost"] if (arm := arms[e]) else np.nan
        for e, one in rows.items()
    }


def tidy(summaries: Iterable[RunSummary]) -> "pd.DataFrame":
    """One row an episode of each run: what names the run, and the columns that are numbers."""
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


def separation(one: RunSummary, other: RunSummary) -> Vector:
    """The largest difference of any component of theta, after each episode that both reached."""
    apart = np.abs(one.episodes["theta"] - other.episodes["theta"]).max(axis=1)
    result: Vector = apart[np.isfinite(apart)]
    return result


def _episodes(records: Records, task: Task, lower: Vector, upper: Vector) -> dict[str, Column]:
    """The columns of `RunSummary.episodes`."""
    steps = records.steps
    by = _ByEpisode(steps["episode"], records.experiment["episodes"])
    overlap = task.overlap(steps["state"]).max(axis=-1)
    out = np.any((steps["state"] < task.lower) | (steps["state"] > task.upper), axis=1)
    beyond = np.any((steps["action"] < lower - TOUCH) | (steps["action"] > upper + TOUCH), axis=1)
    wrong = metrics.online_error(records)
    return {
        "cost": metrics.training_cost(records),
        "steps": by.sum(np.ones(len(overlap))).astype(int),
        "failed": by.sum(steps["status"] == StepStatus.FAILED).astype(int),
        "restarts": by.sum(steps["restarts"]).astype(int),
        "inside": np.stack([by.sum(size) for size in _sizes(overlap).T], axis=1).astype(int),
        "overlap": by.reduce(np.fmax, overlap),
        "outside": by.sum(out).astype(int),
        "inputs": by.sum(beyond).astype(int),
        "alpha_phi2": by.reduce(np.fmax, steps["alpha_phi2"]),
        "over": by.sum(steps["alpha_phi2"] > OVERSHOOT).astype(int),
        "delta": np.sqrt(by.mean(steps["delta"] ** 2)),
        "loss": by.mean(steps["loss"]),
        "bias": by.mean(wrong),
        "error": np.sqrt(by.mean(wrong**2)),
        "theta": by.last(steps["theta"]),
        "w": by.last(steps["w"]),
        "iterations": by.mean(steps["iterations"].astype(float)),
        "seconds": by.sum(steps["seconds"]),
    }


class _ByEpisode:
    """Summaries of a column in each episode; what has no step, or no known value, is nan."""

    def __init__(self, episode: Column, episodes: int) -> None:
        self._episode, self._episodes = episode, episodes
        self._reached, self._first = np.unique(episode, return_index=True)

    def sum(self, column: Column) -> Vector:
        return np.bincount(self._episode, column, minlength=self._episodes).astype(float)

    def mean(self, column: Column) -> Vector:
        known = np.isfinite(column)
        count = self.sum(known)
        result: Vector = np.divide(
            self.sum(np.where(known, column, 0.0)),
            count,
            np.full(count.shape, np.nan),
            where=count > 0,
        )
        return result

    def reduce(self, function: np.ufunc, column: Column) -> Vector:
        return self._spread(function.reduceat(column, self._first))

    def last(self, column: Column) -> Column:
        return self._spread(column[np.append(self._first[1:], len(column)) - 1])

    def _spread(self, reached: Column) -> Column:
        result = np.full((self._episodes, *reached.shape[1:]), np.nan)
        result[self._reached] = reached
        return result


def _sizes(overlap: Column) -> Column:
    """Whether overlaps are of each of `SIZES`, along a new last axis of length 3."""
    ranges = SIZES.values()
    return np.stack([(overlap > low) & (overlap <= high) for low, high in ranges], axis=-1)


def _distance(states: Column, task: Task) -> Vector:
    """Distance to the target at the end of each rollout, shape (rollouts,)."""
    result: Vector = np.linalg.norm(states[:, -1] - task.target, axis=-1)
    return result


def _median(values: Vector) -> float:
    return float(np.nanmedian(values)) if np.isfinite(values).any() else np.nan


def _last_known(theta: Column, first: Iterable[float]) -> Vector:
    """theta after the last episode that was reached."""
    reached = np.flatnonzero(np.isfinite(theta).all(axis=1))
    return theta[reached[-1]] if reached.size else np.array(list(first))

"""Summaries of runs: tables by episode and by rollout instead of by step.

The records of a run take megabytes, and the run is trained again in seconds; a summary takes a
hundredth of that and is enough for every figure and verdict of the study.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NotRequired, cast

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis import metrics
from nmpcrl.analysis.imitation import imitate
from nmpcrl.analysis.metrics import TOUCH
from nmpcrl.control import Task
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.files import Column, load_about, load_tables, save_tables
from nmpcrl.study.records import About, Facts, Records, StepStatus, stated_in
from nmpcrl.study.setup import controller_of

SIZES = {"small": (TOUCH, 0.01), "medium": (0.01, 0.1), "large": (0.1, np.inf)}  # of Xi
COLUMNS = {
    "episodes": (
        *("steps", "failed", "restarts", "outside", "inputs", "over", "cost", "overlap"),
        *("alpha_phi2", "delta", "loss", "bias", "error", "iterations", "seconds"),
        *("inside", "theta", "w"),
    ),
    "evaluations": ("episode", "theta", "cost", "inside", "overlap", "distance"),
    "rollout": ("states", "actions"),
}
IMITATED = "RDES"  # whose runs a network with theta and one without are fitted to: claim C6


@dataclass(frozen=True, eq=False)
class Outline:
    """What is known of every run, trained here or published: what pages draw.

    `episodes` has the column cost, and of some runs theta; `evaluations` has episode, theta and
    cost; `facts` has stopped and seconds. `RunSummary` says what these are.
    """

    experiment: dict[str, Any]  # the fields of the Experiment
    episodes: dict[str, Column]
    evaluations: dict[str, Column]
    states: Column  # of the last rollout without noise, shape (K + 1, n); nan after a failed solve
    actions: Column | None  # shape (K + 1, m); None where they are not known
    facts: Mapping[str, Any]

    @property
    def name(self) -> Experiment:
        """The experiment as the value that names the run."""
        return Experiment(**self.experiment)


class SummaryFacts(Facts):
    """Those of the records, and what C6 asks for."""

    imitation: NotRequired[dict[str, float]]  # the error of a network, with theta and without


@dataclass(frozen=True, eq=False)
class RunSummary(Outline):
    """One run that was trained here, in short.

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

    actions: Column
    facts: SummaryFacts

    def save(self, path: Path) -> None:
        """Write a temporary file, then rename it to `path`.

        Raises:
            OSError: the file cannot be written; an earlier one stays.
        """
        rollout = {"states": self.states, "actions": self.actions}
        tables = {"episodes": self.episodes, "evaluations": self.evaluations, "rollout": rollout}
        save_tables(path, {"experiment": self.experiment, "facts": self.facts}, tables)

    @classmethod
    def load(cls, path: Path) -> "RunSummary":
        """Read a file that `save` wrote.

        Raises:
            FileNotFoundError: there is none.
            DamagedRecords: the file is damaged, or no summary.
        """
        about, tables = load_tables(path, COLUMNS)
        experiment, facts = stated_in(about, path)
        return cls(
            experiment,
            tables["episodes"],
            tables["evaluations"],
            tables["rollout"]["states"],
            tables["rollout"]["actions"],
            cast(SummaryFacts, facts),
        )

    @staticmethod
    def about(path: Path) -> About:
        """The experiment's fields and the facts, as `Records.about`."""
        return stated_in(load_about(path), path)


def summarise(records: Records) -> RunSummary:
    """The summary of a run; for a whole run of RDES also how well networks imitate it."""
    experiment = Experiment(**records.experiment)
    nmpc = controller_of(experiment).nmpc
    facts = cast(SummaryFacts, dict(records.facts))
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


def separation(one: Outline, other: Outline) -> Vector:
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

"""Summaries of runs: tables by episode and by rollout instead of by step.

A summary takes a hundredth of the records, and is enough for every verdict of the study.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis import metrics
from nmpcrl.analysis.imitation import imitate
from nmpcrl.analysis.metrics import TOUCH
from nmpcrl.control import Nmpc
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Column, Records, StepStatus, load_run, save_run
from nmpcrl.study.setup import controller_of

SIZES = {"small": (TOUCH, 0.01), "medium": (0.01, 0.1), "large": (0.1, np.inf)}  # of Xi
IMITATED = "RDES"  # whose runs a network with theta and one without are fitted to: claim C6


class _Steps:
    """The steps of a run, and reductions of a column to one number for each episode.

    The number is nan in an episode without a step, or without a known value.
    """

    def __init__(self, records: Records, nmpc: Nmpc) -> None:
        self.records, self.columns, self.nmpc = records, records.steps, nmpc
        state, task = self["state"], nmpc.task
        self.overlap = task.overlap(state).max(axis=-1)
        self.outside: Column = np.any((state < task.lower) | (state > task.upper), axis=1)
        self.wrong = metrics.online_error(records)
        self._episodes = records.experiment["episodes"]
        self._reached, self._first = np.unique(self["episode"], return_index=True)

    def __getitem__(self, name: str) -> Column:
        return self.columns[name]

    def sum(self, column: Column) -> Vector:
        return np.bincount(self["episode"], column, minlength=self._episodes).astype(float)

    def count(self, column: Column) -> Column:
        return self.sum(column).astype(int)

    def mean(self, column: Column) -> Vector:
        known = np.isfinite(column)
        with np.errstate(invalid="ignore"):  # 0 / 0
            return self.sum(np.where(known, column, 0.0)) / self.sum(known)

    def largest(self, column: Column) -> Column:
        return self._spread(np.fmax.reduceat(column, self._first))

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


# columns of `RunSummary.episodes`, each of shape (episodes,) unless said
EPISODES: Mapping[str, Callable[[_Steps], Column]] = {
    "cost": lambda run: metrics.training_cost(run.records),  # nan: cut short, or not reached
    "steps": lambda run: run.count(np.ones(len(run.overlap))),
    "failed": lambda run: run.count(run["status"] == StepStatus.FAILED),  # 0 or 1
    "restarts": lambda run: run.count(run["restarts"]),
    "inside": lambda run: np.stack(  # states in an obstacle, by `SIZES`, shape (episodes, 3)
        [run.count(size) for size in _sizes(run.overlap).T], axis=1
    ),
    "overlap": lambda run: run.largest(run.overlap),  # Xi
    "outside": lambda run: run.count(run.outside),  # states out of the box
    "inputs": lambda run: run.count(  # actions out of bounds
        metrics.out_of_bounds(run["action"], run.nmpc.plant.lower, run.nmpc.plant.upper)
    ),
    "alpha_phi2": lambda run: run.largest(run["alpha_phi2"]),  # alpha ||phi||^2
    "over": lambda run: run.count(run["alpha_phi2"] > OVERSHOOT),
    "delta": lambda run: np.sqrt(run.mean(run["delta"] ** 2)),  # root mean square
    "loss": lambda run: run.mean(run["loss"]),
    "bias": lambda run: run.mean(run.wrong),  # mean of the predicted minus the true next value
    "error": lambda run: np.sqrt(run.mean(run.wrong**2)),  # its root mean square
    "theta": lambda run: run.last(run["theta"]),  # at the end, shape (episodes, d)
    "w": lambda run: run.last(run["w"]),
    "iterations": lambda run: run.mean(run["iterations"].astype(float)),
    "seconds": lambda run: run.sum(run["seconds"]),
}
COLUMNS = {
    "episodes": tuple(EPISODES),
    "evaluations": ("episode", "theta", "cost", "inside", "overlap", "distance"),
    "rollout": ("states", "actions"),
}


@dataclass(frozen=True, eq=False)
class RunSummary:
    """One run in short.

    `EPISODES` lists the columns of `episodes`. Columns of `evaluations`, one row per rollout
    without noise: episode (so many were trained), theta (d,), cost (infinite where a solve failed),
    inside (states in an obstacle, by `SIZES`), overlap (largest Xi), distance (to the target at the
    end). Of a published run are known the cost of episodes and, of some runs, theta; the first
    three columns of `evaluations`; the facts stopped and seconds; and no actions.
    """

    experiment: dict[str, Any]  # the fields of the Experiment
    episodes: dict[str, Column]
    evaluations: dict[str, Column]
    states: Column  # of the last rollout without noise, shape (K + 1, n); nan after a failed solve
    actions: Column  # shape (K + 1, m); (0, m) where they are not known
    facts: Mapping[str, Any]  # of the records; and imitation, the errors of two networks, for C6

    @property
    def name(self) -> Experiment:
        """The experiment as the value that names the run."""
        return Experiment(**self.experiment)

    def save(self, path: Path) -> None:
        """Write a file as a whole; errors as in `save_run`."""
        rollout = {"states": self.states, "actions": self.actions}
        tables = {"episodes": self.episodes, "evaluations": self.evaluations, "rollout": rollout}
        save_run(path, self.experiment, self.facts, tables)

    @classmethod
    def load(cls, path: Path) -> "RunSummary":
        """Read a file that `save` wrote; errors as in `load_run`."""
        (experiment, facts), tables = load_run(path, COLUMNS)
        episodes, evaluations, rollout = (tables[name] for name in COLUMNS)
        return cls(experiment, episodes, evaluations, **rollout, facts=facts)


def summarise(records: Records) -> RunSummary:
    """The summary of a run; of RDES trained to the end also how well networks imitate it."""
    experiment, evaluated = Experiment(**records.experiment), records.evaluations
    nmpc = controller_of(experiment)
    facts = dict(records.facts)
    if experiment.learner == IMITATED and experiment.episodes >= paper.EPISODES:
        imitation = imitate(records)
        facts["imitation"] = {
            which: imitation.error(which) for which in ("with_theta", "without_theta")
        }
    overlap = nmpc.task.overlap(evaluated["states"]).max(axis=-1)
    away = evaluated["states"][:, -1] - nmpc.task.target
    evaluations = {
        **{name: evaluated[name] for name in ("episode", "theta", "cost")},
        "inside": _sizes(overlap).sum(axis=1),
        "overlap": np.fmax.reduce(overlap, axis=1),
        "distance": np.linalg.norm(away, axis=-1),
    }
    run = _Steps(records, nmpc)
    episodes = {name: column(run) for name, column in EPISODES.items()}
    states, actions = (evaluated[name][-1] for name in ("states", "actions"))
    return RunSummary(records.experiment, episodes, evaluations, states, actions, facts)

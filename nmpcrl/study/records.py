"""The records of a run: two tables of equal-length columns, and facts, in one .npz file."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from pathlib import Path
from typing import Any, NamedTuple, NotRequired, TypedDict

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.files import Column as Column
from nmpcrl.study.files import DamagedRecords as DamagedRecords
from nmpcrl.study.files import load_about, load_tables, save_tables
from nmpcrl.study.machine import Fingerprint

LAST = 3  # rollouts that the final cost averages
STATES = len(paper.START)  # n of the robot
INPUTS = len(paper.THETA_INIT) - 2 * STATES - 1  # m of the robot
REMOVED = {"plant": "model"}  # former fields of experiments, with the one value that is read

Field = tuple[str, type] | tuple[str, type, int | tuple[int, ...]]  # name, type[, shape]


class Stopped(StrEnum):
    """The end of training: the first word of the fact `stopped`, before ": " and the reason."""

    FINISHED = "finished"
    DIVERGED = "diverged"


class Facts(TypedDict):
    """Facts about a run; a stored run has the last four."""

    stopped: str  # the end of training, as `Stopped` says
    solver: str  # that found the plans
    seconds: float
    final_cost: float
    versions: NotRequired[dict[str, str]]
    machine: NotRequired[Fingerprint]
    key: NotRequired[str]
    sources: NotRequired[str]


class About(NamedTuple):
    """The experiment and the facts of a file."""

    experiment: dict[str, Any]  # the fields when the file was written
    facts: Facts


class StepStatus(IntEnum):
    """The worst result of a step's solves: the column `status`."""

    SOLVED = 0
    RESTARTED = 1
    FAILED = 2

    @classmethod
    def of(cls, *, failed: bool, restarts: int) -> "StepStatus":
        """The status of a step."""
        return cls.FAILED if failed else cls.RESTARTED if restarts else cls.SOLVED


def final_cost(cost: Vector) -> float:
    """Mean cost of the last rollouts without noise, `LAST` or fewer, without the first rollout.

    It is infinite where a rollout failed, and where there is only the rollout of theta_init.
    """
    learned = cost[1:][-LAST:]
    return float(learned.mean()) if learned.size else np.inf


class StepRow(NamedTuple):
    """A row of `Records.steps`, without alpha_phi2, which is computed at the end of a run."""

    episode: int
    time: int
    state: Vector
    action: Vector
    cost: float
    value: float
    next_value: float
    delta: float
    features: Vector
    theta: Vector
    w: Vector
    loss: float
    status: int
    restarts: int
    violation: float
    iterations: int
    solves: int
    solve_seconds: float
    fit_seconds: float
    seconds: float


class EvaluationRow(NamedTuple):
    """A row of `Records.evaluations`."""

    episode: int
    theta: Vector
    cost: float
    states: Matrix
    actions: Matrix


def step_fields(n: int, m: int, d: int) -> list[Field]:
    """The columns of `StepRow` for so many states, inputs and parameters."""
    return _fields(
        StepRow, {"state": n, "action": m} | dict.fromkeys(("features", "theta", "w"), d)
    )


def evaluation_fields(n: int, m: int, d: int, steps: int) -> list[Field]:
    """The columns of `EvaluationRow` for rollouts of so many steps."""
    return _fields(EvaluationRow, {"theta": d, "states": (steps, n), "actions": (steps, m)})


def _fields(row: type[NamedTuple], shapes: Mapping[str, Any]) -> list[Field]:
    """A column for each field of a row; arrays have a shape."""
    kinds = row.__annotations__
    return [
        (name, float, shapes[name]) if name in shapes else (name, kinds[name]) for name in kinds
    ]


class Table:
    """Rows of named numbers and arrays in memory of fixed size."""

    def __init__(self, fields: list[Field], capacity: int) -> None:
        """Take memory for `capacity` rows of `fields`, in the form of `np.dtype`."""
        self._rows = np.empty(capacity, fields)
        self._size = 0

    def append(self, row: tuple[Any, ...]) -> None:
        """Fill the next row with a value for each field, in their order."""
        self._rows[self._size] = row
        self._size += 1

    def columns(self) -> dict[str, Column]:
        """The filled rows, as an array for each field."""
        filled = self._rows[: self._size]
        return {name: filled[name].copy() for name in filled.dtype.fields or ()}


@dataclass(frozen=True, eq=False)
class Records:
    """One run.

    Columns of `steps`, one row per step of training: episode, time, state (n,), action (m,), cost,
    value, next_value, delta, features (d,), theta (d,), w (d,), loss, status (a `StepStatus`),
    restarts, violation (how far a plan leaves the box [m]), iterations, solves,
    solve_seconds, fit_seconds, seconds, alpha_phi2 (alpha ||phi||^2). theta and w are those after
    the step. Numbers that a step lacks are nan.

    Columns of `evaluations`, one row per rollout without noise: episode (number of trained ones),
    theta (d,), cost (infinite where a solve failed), states (K + 1, n), actions (K + 1, m).
    """

    experiment: dict[str, Any]  # the fields of the Experiment, or `Trial.stated`
    steps: dict[str, Column]
    evaluations: dict[str, Column]
    facts: Facts

    def save(self, path: Path) -> None:
        """Write a complete file beside `path`, then rename it.

        Raises:
            OSError: the file cannot be written; an earlier one stays.
        """
        about = {"experiment": self.experiment, "facts": self.facts}
        save_tables(path, about, {"steps": self.steps, "evaluations": self.evaluations})

    @classmethod
    def load(cls, path: Path) -> "Records":
        """Read a file that `save` wrote.

        Raises:
            FileNotFoundError: there is no file.
            DamagedRecords: the file is damaged, or has other columns than a run.
        """
        about, tables = load_tables(path, COLUMNS)
        experiment, facts = stated_in(about, path)
        return cls(experiment, tables["steps"], tables["evaluations"], facts)

    @staticmethod
    def about(path: Path) -> About:
        """The experiment's fields and the facts, without reading the tables.

        Raises:
            FileNotFoundError: there is no file.
            DamagedRecords: the file is damaged, or names no run.
        """
        return stated_in(load_about(path), path)


COLUMNS = {
    "steps": (*StepRow._fields, "alpha_phi2"),
    "evaluations": EvaluationRow._fields,
}


def stated_in(about: dict[str, Any], path: Path) -> About:
    """The experiment and the facts that a file states.

    Raises:
        DamagedRecords: the file names no run.
    """
    try:
        fields = about["experiment"].items()
        experiment = {name: value for name, value in fields if REMOVED.get(name) != value}
        if "states" not in experiment:  # which a trial has
            Experiment(**experiment)
        facts: Facts = about["facts"]
        return About(experiment, facts | {"solver": facts["solver"]})
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise DamagedRecords(f"{path} does not say which run it is") from error

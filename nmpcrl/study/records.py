"""What a run leaves behind: two tables of equal-length columns, and facts; one .npz file.

Analyses read records and nothing else. Loading never unpickles.
"""

import json
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Vector
from nmpcrl.study.atomic import write_whole

Column = NDArray[Any]
Tables = dict[str, dict[str, Column]]  # columns by name, by the name of their table
Field = tuple[str, type] | tuple[str, type, int | tuple[int, ...]]  # name, type[, shape]


LAST = 3  # rollouts that the final cost averages


class Stopped(StrEnum):
    """How training ended; the fact `stopped` begins with it, and may go on with ": " and why."""

    FINISHED = "finished"
    DIVERGED = "diverged"


class StepStatus(IntEnum):
    """How the solves of a step went: the column `status`."""

    SOLVED = 0
    RESTARTED = 1
    FAILED = 2

    @classmethod
    def of(cls, *, failed: bool, restarts: int) -> "StepStatus":
        """The worst that can be said of a step's solves."""
        return cls.FAILED if failed else cls.RESTARTED if restarts else cls.SOLVED


def final_cost(cost: Vector) -> float:
    """Noise-free cost at the end of a run: the mean of its last rollouts, `LAST` or fewer.

    The first rollout judges theta_init and is never among them. Infinite where one of them failed,
    or where training was stopped before there was any.

    Args:
        cost: of every rollout, theta_init's first, shape (rollouts,).
    """
    learned = cost[1:][-LAST:]
    return float(learned.mean()) if learned.size else np.inf


class DamagedRecords(ValueError):
    """A file is not a whole run."""


class Table:
    """Rows of named numbers and arrays, with room for all from the start."""

    def __init__(self, fields: list[Field], capacity: int) -> None:
        """Make room for `capacity` rows of `fields`, as `np.dtype` takes them."""
        self._rows = np.empty(capacity, fields)
        self._size = 0

    def append(self, row: tuple[Any, ...]) -> None:
        """Fill the next row; one value a field, in their order."""
        self._rows[self._size] = row
        self._size += 1

    def columns(self) -> dict[str, Column]:
        """One array a name, its first axis the rows that were filled."""
        filled = self._rows[: self._size]
        return {name: filled[name].copy() for name in filled.dtype.fields or ()}


@dataclass(frozen=True, eq=False)
class Records:
    """One run.

    Columns of `steps`, one row per step of training: episode, time, state (n,), action (m,), cost,
    value, next_value, delta, features (d,), theta (d,), w (d,), loss, status (a `StepStatus`),
    restarts, violation (how far a plan leaves the box [m]), iterations, solves,
    solve_seconds, fit_seconds, seconds, alpha_phi2 (alpha ||phi||^2). theta and w are those after
    the step. What a step does not have is nan.

    Columns of `evaluations`, one row per rollout without noise: episode (so many were trained),
    theta (d,), cost (infinite where a solve failed), states (K + 1, n), actions (K + 1, m).
    """

    experiment: dict[str, Any]  # the fields of the Experiment
    steps: dict[str, Column]
    evaluations: dict[str, Column]
    facts: dict[str, Any]  # stopped, solver, seconds, final_cost; when stored those of `provenance`

    def save(self, path: Path) -> None:
        """Write the whole file beside `path`, then rename it into place."""
        about = {"experiment": self.experiment, "facts": self.facts}
        save_arrays(path, about, {"steps": self.steps, "evaluations": self.evaluations})

    @classmethod
    def load(cls, path: Path) -> "Records":
        """Read a file that `save` wrote.

        Raises:
            FileNotFoundError: there is none.
            DamagedRecords: it cannot be read whole.
        """
        about, tables = load_arrays(path, ("steps", "evaluations"))
        return cls(about["experiment"], tables["steps"], tables["evaluations"], about["facts"])

    @staticmethod
    def about(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
        """The experiment's fields and the facts, without reading the tables."""
        try:
            with path.open("rb") as whole, np.load(whole, allow_pickle=False) as file:
                about = json.loads(str(file["about"]))
            return about["experiment"], about["facts"]
        except Exception as error:
            raise DamagedRecords(f"{path} is damaged, or not a run") from error


def save_arrays(path: Path, about: dict[str, Any], tables: Tables) -> None:
    """Write columns and facts beside `path`, whole, then rename the file into place."""
    arrays: dict[str, Any] = {
        f"{table}/{name}": column
        for table, columns in tables.items()
        for name, column in columns.items()
    }
    arrays["about"] = np.array(json.dumps(about))
    write_whole(path, lambda file: np.savez_compressed(file, **arrays))


def load_arrays(path: Path, names: tuple[str, ...]) -> tuple[dict[str, Any], Tables]:
    """The facts and the tables of these names from a file that `save_arrays` wrote.

    Raises:
        FileNotFoundError: there is none.
        DamagedRecords: it cannot be read whole.
    """
    try:
        with path.open("rb") as whole, np.load(whole, allow_pickle=False) as file:
            about = json.loads(str(file["about"]))
            tables: Tables = {name: {} for name in names}
            for key in file.files:
                table, _, name = key.partition("/")
                if name:
                    tables[table][name] = file[key]
        if not (set(about) >= {"experiment", "facts"} and all(tables.values())):
            raise LookupError("a table or the facts are missing")
        return about, tables
    except FileNotFoundError:
        raise
    except Exception as error:
        raise DamagedRecords(f"{path} is damaged, or not a run") from error

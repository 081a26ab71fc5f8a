"""The records of a run: two tables of equal-length columns, and facts, in one .npz file."""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Vector
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.files import write_file
from nmpcrl.study.refusal import Refusal

Column = NDArray[Any]

LAST = 3  # rollouts that the final cost averages
COLUMNS = {  # as `Records` describes them
    "steps": (
        *("episode", "time", "state", "action", "cost", "value", "next_value", "delta", "features"),
        *("theta", "w", "loss", "status", "restarts", "violation", "iterations", "solves"),
        *("seconds", "alpha_phi2"),
    ),
    "evaluations": ("episode", "theta", "cost", "states", "actions"),
}


class DamagedRecords(Refusal):
    """A file is incomplete, or of another run than its name says."""


class Stopped(StrEnum):
    """The end of training: the first word of the fact `stopped`, before ": " and the reason."""

    FINISHED = "finished"
    DIVERGED = "diverged"


class About(NamedTuple):
    """The experiment and the facts of a file."""

    experiment: dict[str, Any]  #: the fields when the file was written
    facts: dict[str, Any]


class StepStatus(IntEnum):
    """The worst result of a step's solves: the column `status`."""

    SOLVED = 0
    RESTARTED = 1
    FAILED = 2


def final_cost(cost: Vector) -> float:
    """Mean cost of the last rollouts without noise, `LAST` or fewer, without the first rollout.

    It is infinite where a rollout failed, and where there is only the rollout of theta_init.
    """
    learned = cost[1:][-LAST:]
    return float(learned.mean()) if learned.size else np.inf


@dataclass(frozen=True, eq=False)
class Records:
    """One run.

    Columns of `steps`, one row per step of training: episode, time, state (n,), action (m,), cost,
    value, next_value, delta, features (d,), theta (d,), w (d,), loss, status (a `StepStatus`),
    restarts, violation (how far a plan leaves the box [m]), iterations, solves, seconds (a step of
    its episode takes on average), alpha_phi2 (alpha ||phi||^2). theta and w are those after the
    step. Numbers that a step lacks are nan.

    Columns of `evaluations`, one row per rollout without noise: episode (number of trained ones),
    theta (d,), cost (infinite where a solve failed), states (K + 1, n), actions (K + 1, m).

    Facts: stopped (how training ended, as `Stopped` says), solver (that found the plans), seconds,
    final_cost; of a stored run also versions, machine, key and sources, a hash of the code.
    """

    experiment: dict[str, Any]  #: the fields of the Experiment, or `Trial.stated`
    steps: dict[str, Column]
    evaluations: dict[str, Column]
    facts: dict[str, Any]

    def save(self, path: Path) -> None:
        """Write a file as `write_file` does."""
        tables = {"steps": self.steps, "evaluations": self.evaluations}
        save_run(path, self.experiment, self.facts, tables)

    @classmethod
    def load(cls, path: Path) -> "Records":
        """Read a file that `save` wrote; errors as in `load_run`."""
        (experiment, facts), tables = load_run(path, COLUMNS)
        return cls(experiment=experiment, facts=facts, **tables)


def save_run(
    path: Path,
    experiment: Mapping[str, Any],
    facts: Mapping[str, Any],
    tables: Mapping[str, Mapping[str, Column]],
) -> None:
    """Write an .npz: members TABLE/COLUMN, and `about`, JSON of the experiment and the facts."""
    about = np.array(json.dumps({"experiment": experiment, "facts": facts}))
    members: dict[str, Any] = {
        f"{table}/{name}": one for table, columns in tables.items() for name, one in columns.items()
    }
    write_file(path, lambda file: np.savez_compressed(file, about=about, **members))


def load_run(
    path: Path, columns: Mapping[str, Collection[str]]
) -> tuple[About, dict[str, dict[str, Column]]]:
    """The experiment and the facts of a file, and its tables with these columns.

    DamagedRecords: a checksum of the zip format is wrong, the file names no run, or its columns
    have other names or unequal lengths.
    """
    tables: dict[str, dict[str, Column]] = {table: {} for table in columns}
    with path.open("rb") as raw:
        try:
            with np.load(raw, allow_pickle=False) as file:
                about = About(**json.loads(str(file["about"])))
                if about.experiment.get("plant") == "model":  # a field of the first edition
                    del about.experiment["plant"]
                if "solver" not in about.facts:
                    raise ValueError("about")
                if "states" not in about.experiment:  # which a trial has
                    Experiment(**about.experiment)
                for member in file.files:
                    table, _, name = member.partition("/")
                    if name in columns.get(table, ()):
                        tables[table][name] = file[member]
            for table, found in tables.items():
                if {*found} != {*columns[table]} or len({*map(len, found.values())}) > 1:
                    raise ValueError(table)
        except Exception as error:
            raise DamagedRecords(f"{path} is damaged, or not a run") from error
    return about, tables

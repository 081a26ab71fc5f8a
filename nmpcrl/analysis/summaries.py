"""Summaries of many runs: trained once, on this machine or on any executor, and stored here."""

from collections.abc import Iterable
from concurrent.futures import Executor
from contextlib import suppress
from pathlib import Path
from typing import Any

from nmpcrl.analysis.summary import RunSummary, summarise
from nmpcrl.control import Riccati
from nmpcrl.study import store
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.files import DamagedRecords
from nmpcrl.study.provenance import environment, summary_key
from nmpcrl.study.store import Runs, Store

FOLDER = "summaries"  # among the runs


class OtherSolver(RuntimeError):
    """A run was solved by another solver than its experiment names."""


def make(experiment: Experiment, *, afresh: bool = False) -> RunSummary:
    """The summary of a run, which is trained unless it is stored.

    Args:
        experiment: names the run.
        afresh: train it even if it is stored.

    Raises:
        OtherSolver: the run needed another solver than its experiment names.
    """
    if experiment.solver == Riccati.name and environment()["numba"] == "absent":
        raise OtherSolver("numba is not installed, and without it riccati solves nothing")
    records = None
    with suppress(FileNotFoundError, DamagedRecords):
        records = None if afresh else store.read(experiment)
    records = records or store.train(experiment)
    if other := store.solved_by_another(experiment, records.facts):
        raise OtherSolver(f"it was {other}")
    return summarise(records)


SUMMARIES = Store(RunSummary, make, summary_key, FOLDER)
path_of, is_stored, load, keep = (
    SUMMARIES.path_of, SUMMARIES.is_stored, SUMMARIES.read, SUMMARIES.keep
)  # fmt: skip


def folder() -> Path:
    """The folder of the summaries."""
    return store.folder() / FOLDER


def fetch_summaries(
    experiments: Iterable[Experiment],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: bool = True,
    strict: bool = True,
) -> Runs[RunSummary]:
    """The summaries of many runs: read if they are stored, otherwise made and stored.

    A run that fails does not stop the others; the next call tries it again.

    Args:
        experiments: the runs wanted.
        executor: trains them, such as `cluster.executor` gives; by default new processes.
        workers: how many processes; by default as many as there are cores.
        progress: whether to show a bar.
        strict: whether a failure is raised when all others are done, or only printed.

    Raises:
        StoreError: summaries are missing and cannot be stored.
        Failed: runs failed, and `strict` holds.
    """
    options: dict[str, Any] = {"executor": executor, "workers": workers, "strict": strict}
    return Runs(SUMMARIES.fetch_all(experiments, label="runs" if progress else "", **options))


def read(experiment: Experiment) -> RunSummary | None:
    """The stored summary of a run, if there is one."""
    with suppress(FileNotFoundError, DamagedRecords):
        return load(experiment)
    return None

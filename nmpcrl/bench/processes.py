"""Whole runs, their memory, several at once, and the first call: all in fresh processes."""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import astuple
from typing import Any

import pandas as pd

from nmpcrl.bench.learners import COMPARED
from nmpcrl.bench.paired import Ratio, pooled
from nmpcrl.bench.solves import Columns
from nmpcrl.study import paper
from nmpcrl.study.executor import THREADS
from nmpcrl.study.store import fetch_all
from nmpcrl.study.sweeps import sweep

PROCESSES = 7  # leave Student's interval 2.4 standard errors wide on each side; 21 would leave 2.1


def whole_runs(learners: tuple[str, ...], episodes: int) -> tuple[Columns, Columns]:
    """One run of each learner, one after the other, each alone in a process with one thread.

    Returns:
        A row a learner: learner, episodes, seconds, processor (seconds of it that the processor
        worked); and a row a learner and episode: learner, episode, seconds (from the start of the
        run), memory (resident, in bytes).
    """
    totals: Columns = {"learner": [], "episodes": [], "seconds": [], "processor": []}
    progress: Columns = {"learner": [], "episode": [], "seconds": [], "memory": []}
    for learner in learners:
        measured, _ = _alone("run", learner, str(episodes))
        done = len(measured["seconds"])
        _add(totals, learner, done, measured["total"], measured["processor"])
        for k in range(done):
            _add(progress, learner, k + 1, measured["seconds"][k], measured["memory"][k])
    return totals, progress


def _add(columns: Columns, *row: Any) -> None:
    for column, value in zip(columns.values(), row, strict=True):
        column.append(value)


def at_once(runs: int, episodes: int) -> Columns:
    """The same runs of ES by one process, and by as many as there are cores: workers, seconds.

    The start of the processes counts. No rows where no runs are asked for.
    """
    columns: Columns = {"workers": [], "seconds": [], "runs": [], "episodes": []}
    if not runs:
        return columns
    experiments = sweep(learner="ES", seed=tuple(range(runs)), episodes=episodes)
    for workers in sorted({1, os.cpu_count() or 1}):
        with tempfile.TemporaryDirectory() as folder, _environment(NMPCRL_RUNS=folder):
            began = time.perf_counter()
            fetch_all(experiments, workers=workers, progress=False)
            seconds = time.perf_counter() - began
        _add(columns, workers, seconds, runs, episodes)
    return columns


def first_calls(times: int, *, compile_too: bool) -> Columns:
    """The first call in a fresh process, whose machine code is kept from before or has to be made.

    Returns:
        A row a process: cached, solve, step (seconds, as `fresh_process.first_call`), process
        (seconds from its start to its end), notice (whether it said that it compiles).
    """
    columns: Columns = {"cached": [], "solve": [], "step": [], "process": [], "notice": []}
    with tempfile.TemporaryDirectory() as folder:
        for cached in [False] * compile_too + [True] * times:
            with _environment(**({"NMPCRL_CACHE": folder} if compile_too else {})):
                began = time.perf_counter()
                measured, said = _alone("first")
                process = time.perf_counter() - began
            _add(columns, cached, *measured.values(), process, "Compiling" in said)
    return columns


def time_learners_afresh(processes: int = PROCESSES, steps: int = paper.STEPS) -> pd.DataFrame:
    """`time_learners` in so many fresh processes, one after the other, each number their median.

    But for the ratios to ES and their intervals, which are `pooled`: so the interval also covers
    where code and data come to lie in memory.

    Args:
        processes: how many, two or more.
        steps: of each learner, in each of them; a whole episode shows a median in each.
    """
    tables = [pd.DataFrame(_alone("steps", str(steps))[0]) for _ in range(processes)]
    named = ["solver", "learner"]
    numbers = tables[0].columns.difference(named)
    whole = pd.concat(tables).astype(dict.fromkeys(numbers, float)).groupby(named, sort=False)
    rows = []
    for (solver, learner), group in whole:
        ratios = [Ratio(*one) for one in group[COMPARED].itertuples(index=False)]
        row = {"solver": solver, "learner": learner, **group[numbers].median()}
        rows.append(row | dict(zip(COMPARED, astuple(pooled(ratios)), strict=True)))
    return pd.DataFrame(rows)[list(tables[0])]


def _alone(*arguments: str) -> tuple[dict[str, Any], str]:
    """What `fresh` prints in a process of its own, and what that says on standard error."""
    done = subprocess.run(
        [sys.executable, "-m", "nmpcrl.bench.fresh_process", *arguments],
        env=os.environ | dict.fromkeys(THREADS, "1"),
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(f"measuring {' '.join(arguments)} failed: {done.stderr}")
    return json.loads(done.stdout), done.stderr


@contextmanager
def _environment(**variables: str) -> Iterator[None]:
    """Environment variables for the processes that are started meanwhile."""
    before = dict(os.environ)
    os.environ.update(variables)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)

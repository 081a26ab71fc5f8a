"""Whole runs, their memory, several at once, and the first call: all in fresh processes."""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import astuple
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.bench.learners import COMPARED
from nmpcrl.bench.paired import Ratio, pooled
from nmpcrl.bench.problem_sizes import Sizes
from nmpcrl.bench.solves import Columns, transposed
from nmpcrl.study import paper
from nmpcrl.study.design import sweep
from nmpcrl.study.jobs import ONE_THREAD
from nmpcrl.study.store import fetch_all

PROCESSES = 7  # leave Student's interval 2.4 standard errors wide on each side; 21 would leave 2.1
REPETITIONS = 10  # of a measurement that is published: of so many, nine intervals should hold
NAMED = ["solver", "learner"]  # a row of the table of times


def whole_runs(learners: tuple[str, ...], episodes: int) -> tuple[Columns, Columns]:
    """One run of each learner, one after the other, each alone in a process with one thread.

    Returns:
        A row a learner: learner, episodes, seconds, processor (seconds of it that the processor
        worked); and a row a learner and episode: learner, episode, seconds (from the start of the
        run), memory (resident, in bytes).
    """
    totals, progress = [], []
    for learner in learners:
        measured, _ = _alone("run", learner, str(episodes))
        seconds, memory = measured["seconds"], measured["memory"]
        totals.append((learner, len(seconds), measured["total"], measured["processor"]))
        progress += [
            (learner, k + 1, *one) for k, one in enumerate(zip(seconds, memory, strict=True))
        ]
    return (
        transposed("learner episodes seconds processor", totals),
        transposed("learner episode seconds memory", progress),
    )


def at_once(runs: int, episodes: int) -> Columns:
    """The same runs of ES by one process, and by as many as there are cores: workers, seconds.

    The start of the processes counts. No rows where no runs are asked for.
    """
    rows = []
    experiments = sweep(learner="ES", seed=tuple(range(runs)), episodes=episodes) if runs else ()
    for workers in sorted({1, os.cpu_count() or 1}) if runs else ():
        with tempfile.TemporaryDirectory() as folder, _environment(NMPCRL_RUNS=folder):
            began = time.perf_counter()
            fetch_all(experiments, workers=workers, progress=False)
            seconds = time.perf_counter() - began
        rows.append((workers, seconds, runs, episodes))
    return transposed("workers seconds runs episodes", rows)


def first_calls(times: int, *, compile_too: bool) -> Columns:
    """The first call in a fresh process, whose machine code is kept from before or has to be made.

    Returns:
        A row a process: cached, solve, step (seconds, as `fresh_process.first_call`), process
        (seconds from its start to its end), notice (whether it said that it compiles).
    """
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for cached in [False] * compile_too + [True] * times:
            with _environment(**({"NMPCRL_CACHE": folder} if compile_too else {})):
                began = time.perf_counter()
                measured, said = _alone("first")
                process = time.perf_counter() - began
            rows.append((cached, *measured.values(), process, "Compiling" in said))
    return transposed("cached solve step process notice", rows)


def problem_of_sizes(sizes: Sizes) -> dict[str, float]:
    """`problem_sizes.measured` in a fresh process that has no machine code of it yet."""
    with tempfile.TemporaryDirectory() as folder, _environment(NMPCRL_CACHE=folder):
        found, _ = _alone("sizes", *map(str, sizes))
    return found


def time_learners_afresh(processes: int = PROCESSES, steps: int = paper.STEPS) -> pd.DataFrame:
    """`time_learners` in so many fresh processes, one after the other, `together`.

    The intervals also cover where code and data come to lie in memory.

    Args:
        processes: how many, two or more.
        steps: of each learner, in each of them: whole episodes.
    """
    return together([_time_learners(steps) for _ in range(processes)])


def time_learners_repeatedly() -> pd.DataFrame:
    """`time_learners_afresh` `REPETITIONS` times, one after the other, with the coverage of each.

    The intervals cover what changes from one repetition to the next as well.
    """
    return repeated([time_learners_afresh() for _ in range(REPETITIONS)])


def together(tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """What several measurements of the same learners come to.

    Times are geometric means, as `pooled` ratios are, so that they divide to them; the rest of a
    step is what its solves and its fit leave.

    Args:
        tables: of `time_learners`, or of this function; two or more.
    """
    numbers = tables[0].columns.difference(NAMED)
    times = numbers.difference(COMPARED)
    whole = pd.concat(tables).astype(dict.fromkeys(numbers, float)).groupby(NAMED, sort=False)
    rows = []
    for name, group in whole:
        ratios = [Ratio(*one) for one in group[COMPARED].itertuples(index=False)]
        row = dict(zip(NAMED, name, strict=True)) | dict(np.exp(np.log(group[times]).mean()))
        parts = row["solves"] * row["ms_per_solve"] + np.nan_to_num(row["ms_per_fit"])
        row["ms_per_rest"] = row["ms_per_step"] - parts
        rows.append(row | dict(zip(COMPARED, astuple(pooled(ratios)), strict=True)))
    return pd.DataFrame(rows)[list(tables[0])]


def repeated(tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Repetitions of one measurement `together`, with how many of their intervals hold the whole's.

    Args:
        tables: of `time_learners_afresh`, two or more.

    Returns:
        Further columns repetitions, and inside: of how many the interval holds the ratio of all.
    """
    whole = together(tables).set_index(NAMED)
    inside = sum(
        (one.ratio_low <= whole.ratio) & (whole.ratio <= one.ratio_high)
        for one in (table.set_index(NAMED) for table in tables)
    )
    return whole.assign(repetitions=len(tables), inside=inside).reset_index()


def _time_learners(steps: int) -> pd.DataFrame:
    """`time_learners` in a process of its own."""
    return pd.DataFrame(_alone("steps", str(steps))[0])


def _alone(*arguments: str) -> tuple[dict[str, Any], str]:
    """What `fresh` prints in a process of its own, and what that says on standard error."""
    done = subprocess.run(
        [sys.executable, "-m", "nmpcrl.bench.fresh_process", *arguments],
        env=os.environ | ONE_THREAD,
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

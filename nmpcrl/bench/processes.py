"""The table of learning steps over several fresh processes, and over repetitions of that."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import astuple

import numpy as np
import pandas as pd

from nmpcrl.bench.learners import COMPARED
from nmpcrl.bench.paired import Ratio, pooled
from nmpcrl.study import paper
from nmpcrl.study.jobs import ONE_THREAD

PROCESSES = 7  # leave Student's interval 2.4 standard errors wide on each side; 21 would leave 2.1
REPETITIONS = 10  # of a measurement that is published: of so many, nine intervals should hold
NAMED = ["solver", "learner"]  # a row of the table of times


def time_learners_afresh(processes: int = PROCESSES, steps: int = paper.STEPS) -> pd.DataFrame:
    """`time_learners` in so many fresh processes, one after the other, `together`.

    The intervals also cover where code and data come to lie in memory.

    Args:
        processes: how many, two or more.
        steps: of each learner, in each of them: whole episodes.

    Raises:
        RuntimeError: a process failed; carries what it wrote on standard error.
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
    times = tables[0].columns.difference([*NAMED, *COMPARED])
    rows = []
    for name, group in pd.concat(tables).groupby(NAMED, sort=False):
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
    done = subprocess.run(
        [sys.executable, "-m", "nmpcrl.bench.learners", str(steps)],
        env=os.environ | ONE_THREAD,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(f"timing {steps} steps of each learner failed: {done.stderr}")
    return pd.DataFrame(json.loads(done.stdout))

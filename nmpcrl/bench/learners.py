"""How long a learning step takes: the learners take turns with each solver.

`time_learners` measures in one process, others in several fresh ones, and that repeatedly.
`python -m nmpcrl.bench.learners STEPS` prints the table of `time_learners` as JSON.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import astuple
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Matrix
from nmpcrl.bench.paired import TURN, Ratio, paired_ratio, pooled
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.learning.training import Step, train
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.jobs import ONE_THREAD
from nmpcrl.study.setup import prepare

LEARNERS = ("ES", "GES", "RDES", "DES")
REFERENCE = "ES"  # whose step the others' are compared with
SETTLED = max(paper.BATCH, paper.STEPS)  # steps before counting: the networks are fitted then
PAPER_HOURS = {"ES": 18.0, "GES": 18.0, "RDES": 9.0}  # Table II: training time of 300 episodes
PAPER_SOLVE = PAPER_HOURS["ES"] * 3600 / (2 * paper.EPISODES * paper.STEPS)  # [s]
COMPARED = ["ratio", "ratio_low", "ratio_high", "waited"]  # columns: the fields of `Ratio`
PROCESSES = 7  # leave Student's interval 2.4 standard errors wide on each side; 21 would leave 2.1
REPETITIONS = 10  # of a measurement that is published: of so many, nine intervals should hold
NAMED = ["solver", "learner"]  # a row of the table of times


def time_learners(
    learners: tuple[str, ...] = LEARNERS,
    solvers: tuple[str, ...] = tuple(SOLVERS),
    steps: int = 3 * paper.STEPS,
) -> pd.DataFrame:
    """Time of one learning step, one row a learner and solver.

    All take `TURN` steps each in turn, in this process, so that a change of the machine's speed
    affects all of them; in a new order each time, because a solve after a network's fit finds the
    processor's cache full of it. With one step at a time, riccati would spend half of its time on
    fetching its code back. `steps` of each count, from the second episode on, when the networks are
    fitted. All times are the processor's, and the parts of a step get their share: see `paired`.

    Columns: solver, learner, solves (per step); ms_per_step, ms_per_solve, ms_per_fit (nan where
    there is no fit) and ms_per_rest (plant, cost, update, loop), means that add up; hours (of the
    paper's 300 x 130 steps), hours_paper (Table II; nan for DES); and of `Ratio` to ES: ratio,
    ratio_low, ratio_high and waited (nan where ES is not among the learners).
    """
    runs = {(solver, one): _steps(one, solver) for solver in solvers for one in learners}
    times: dict[tuple[str, str], list[tuple[float, ...]]] = {name: [] for name in runs}
    names, rng = list(runs), np.random.default_rng(0)
    for first in range(0, SETTLED + steps, TURN):
        for i in rng.permutation(len(names)):
            for _ in range(min(TURN, SETTLED + steps - first)):
                times[names[i]].append(_timed(runs[names[i]]))
    counted = {name: np.array(rows[SETTLED:]).T for name, rows in times.items()}
    rows = []
    for (solver, learner), parts in counted.items():
        row = {"solver": solver, "learner": learner} | _means(parts)
        row |= {"hours_paper": PAPER_HOURS.get(learner, np.nan)} | dict.fromkeys(COMPARED, np.nan)
        if (solver, REFERENCE) in counted:
            (*_, passed, work), (*_, their_passed, theirs) = parts, counted[solver, REFERENCE]
            found = astuple(paired_ratio(work, theirs, passed, their_passed))
            row |= dict(zip(COMPARED, found, strict=True))
        rows.append(row)
    return pd.DataFrame(rows)


def ratio(timings: pd.DataFrame, solver: str, learner: str) -> Ratio:
    """Time of a learner's step over that of ES with the same solver, from `time_learners`."""
    row = timings.set_index(["solver", "learner"]).loc[(solver, learner)]
    return Ratio(*(float(row[name]) for name in COMPARED))


def _steps(learner: str, solver: str) -> Iterator[Step]:
    """The steps of one run as they are made."""
    experiment = Experiment(learner=learner, solver=solver)
    controller = paper.nmpc(solver=solver)
    learning, weights, explore = prepare(experiment, controller)
    return train(learning, controller, weights, explore)


def _timed(steps: Iterator[Step]) -> tuple[float, ...]:
    """The next step: its number of solves; the time [s] of these, of the network and of all.

    The last number is the processor's time of all, of every thread. No solve fails here.
    """
    began, worked = time.perf_counter(), time.process_time()
    step = next(steps)
    work, passed = time.process_time() - worked, time.perf_counter() - began
    if step.solution is None or step.update is None:
        raise RuntimeError(f"a solve failed while timing: {step.failure}")
    successor = step.update.successor
    second = successor.solution if successor else None
    solving = step.solution.seconds + (second.seconds if second else 0.0)
    fitting = successor.seconds if successor else 0.0
    return (2.0 if second else 1.0), solving, fitting, passed, work


def _means(parts: Matrix) -> dict[str, Any]:
    """What a step of one learner is made of; `parts` are the rows of `_timed`, one a column."""
    solves, solving, fitting, passed, work = parts
    share = work / passed  # what the processor did of each part, which has only the other clock
    step = float(work.mean())
    return {
        "solves": float(solves.mean()),
        "ms_per_step": 1e3 * step,
        "ms_per_solve": 1e3 * float((share * solving).sum() / solves.sum()),
        "ms_per_fit": 1e3 * float((share * fitting).mean()) if fitting.any() else np.nan,
        "ms_per_rest": 1e3 * float((work - share * (solving + fitting)).mean()),
        "hours": step * paper.EPISODES * paper.STEPS / 3600,
    }


def time_learners_afresh(processes: int = PROCESSES, steps: int = paper.STEPS) -> pd.DataFrame:
    """`time_learners` in two or more fresh processes, one after the other, `together`.

    The intervals also cover where code and data come to lie in memory. A process that fails raises
    RuntimeError with what it wrote on standard error.
    """
    return together([_time_learners(steps) for _ in range(processes)])


def time_learners_repeatedly() -> pd.DataFrame:
    """`time_learners_afresh` `REPETITIONS` times, one after the other, with the coverage of each.

    The intervals cover what changes from one repetition to the next as well.
    """
    return repeated([time_learners_afresh() for _ in range(REPETITIONS)])


def together(tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Several tables of `time_learners`, or of this function, as one.

    Times are geometric means, as `pooled` ratios are, so that they divide to them; the rest of a
    step is what its solves and its fit leave.
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
    """Repetitions of `time_learners_afresh`, two or more, `together`.

    Further columns: repetitions, and inside, of how many the interval holds the ratio of all.
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


if __name__ == "__main__":
    print(json.dumps(time_learners(steps=int(sys.argv[1])).to_dict("list")))

"""How long a learning step takes: the learners take turns with each solver, in one process.

`python -m nmpcrl.bench.learners STEPS` prints the table of `time_learners` as JSON.
"""

import json
import sys
import time
from collections.abc import Iterator
from dataclasses import astuple
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Matrix
from nmpcrl.bench.paired import TURN, Ratio, paired_ratio
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.learning.training import Step, train
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.setup import prepare

LEARNERS = ("ES", "GES", "RDES", "DES")
REFERENCE = "ES"  # whose step the others' are compared with
SETTLED = max(paper.BATCH, paper.STEPS)  # steps before counting: the networks are fitted then
PAPER_HOURS = {"ES": 18.0, "GES": 18.0, "RDES": 9.0}  # Table II: training time of 300 episodes
PAPER_SOLVE = PAPER_HOURS["ES"] * 3600 / (2 * paper.EPISODES * paper.STEPS)  # [s]
COMPARED = ["ratio", "ratio_low", "ratio_high", "waited"]  # columns: the fields of `Ratio`


def time_learners(
    learners: tuple[str, ...] = LEARNERS,
    solvers: tuple[str, ...] = tuple(SOLVERS),
    steps: int = 3 * paper.STEPS,
) -> pd.DataFrame:
    """Time of one learning step, one row a learner and solver.

    All take `TURN` steps each in turn, in this process and with one thread, so that a change of the
    machine's speed affects all of them; in a new order each time, because a solve after a
    network's fit finds the processor's cache full of it. With one step at a time, a solver as fast
    as riccati would spend half of its time on fetching its code back. Counting starts with the
    second episode, when the networks are fitted; by default it covers whole episodes.

    All times are the processor's, and the parts of a step get their share of it. `paired` says why,
    and how the steps of two learners are compared.

    Args:
        learners: names, as `Experiment` knows them.
        solvers: names, as `Experiment` knows them.
        steps: how many steps of each count.

    Returns:
        Columns solver, learner, solves (per step), ms_per_step, ms_per_solve, ms_per_fit (nan where
        there is no fit), ms_per_rest (plant, cost, update and the loop around them), which are
        means and add up, hours (the mean step times the paper's 300 x 130 steps), hours_paper
        (Table II; nan for DES, which is not in it), and of `Ratio` to ES: ratio, ratio_low,
        ratio_high and waited (nan where ES is not among the learners).
    """
    runs = {
        (solver, learner): _steps(learner, solver) for solver in solvers for learner in learners
    }
    times: dict[tuple[str, str], list[tuple[float, ...]]] = {name: [] for name in runs}
    names, rng = list(runs), np.random.default_rng(0)
    for first in range(0, SETTLED + steps, TURN):
        for i in rng.permutation(len(names)):
            for _ in range(min(TURN, SETTLED + steps - first)):
                times[names[i]].append(_timed(runs[names[i]]))
    counted = {name: np.array(rows[SETTLED:]).T for name, rows in times.items()}
    rows = [
        dict[str, Any](solver=solver, learner=learner)
        | _means(parts)
        | {"hours_paper": PAPER_HOURS.get(learner, np.nan)}
        | _against(parts, counted.get((solver, REFERENCE)))
        for (solver, learner), parts in counted.items()
    ]
    return pd.DataFrame(rows)


def ratio(timings: pd.DataFrame, solver: str, learner: str) -> Ratio:
    """Time of a learner's step over that of one of ES with the same solver.

    Args:
        timings: of `time_learners`.
        solver: name of both's.
        learner: name.

    Raises:
        KeyError: the learner was not timed with this solver.
    """
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


def _means(parts: Matrix) -> dict[str, float]:
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


def _against(mine: Matrix, reference: Matrix | None) -> dict[str, float]:
    """The columns of a row that compare it with the reference."""
    if reference is None:
        return dict.fromkeys(COMPARED, np.nan)
    (*_, passed, work), (*_, their_passed, theirs) = mine, reference
    return dict(
        zip(COMPARED, astuple(paired_ratio(work, theirs, passed, their_passed)), strict=True)
    )


if __name__ == "__main__":
    print(json.dumps(time_learners(steps=int(sys.argv[1])).to_dict("list")))

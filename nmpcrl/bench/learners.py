"""How long a learning step takes: our learners with each solver, and mpcrl's beside ours."""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.bench.solves import Columns
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.learning.rollout import Persistent
from nmpcrl.learning.training import Step, train
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.setup import prepare

TURN = 20  # steps that a learner takes at a time: then the caches hold what its own loop leaves


def learners(steps: int) -> Columns:
    """Table II with every solver: the columns of `time_learners`; None where there is no number."""
    table = time_learners(steps=steps, turn=TURN).astype(object)
    result: Columns = table.where(table.notna(), None).to_dict("list")
    return result


def against_mpcrl(rounds: int, steps: int) -> Columns:
    """ES and mpcrl's Q-learning in turn, an episode's first steps each; seconds of every step.

    Returns:
        A row a round and learner: learner ("ES" or "mpcrl"), seconds. No rows without mpcrl.
    """
    columns: Columns = {"learner": [], "seconds": []}
    try:
        from nmpcrl.bench.baseline_mpcrl import time_mpcrl
    except ImportError:
        return columns
    for _ in range(rounds):
        for learner, times in (("mpcrl", time_mpcrl(steps)), ("ES", _time_es(steps))):
            columns["learner"] += [learner] * len(times)
            columns["seconds"] += times
    return columns


def _time_es(steps: int, episodes: int = 5) -> list[float]:
    """Seconds of as many first steps of some episodes of ES, each with noise of its own."""
    times = []
    for seed in range(episodes):
        learning = learn("ES", seed=seed)
        next(learning)  # the first call loads the solver
        for _ in range(steps):
            began = time.perf_counter()
            next(learning)
            times.append(time.perf_counter() - began)
    return times


PAPER_HOURS = {"ES": 18.0, "GES": 18.0, "RDES": 9.0}  # Table II: training time of 300 episodes


def time_learners(
    learners: tuple[str, ...] = ("ES", "GES", "RDES", "DES"),
    solvers: tuple[str, ...] = tuple(SOLVERS),
    steps: int = 400,
    turn: int = 1,
) -> pd.DataFrame:
    """Time of one learning step, one row a learner and solver.

    All take some steps each in turn, in this process and with one thread, so that a change of the
    machine's speed meets all alike; in a new order each time, because whoever follows a network's
    fit finds the processor's cache full of it. Counting starts when the networks are fitted.

    Args:
        learners: names, as `Experiment` knows them.
        solvers: names, as `Experiment` knows them.
        steps: how many steps of each count.
        turn: how many steps each takes at a time. With one, a solver as fast as riccati spends half
            of its time on fetching its code back into the cache.

    Returns:
        Columns solver, learner, solves (per step), ms_per_step, ms_per_solve, ms_per_fit (nan where
        there is no fit), ms_per_rest (plant, cost, update and the loop around them), which are
        medians, hours (the median step times the paper's 300 x 130 steps), and hours_paper (Table
        II; nan for DES, which is not in it).
    """
    runs = {
        (solver, learner): learn(learner, solver=solver)
        for solver in solvers
        for learner in learners
    }
    times: dict[tuple[str, str], list[tuple[float, ...]]] = {name: [] for name in runs}
    names, rng = list(runs), np.random.default_rng(0)
    for first in range(0, paper.BATCH + steps, turn):
        for i in rng.permutation(len(names)):
            for _ in range(min(turn, paper.BATCH + steps - first)):
                times[names[i]].append(_timed(runs[names[i]]))
    rows = []
    for (solver, learner), parts in times.items():
        solves, solving, fitting, whole = np.array(parts[paper.BATCH :]).T
        step = float(np.median(whole))
        rows.append(
            {
                "solver": solver,
                "learner": learner,
                "solves": float(solves.mean()),
                "ms_per_step": 1e3 * step,
                "ms_per_solve": 1e3 * float(np.median(solving / solves)),
                "ms_per_fit": 1e3 * float(np.median(fitting)) if fitting.any() else np.nan,
                "ms_per_rest": 1e3 * float(np.median(whole - solving - fitting)),
                "hours": step * paper.EPISODES * paper.STEPS / 3600,
                "hours_paper": PAPER_HOURS.get(learner, np.nan),
            }
        )
    return pd.DataFrame(rows)


def ratio(timings: pd.DataFrame, solver: str, learner: str, reference: str = "ES") -> float:
    """Time of a learner's step over that of the reference's, with one solver."""
    per_step = timings[timings.solver == solver].set_index("learner").ms_per_step
    return float(per_step[learner] / per_step[reference])


def learn(learner: str, **fields: Any) -> Iterator[Step]:
    """The steps of one run as they are made; `fields` are those of `Experiment`."""
    experiment = Experiment(learner=learner, **fields)
    controller = Persistent(paper.nmpc(solver=experiment.solver))
    learning, weights, explore = prepare(experiment, controller)
    return train(learning, controller, weights, explore)


def _timed(steps: Iterator[Step]) -> tuple[float, float, float, float]:
    """The next step's number of solves, their time, the network's and all [s]; none fails here."""
    began = time.perf_counter()
    step = next(steps)
    whole = time.perf_counter() - began
    if step.solution is None or step.update is None:
        raise RuntimeError(f"a solve failed while timing: {step.failure}")
    successor = step.update.successor
    second = successor.solution if successor else None
    solving = step.solution.seconds + (second.seconds if second else 0.0)
    fitting = successor.seconds if successor else 0.0
    return (2.0 if second else 1.0), solving, fitting, whole

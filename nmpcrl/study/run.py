"""`run` trains an experiment or a trial, evaluates theta without noise, and returns records."""

import gc
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from nmpcrl.learning import Weights
from nmpcrl.learning.episode import Episode, episodes
from nmpcrl.learning.rollout import evaluate
from nmpcrl.learning.training import Diverged, absurd
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import (
    Column,
    EvaluationRow,
    Records,
    StepRow,
    StepStatus,
    Stopped,
    columns,
    final_cost,
    form_of,
)
from nmpcrl.study.setup import Job, job_of
from nmpcrl.study.trial import Trial


def run(
    named: Experiment | Trial, on_episode: Callable[[int, float], None] | None = None
) -> Records:
    """Train and evaluate; the same experiment or trial gives the same numbers.

    Args:
        named: the run; fields that an experiment's learner does not read have their defaults.
        on_episode: called after each episode with the number of episodes and the summed cost.
    """
    job = job_of(named)
    gc.freeze()  # the collector need not search the imported modules again and again
    try:
        return _run(job, on_episode)
    finally:
        gc.unfreeze()


def _run(job: Job, on_episode: Callable[[int, float], None] | None) -> Records:
    named, controller, weights = job.named, job.controller, job.weights
    sizes = controller.n, controller.m, weights.theta.size, named.steps
    made, stopped = list[tuple[Episode, float]](), str(Stopped.FINISHED)
    evaluations, began = [_evaluation(job, weights, 0)], time.perf_counter()
    try:
        how = {**job.options, **job.environment}
        for episode in episodes(job.learner, controller, weights, job.explore, **how):
            made.append((episode, time.perf_counter() - began))
            done = episode.number + 1
            due = done % named.evaluate_every == 0 or done == named.episodes
            if due and not absurd(episode.weights, controller.largest):
                evaluations.append(_evaluation(job, episode.weights, done))
            if on_episode:
                on_episode(done, float(np.sum(episode.columns["cost"])))
            began = time.perf_counter()
    except Diverged as error:
        stopped = f"{Stopped.DIVERGED}: {error}"
    table = _table(made, form_of(StepRow, *sizes))
    judged = columns(np.array(evaluations, form_of(EvaluationRow, *sizes)))
    alpha = named.alpha if isinstance(named, Experiment) else np.nan
    table["alpha_phi2"] = alpha * (table["features"] ** 2).sum(axis=1)
    others = [episode.solver for episode, _ in made if episode.solver]
    facts = {
        "stopped": stopped,
        "solver": [controller.solver.name, *others][-1],  # another if it took over, if only once
        "seconds": float(table["seconds"].sum()),
        "final_cost": final_cost(judged["cost"]),
    }
    return Records(named.stated, table, judged, facts)


def _table(made: list[tuple[Episode, float]], form: np.dtype[Any]) -> dict[str, Column]:
    """`Records.steps` from the episodes and the time that each took [s]."""
    rows = np.empty(sum(episode.steps for episode, _ in made), form)
    at = 0
    for episode, seconds in made:
        part, length = rows[at : at + episode.steps], episode.steps
        for name, column in episode.columns.items():
            part[name] = column
        part["episode"], part["time"] = episode.number, np.arange(length)
        part["seconds"] = seconds / length
        part["status"] = np.where(part["restarts"], StepStatus.RESTARTED, StepStatus.SOLVED)
        if episode.failure:
            part["status"][-1] = StepStatus.FAILED
        at += length
    return columns(rows)


def _evaluation(job: Job, weights: Weights, episode: int) -> EvaluationRow:
    """The row of `Records.evaluations` for the policy of `weights`."""
    steps, rng = job.named.steps, np.random.default_rng(job.judged)
    rollout = evaluate(job.controller, weights.theta, steps, rng=rng, **job.environment)
    missing = ((0, steps - len(rollout.states)), (0, 0))
    states, actions = (
        np.pad(reached, missing, constant_values=np.nan)
        for reached in (rollout.states, rollout.actions)
    )
    return EvaluationRow(episode, weights.theta, rollout.cost, states, actions)

"""`run` trains an experiment or a trial, evaluates theta without noise, and returns records."""

import gc
import time
from collections.abc import Callable, Sequence

import numpy as np

from nmpcrl.learning import Weights
from nmpcrl.learning.episode import Episode, episodes
from nmpcrl.learning.rollout import evaluate
from nmpcrl.learning.training import Diverged, absurd
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import COLUMNS, Column, Records, StepStatus, Stopped, final_cost
from nmpcrl.study.setup import Job, job_of
from nmpcrl.study.trial import Trial

COUNTED = ("episode", "time", "status", "restarts", "iterations", "solves")  # whole numbers


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
    made, seconds, stopped = list[Episode](), list[float](), str(Stopped.FINISHED)
    evaluations, began = [_evaluation(job, weights, 0)], time.perf_counter()
    try:
        how = {**job.options, **job.environment}
        for episode in episodes(job.learner, controller, weights, job.explore, **how):
            made.append(episode)
            seconds.append(time.perf_counter() - began)
            done = episode.number + 1
            due = done % named.evaluate_every == 0 or done == named.episodes
            if due and not absurd(episode.weights, controller.largest):
                evaluations.append(_evaluation(job, episode.weights, done))
            if on_episode:
                on_episode(done, float(np.sum(episode.columns["cost"])))
            began = time.perf_counter()
    except Diverged as error:
        stopped = f"{Stopped.DIVERGED}: {error}"
    steps = _steps(made, seconds, named.alpha if isinstance(named, Experiment) else np.nan)
    judged = map(np.array, zip(*evaluations, strict=True))
    table = dict(zip(COLUMNS["evaluations"], judged, strict=True))
    others = [episode.solver for episode in made if episode.solver]
    facts = {
        "stopped": stopped,
        "solver": [controller.solver.name, *others][-1],  # another where it is not installed
        "seconds": float(steps["seconds"].sum()),
        "final_cost": final_cost(table["cost"]),
    }
    return Records(named.stated, steps, table, facts)


def _steps(made: Sequence[Episode], seconds: Sequence[float], alpha: float) -> dict[str, Column]:
    """`Records.steps` from the episodes and the time that each took [s]."""
    lengths = [episode.steps for episode in made]
    found = {name: np.concatenate([e.columns[name] for e in made]) for name in made[0].columns}
    found["episode"] = np.repeat([episode.number for episode in made], lengths)
    found["time"] = np.concatenate([np.arange(length) for length in lengths])
    found["seconds"] = np.repeat(np.divide(seconds, lengths), lengths)
    found["status"] = np.where(found["restarts"] > 0, StepStatus.RESTARTED, StepStatus.SOLVED)
    failed = [episode.failure != "" for episode in made]
    found["status"][np.cumsum(lengths)[failed] - 1] = StepStatus.FAILED
    found["alpha_phi2"] = alpha * (found["features"] ** 2).sum(axis=1)
    kinds = {name: int if name in COUNTED else float for name in COLUMNS["steps"]}
    return {name: found[name].astype(kind) for name, kind in kinds.items()}


def _evaluation(job: Job, weights: Weights, episode: int) -> tuple[int | float | Column, ...]:
    """The row of `Records.evaluations` for the policy of `weights`."""
    steps, rng = job.named.steps, np.random.default_rng(job.judged)
    rollout = evaluate(job.controller, weights.theta, steps, rng=rng, **job.environment)
    missing = ((0, steps - len(rollout.states)), (0, 0))
    states, actions = (
        np.pad(reached, missing, constant_values=np.nan)
        for reached in (rollout.states, rollout.actions)
    )
    return episode, weights.theta, rollout.cost, states, actions

"""`run` trains an experiment or a trial, evaluates theta without noise, and returns records."""

import gc
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from nmpcrl.control import Solution
from nmpcrl.learning import NextValue, Weights
from nmpcrl.learning.rollout import evaluate
from nmpcrl.learning.training import Diverged, Step, absurd, train
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import (
    EvaluationRow,
    Records,
    StepRow,
    StepStatus,
    Stopped,
    Table,
    final_cost,
    form_of,
)
from nmpcrl.study.setup import Job, job_of
from nmpcrl.study.trial import Trial

UNKNOWN = NextValue(np.nan)  # of a step without a bootstrap
UNSOLVED: Any = SimpleNamespace(value=np.nan, features=np.nan)  # it failed or was not needed


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
    steps = Table(form_of(StepRow, *sizes), named.episodes * named.steps)
    evaluations = Table(form_of(EvaluationRow, *sizes), named.episodes // named.evaluate_every + 2)
    evaluations.append(_evaluation(job, weights, 0))
    stopped, cost, began = str(Stopped.FINISHED), 0.0, time.perf_counter()
    own = solver = controller.solver.name
    try:
        how = {**job.options, **job.environment}
        for step in train(job.learner, controller, weights, job.explore, **how):
            seconds = time.perf_counter() - began
            steps.append(_row(step, seconds))
            cost += step.cost
            solver = next((one.solver for one in _solves(step) if one.solver != own), solver)
            if step.last:
                done = step.episode + 1
                due = done % named.evaluate_every == 0 or done == named.episodes
                if due and not absurd(step.weights, controller.largest):
                    evaluations.append(_evaluation(job, step.weights, done))
                if on_episode:
                    on_episode(done, cost)
                cost = 0.0
            began = time.perf_counter()
    except Diverged as error:
        stopped = f"{Stopped.DIVERGED}: {error}"
    table, judged = steps.columns(), evaluations.columns()
    alpha = named.alpha if isinstance(named, Experiment) else np.nan
    table["alpha_phi2"] = alpha * (table["features"] ** 2).sum(axis=1)
    facts = {
        "stopped": stopped,
        "solver": solver,  # another than the run's own if it took over, if only once
        "seconds": float(table["seconds"].sum()),
        "final_cost": final_cost(judged["cost"]),
    }
    return Records(named.stated, table, judged, facts)


def _solves(step: Step) -> list[Solution]:
    """The different solves of a step."""
    successor = (step.update and step.update.successor) or UNKNOWN
    return list(dict.fromkeys(filter(None, (step.plan, step.solution, successor.solution))))


def _row(step: Step, seconds: float) -> StepRow:
    """One step of training as a row."""
    update = step.update
    successor = (update and update.successor) or UNKNOWN
    first, solves = step.solution or UNSOLVED, _solves(step)
    restarts = sum(solve.restarts for solve in solves)
    status = StepStatus.RESTARTED if restarts else StepStatus.SOLVED
    return StepRow(
        episode=step.episode,
        time=step.time,
        state=step.state,
        action=step.action,
        cost=step.cost,
        value=first.value,
        next_value=successor.value,
        delta=np.nan if update is None or update.delta is None else update.delta,
        features=first.features,
        theta=step.weights.theta,
        w=step.weights.w,
        loss=successor.loss,
        status=StepStatus.FAILED if step.failure else status,
        restarts=restarts,
        violation=max((solve.violation for solve in solves), default=np.nan),
        iterations=sum(solve.iterations for solve in solves),
        solves=len(solves),
        solve_seconds=sum(solve.seconds for solve in solves),
        fit_seconds=successor.seconds,
        seconds=seconds,
    )


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

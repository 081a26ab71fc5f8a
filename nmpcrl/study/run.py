"""`run` carries out an experiment: it trains, judges theta without noise, and keeps records."""

import gc
import time
from collections.abc import Callable
from dataclasses import asdict
from types import SimpleNamespace
from typing import Any

import numpy as np

from nmpcrl.control import Plant
from nmpcrl.learning import Exploration, Learner, Successor, Weights
from nmpcrl.learning.rollout import Persistent, evaluate
from nmpcrl.learning.training import Diverged, Step, absurd, train
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import (
    EvaluationRow,
    Facts,
    Records,
    StepRow,
    StepStatus,
    Stopped,
    Table,
    evaluation_fields,
    final_cost,
    most_evaluations,
    step_fields,
)
from nmpcrl.study.setup import controller_of, prepare, step_size

UNKNOWN = Successor(np.nan)  # of a step that was not bootstrapped
UNSOLVED: Any = SimpleNamespace(  # stands in for a solve that failed or was not asked for
    value=np.nan,
    features=np.nan,
    restarts=0,
    violation=np.nan,  # max(a, nan) is a
    iterations=0,
    seconds=0.0,
)


def run(experiment: Experiment, on_episode: Callable[[int, float], None] | None = None) -> Records:
    """Train and evaluate as `experiment` says; the same experiment gives the same numbers.

    Args:
        experiment: names the run; what its learner does not read is set to its default.
        on_episode: called after each episode with how many are done and the episode's summed cost.
    """
    experiment = experiment.canonical
    controller = controller_of(experiment)
    ready = prepare(experiment, controller)
    gc.freeze()  # the collector need not look through all that was imported, again and again
    try:
        return _run(experiment, controller, *ready, on_episode)
    finally:
        gc.unfreeze()


def _run(
    experiment: Experiment,
    controller: Persistent,
    learner: Learner,
    weights: Weights,
    explore: Exploration,
    on_episode: Callable[[int, float], None] | None,
) -> Records:
    steps, evaluations = _tables(experiment, controller.nmpc.plant)
    evaluations.append(_evaluation(controller, weights, 0, experiment.steps))
    stopped, cost, began = str(Stopped.FINISHED), 0.0, time.perf_counter()
    named = solver = controller.nmpc.solver.name
    try:
        clipped, constrained = experiment.clipped, experiment.values_actions
        for step in train(
            learner, controller, weights, explore, clipped=clipped, constrained=constrained
        ):
            seconds = time.perf_counter() - began
            steps.append(_row(step, seconds))
            cost += step.cost
            solver = next((one for one in _solvers(step) if one != named), solver)
            if step.failure or step.time == experiment.steps - 1:
                done = step.episode + 1
                due = done % experiment.evaluate_every == 0 or done == experiment.episodes
                if due and not absurd(step.weights):
                    row = _evaluation(controller, step.weights, done, experiment.steps)
                    evaluations.append(row)
                if on_episode:
                    on_episode(done, cost)
                cost = 0.0
            began = time.perf_counter()
    except Diverged as error:
        stopped = f"{Stopped.DIVERGED}: {error}"
    table, judged = steps.columns(), evaluations.columns()
    table["alpha_phi2"] = step_size(experiment) * (table["features"] ** 2).sum(axis=1)
    facts: Facts = {
        "stopped": stopped,
        "solver": solver,  # what solved: fatrop where riccati was not to be had, if only once
        "seconds": float(table["seconds"].sum()),
        "final_cost": final_cost(judged["cost"]),
    }
    return Records(asdict(experiment), table, judged, facts)


def _tables(experiment: Experiment, plant: Plant) -> tuple[Table, Table]:
    """Room for `Records.steps` and `Records.evaluations`."""
    n, m, d = plant.n, plant.m, len(experiment.theta)
    return (
        Table(step_fields(n, m, d), experiment.episodes * experiment.steps),
        Table(evaluation_fields(n, m, d, experiment.steps), most_evaluations(experiment)),
    )


def _solvers(step: Step) -> list[str]:
    """What solved the problems of a step."""
    successor = (step.update and step.update.successor) or UNKNOWN
    return [one.solver for one in (step.plan, step.solution, successor.solution) if one]


def _row(step: Step, seconds: float) -> StepRow:
    """One step of training as a row."""
    update = step.update
    successor = (update and update.successor) or UNKNOWN
    first = step.solution or UNSOLVED
    solves = list(dict.fromkeys(filter(None, (step.plan, step.solution, successor.solution))))
    restarts = sum(solve.restarts for solve in solves)
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
        status=StepStatus.of(failed=bool(step.failure), restarts=restarts),
        restarts=restarts,
        violation=max((solve.violation for solve in solves), default=np.nan),
        iterations=sum(solve.iterations for solve in solves),
        solves=len(solves),
        solve_seconds=sum(solve.seconds for solve in solves),
        fit_seconds=successor.seconds,
        seconds=seconds,
    )


def _evaluation(
    controller: Persistent, weights: Weights, episode: int, steps: int
) -> EvaluationRow:
    """The row of `Records.evaluations` for the policy of `weights`."""
    rollout = evaluate(controller, weights.theta, steps)
    missing = ((0, steps - len(rollout.states)), (0, 0))
    states, actions = (
        np.pad(reached, missing, constant_values=np.nan)
        for reached in (rollout.states, rollout.actions)
    )
    return EvaluationRow(episode, weights.theta, rollout.cost, states, actions)

"""Failure modes: why a run went wrong, and how its last rollout ended, from its summary.

A run went wrong if it was stopped or diverged in training (`thresholds.divergence`), or if its
final noise-free cost is above theta_init's by more than `BETTER`. Its cost rose between the last
rollout without noise at or below that border and the first above it; without such a rollout, in its
last episodes. In these some ten episodes the mechanisms are looked for in the order of `Mechanism`,
and the first one found counts, because each can bring about the later ones.

The thresholds were fixed before they were applied to the study, but after a look at the ranges of
these columns in five short runs. They sort runs, and decide no claim.
"""

from collections.abc import Mapping
from enum import StrEnum

import numpy as np
import pandas as pd

from nmpcrl.analysis.metrics import TOUCH
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims.thresholds import BETTER, divergence, was_stopped, worsens
from nmpcrl.control import Task
from nmpcrl.learning.updates import OVERSHOOT
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment, frozen_arm
from nmpcrl.study.layouts import ARRIVED, gaps
from nmpcrl.study.records import Column

OVER_PREDICTED = 0.5  # share of the TD error (root mean square) made by too high predictions
CUT_SHORT = 0.5  # share of episodes in which solves failed; one failed rollout is enough, too


class Mechanism(StrEnum):
    """Why the cost of a run rose, in the order of the search."""

    STEP = "overshoot"
    NETWORK = "network"
    GAP = "gap"  # theta_c grew until no plan fits through a gap that the first rollout went through
    SOLVER = "solver"
    OTHER = "none of these"


class Ending(StrEnum):
    """How a rollout ended."""

    ARRIVED = "arrived"
    STUCK = "stuck"
    OUTSIDE = "left the box"
    HIT = "hit"
    FAILED = "failed"


class Failure(StrEnum):
    """Where a run went wrong; the first of these counts."""

    STOPPED = "stopped"
    TRAINING = "training"
    WITHOUT_NOISE = "without noise"


WELL = "went well"  # in the place of a mechanism
FAILURE_MODE = ["ending", "wrong", "mechanism", "episode"]


def failure_modes(
    summaries: Mapping[Experiment, RunSummary],
    runs: pd.DataFrame,
    every: Mapping[Experiment, RunSummary],
) -> pd.DataFrame:
    """The failure mode of each run, one row a run, in order; empty where theta is frozen.

    Columns ending (of the last rollout: an `Ending`), wrong (a `Failure`, or ""), mechanism (a
    `Mechanism`, or `WELL`) and episode (after which the cost rose; missing for a run that went
    well). `runs` is the `rows.table` of the summaries; `every` includes the `frozen_arm` of each.
    """
    signs = was_stopped(runs), divergence(runs).fillna(False), worsens(runs)
    failures = np.select([one.to_numpy(bool) for one in signs], [*Failure], "").tolist()
    rows = []
    for (e, run), wrong in zip(summaries.items(), failures, strict=True):
        if e.learner == "frozen":
            rows.append(("", "", "", pd.NA))
            continue
        found = mechanism(run, every[frozen_arm(e)].states) if wrong else WELL
        began = rise(run).start if wrong else pd.NA
        rows.append((ending(run.states, e.task), wrong, found, began))
    return pd.DataFrame(rows, columns=FAILURE_MODE)


def rise(run: RunSummary) -> slice:
    """The episodes in which a run's cost rose."""
    episode, cost = run.evaluations["episode"], run.evaluations["cost"]
    above = np.flatnonzero(cost > (1 + BETTER) * cost[0])
    if above.size:
        return slice(int(episode[above[0] - 1]), int(episode[above[0]]))
    reached = int((run.episodes["steps"] > 0).sum())
    return slice(max(0, reached - run.experiment["evaluate_every"]), reached)


def mechanism(run: RunSummary, first_rollout: Column) -> Mechanism:
    """The mechanism by which the cost of a run rose; `first_rollout` has theta_init's states."""
    window, start = rise(run), run.experiment["theta"][-1]
    episodes = {name: column[window] for name, column in run.episodes.items()}
    known = np.isfinite(episodes["bias"]) & np.isfinite(episodes["delta"])  # a network predicts
    bias, delta = (episodes[name][known].sum() for name in ("bias", "delta"))
    reached = np.fmax.reduce(episodes["theta"][:, -1], initial=start)
    before, after = (gaps(run.name.task, first_rollout[:, :2], c) for c in (start, reached))
    judged = run.evaluations["cost"][run.evaluations["episode"] == window.stop]
    failed = episodes["failed"]
    signs = {
        Mechanism.STEP: (episodes["alpha_phi2"] > OVERSHOOT).any(),
        Mechanism.NETWORK: known.any() and paper.GAMMA * bias / delta >= OVER_PREDICTED,
        Mechanism.GAP: any(width > 0 >= after[sides] for sides, width in before.items()),
        Mechanism.SOLVER: np.isinf(judged).any() or (failed.size and failed.mean() >= CUT_SHORT),
        Mechanism.OTHER: True,
    }
    return next(name for name in Mechanism if signs[name])


def ending(states: Column, task: Task) -> Ending:
    """The worst ending of a rollout; states of shape (K + 1, n), nan from a failed solve on."""
    if np.isnan(states).any():
        return Ending.FAILED
    if task.overlap(states).max() > TOUCH:
        return Ending.HIT
    if ((states < task.lower - TOUCH) | (states > task.upper + TOUCH)).any():
        return Ending.OUTSIDE
    return Ending.STUCK if task.distance(states[-1]) > ARRIVED else Ending.ARRIVED

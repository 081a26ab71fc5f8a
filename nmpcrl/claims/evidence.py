"""The runs that a chapter rests on: published ones, or runs trained here."""

from dataclasses import replace
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.analysis.rows import THETA
from nmpcrl.analysis.summaries import fetch_summaries
from nmpcrl.analysis.summary import RunSummary
from nmpcrl.claims.published import Evidence, load
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import design
from nmpcrl.study.experiment import Experiment, frozen_arm
from nmpcrl.study.parameters import one_of
from nmpcrl.study.records import Column, Stopped
from nmpcrl.study.setup import controller_of
from nmpcrl.study.store import Runs


def needed(source: str, **asked: Any) -> tuple[Experiment, ...]:
    """The runs of `design.main_table` to train here, and the run with theta frozen beside each.

    The source is "fresh" for all runs, or "published" for the runs that are not published.
    """
    one_of(("published", "fresh")).check("study", source)
    runs, known = _asked(**asked), load().summaries
    return tuple(e for e in runs if source == "fresh" or e not in known)


def gather(source: str, *, variants: bool = False, **asked: Any) -> Evidence:
    """The runs of a chapter; runs of `needed` are trained if they are not stored.

    With `variants` the published controls and variants are added.
    """
    runs, known = dict.fromkeys(_asked(**asked), design.MAIN_TABLE), load()
    parts = {e: part for e, part in known.variants.items() if part != design.MAIN_TABLE}
    parts = (parts if variants else {}) | runs
    found = known.joined(fetch_summaries(needed(source, **asked)), runs).among(parts)
    return replace(found, runs=found.runs.assign(variant=[*parts.values()]))


def with_inputs(found: Evidence) -> Evidence:
    """The finished runs with the inputs of their last rollouts, solved for from the final theta.

    Published runs lack inputs, and stopped runs have no final policy.
    """
    finished = found.where(found.runs.stopped == Stopped.FINISHED)
    thetas = finished.runs[[*THETA]].to_numpy(float)
    made: dict[Experiment, RunSummary] = {
        e: one if len(one.actions) else replace(one, actions=_inputs(e, theta))
        for (e, one), theta in zip(finished.summaries.items(), thetas, strict=True)
    }
    return replace(finished, summaries=Runs(made))


def _inputs(experiment: Experiment, theta: Vector) -> Column:
    """Inputs of a rollout without noise, shape (K + 1, m); nan after a failed solve."""
    actions = evaluate(controller_of(experiment), theta, experiment.steps).actions
    missing = ((0, experiment.steps - len(actions)), (0, 0))
    return np.pad(actions, missing, constant_values=np.nan)


def _asked(**asked: Any) -> tuple[Experiment, ...]:
    runs = design.main_table(**asked)
    return tuple(dict.fromkeys((*runs, *map(frozen_arm, runs))))

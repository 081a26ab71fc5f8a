"""Worlds that move, change, or are not the model, as a chapter shows them."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.encounters import Encounters
from nmpcrl.analysis.statistics import interquartile_mean
from nmpcrl.analysis.suite import scores
from nmpcrl.report.cited import Count
from nmpcrl.studies import worlds
from nmpcrl.studies.worlds import FAULTS
from nmpcrl.study import paper
from nmpcrl.study.moving import CLEARANCE, Motion, centres

OWN = ("oracle", "ES", "ES+model", "grid")  # policies of a wrong model that are compared
POLICIES = ("init", "ES", "grid", "CMA-ES")
SEES = {"known": "the motion", "extrapolated": "the velocity seen", "frozen": "the place"}


def saved(table: pd.DataFrame) -> pd.DataFrame:
    """The share of theta_init's cost that each policy saves, by fault and layout."""
    found = pd.DataFrame({how: worlds.saved(table, how) for how in OWN})
    return found.reindex(FAULTS, level=0)


def signed(share: float) -> str:
    """A change, such as +0.4%."""
    return f"{share:+.1%}".replace("-", "−")


def deepest(one: Encounters, motions: Sequence[Motion]) -> float:
    """How far inside an obstacle the robot gets at most [m]; 0 if it never does."""
    return float(max(0.0, -nearest(one, motions).min()))


def nearest(one: Encounters, motions: Sequence[Motion]) -> Vector:
    """The distance from the robot to the nearest obstacle at each step, below 0 inside it [m]."""
    states = one.states[: paper.STEPS, :2]
    away = np.linalg.norm(states[:, None] - centres(motions, np.arange(len(states))), axis=2)
    distances: Vector = away.min(axis=1) - CLEARANCE / 2
    return distances


def moving(table: pd.DataFrame) -> pd.DataFrame:
    """By view and policy what is published of obstacles that move, with intervals over scenarios.

    `cost` is over that of theta_init with the motion known, and `saved` a share of theta_init's
    with the same view, both interquartile means; `solved` and `clear` are shares of the scenarios;
    `inside` counts those in which the robot gets into an obstacle with most seeds.

    Args:
        table: of `studies.worlds`.
    """
    there = table[table.part == "moving"]
    costs = worlds.means(table, "moving")
    met = worlds.means(table.assign(met=table.inside > 0), "moving", "met")
    found = {}
    for view, policy in product(SEES, POLICIES):
        arm, initial = f"{view} {policy}", costs[f"{view} init"]
        judged = there[there.arm == arm]
        judged = judged.assign(initial=judged.place.map(initial), episodes=0, over=False)
        row = scores(judged)
        ratio = (costs[arm] / costs["known init"]).dropna()
        found[view, policy] = {
            "cost": interquartile_mean(ratio.to_numpy(), ["all"] * len(ratio)),
            "saved": row["gain"],
            "solved": row["solved"],
            "inside": Count(int((met[arm] > 0.5).sum()), len(met)),
            "clear": row["clear"],
        }
    return pd.DataFrame.from_dict(found, "index")

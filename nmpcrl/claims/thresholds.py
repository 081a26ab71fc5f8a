"""The thresholds of the claims, and the numbers of runs that are compared with them.

The thresholds, and the rule of `rule` by which answers become a verdict, were fixed while the study
was being trained and before any claim was tested on it, and stay as they are. A first study, of two
seeds in layout A, had been seen by then.  # departure P

A run that got stuck, hit an obstacle, failed or left the box answers like any other. Its cost is
infinite where a solve failed or training was stopped.

The manifest of the published data names the commit that fixed them; a test compares `NUMBERS` with
every later state of the code. `decided_since.csv` lists the definitions that came later.
"""

import tomllib
from collections.abc import Mapping
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis import metrics
from nmpcrl.claims import rule
from nmpcrl.claims.rule import CELL
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.records import Column, Records, Stopped
from nmpcrl.study.store import Runs

# A run diverged if it was stopped, or if its training cost over the last 20 episodes has a
# median above this multiple of the frozen arm's under the same noise.
DIVERGED = 1.5
# A run is unstable if it diverged, or if its noise-free cost ranges over more than this share of
# theta_init's in the second half of training.
UNSTABLE = 0.05
# "Half the time" and "the same time": the time of a step over the time of a step of ES.
HALF = (0.4, 0.6)
SAME_TIME = (0.9, 1.1)
# Two policies are the same if their trajectories without noise stay this close [m] and their costs
# differ by at most this share.
SAME_PATH = 0.25
SAME_COST = 0.01
# theta makes the network more accurate if the held-out error falls to this multiple or below.
MORE_ACCURATE = 0.8
# Learning beats the frozen theta if the noise-free cost falls by at least this share.
BETTER = 0.01

# Ranges in which a ratio of times is near the claimed one, and the claim partly reproduced.
NEAR_HALF = (0.0, 1.0)
NEAR_SAME_TIME = (0.8, 1.25)

_PLACES = {  # of each number that was fixed: here, in the rule for shares, and in the metrics
    "DIVERGED UNSTABLE HALF SAME_TIME SAME_PATH SAME_COST MORE_ACCURATE BETTER"
    " NEAR_HALF NEAR_SAME_TIME": globals(),
    "MAJORITY NEARLY_ALL NEARLY_NONE": vars(rule),
    "TOUCH": vars(metrics),
}
NUMBERS = {name: place[name] for names, place in _PLACES.items() for name in names.split()}

TEXTS = tomllib.loads(Path(__file__).with_name("claims.toml").read_text("utf-8"))


def texts(claim: str) -> dict[str, Any]:
    """The name and the texts of a claim, with the numbers of its border."""
    found = {
        name: text if name == "short" else " ".join(text.split())
        for name, text in TEXTS[claim].items()
    }
    border = found.get("border", "").format_map({**globals(), "TOUCH": metrics.TOUCH})
    return found | {"name": claim} | ({"border": border} if border else {})


def fixed(about: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Hash and date (UTC) of two commits: "thresholds" fixed, and first runs "published".

    `about` is a field of `published.load()`. Empty if the manifest has other numbers than the code.
    """
    known = {**about.get("fixed", {})}
    today = {name: list(one) if isinstance(one, tuple) else one for name, one in NUMBERS.items()}
    return known if known.pop("numbers", {}) == today else {}


def decided_since() -> pd.DataFrame:
    """The definitions that came after the thresholds, in order: commit, date, when, what, moved."""
    return pd.read_csv(Path(__file__).with_name("decided_since.csv"), dtype=str)


def was_stopped(runs: pd.DataFrame) -> pd.Series:
    """Whether training was stopped; False for a missing run."""
    return runs.stopped.notna() & (runs.stopped != Stopped.FINISHED)


def training_cost_ratio(runs: pd.DataFrame) -> pd.Series:
    """Training cost over the cost with theta frozen; infinite where the run was stopped."""
    return runs.cost_ratio.mask(was_stopped(runs), np.inf)


def divergence(runs: pd.DataFrame) -> pd.Series:
    """Which runs diverged (see `DIVERGED`); missing without a run with theta frozen."""
    ratio = training_cost_ratio(runs)
    return (ratio > DIVERGED).astype("boolean").where(ratio.notna())


def late_cost_range(runs: pd.DataFrame) -> pd.Series:
    """Range of the noise-free cost over theta_init's; infinite for divergence, nan if unknown."""
    gone = divergence(runs)
    return runs.late_cost_range.mask(gone.fillna(False).astype(bool), np.inf).where(gone.notna())


def instability(runs: pd.DataFrame) -> pd.Series:
    """Which runs are unstable (see `UNSTABLE`); missing where unknown."""
    numbers = late_cost_range(runs)
    return (numbers > UNSTABLE).astype("boolean").where(numbers.notna())


def cost_reduction(runs: pd.DataFrame) -> pd.Series:
    """Share of theta_init's noise-free cost that a run saves; -inf if it failed or was stopped."""
    return (1 - runs.final_cost / runs.initial_cost).mask(was_stopped(runs), -np.inf)


def improves(runs: pd.DataFrame) -> pd.Series:
    """Which runs end at a noise-free cost below theta_init's by at least `BETTER`."""
    return cost_reduction(runs) >= BETTER


def worsens(runs: pd.DataFrame) -> pd.Series:
    """Which runs were stopped, or end at a cost above theta_init's by more than `BETTER`."""
    return was_stopped(runs) | (runs.final_cost > (1 + BETTER) * runs.initial_cost)


def solved(runs: pd.DataFrame) -> pd.Series:
    """Which runs end at the target without noise, at no more than theta_init's cost."""
    return (runs.distance <= ARRIVED) & (cost_reduction(runs) >= 0)


def share_of_possible(runs: pd.DataFrame, possible: Mapping[str, float]) -> pd.Series:
    """The reduction of each run over `possible` in its layout; nan where none is possible."""
    known = runs.layout.map(possible).astype(float)
    return cost_reduction(runs) / known.where(known > 0)


def cost_difference(first: pd.DataFrame, second: pd.DataFrame) -> pd.Series:
    """Final noise-free cost of one arm minus another's, over theta_init's; 0 where both failed."""
    more = (first.final_cost - second.final_cost) / first.initial_cost
    return more.where(first.final_cost != second.final_cost, 0.0)


def path_distance(first: Column, second: Column) -> float:
    """Largest distance [m] of two trajectories at the same time."""
    return float(np.max(np.linalg.norm(first[:, :2] - second[:, :2], axis=1)))


def of_records(runs: Runs[Records]) -> pd.DataFrame:
    """A row a run, for `divergence` and `instability`; `runs` include the learner "frozen"."""
    cell, costs = attrgetter(*CELL), {e: metrics.training_cost(one) for e, one in runs.items()}
    frozen = {cell(e): cost for e, cost in costs.items() if e.learner == "frozen"}
    rows = {
        e: {
            "learner": e.learner,
            "stopped": one.facts["stopped"],
            "cost_ratio": metrics.cost_ratio(costs[e], frozen[cell(e)]),
            "late_cost_range": metrics.late_cost_range(one),
        }
        for e, one in runs.items()
    }
    return pd.DataFrame.from_dict(rows, orient="index")

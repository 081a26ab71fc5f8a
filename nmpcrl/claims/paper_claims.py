"""The paper's claims, one object each: a question, the numbers that answer it, and a border.

The borders are in `thresholds`, and the rule by which answers become a verdict is in `rule`.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from nmpcrl.analysis.metrics import TOUCH
from nmpcrl.analysis.rows import EVAL_INSIDE, INSIDE, THETA, experiment_of
from nmpcrl.claims import thresholds
from nmpcrl.claims.assumptions import TheoremClaim
from nmpcrl.claims.by_runs import AtLeast, AtMost, Contrast, RunClaim, Values
from nmpcrl.claims.rule import Claim, Paths, arms, counted, median
from nmpcrl.claims.thresholds import HALF, NEAR_HALF, NEAR_SAME_TIME, SAME_TIME, texts
from nmpcrl.claims.timing import TimeClaim
from nmpcrl.claims.verdict import NOT, REPRODUCED
from nmpcrl.study.experiment import PAPER
from nmpcrl.study.layouts import ARRIVED

SOLVER = "ipopt"  # the paper's, with which C3 and C4 are judged
TIMED: dict[str, Any] = {
    "solver": SOLVER,
    "measured": f"the processor's time for a step over that for one of ES, with {SOLVER}, the"
    " paper's solver",
    "test": "ratio of the sums over steps taken in turn, with its interval; see `timing`",
}
UP_TO = 60  # borders at which a claim is decided once more

Learners: TypeAlias = tuple[str, ...]
Numbers: TypeAlias = dict[str, Any]


def _contrasted(
    wrong: Callable[[pd.DataFrame], pd.Series], column: str, runs: pd.DataFrame, _: Paths,
    learners: Learners,
) -> Numbers:  # fmt: skip
    """How many runs of each learner went wrong, and the median of a column."""
    found = dict(zip(learners, arms(runs, *learners), strict=True))
    counts = {f"{name}_wrong": counted(wrong(arm))["all"].known for name, arm in found.items()}
    return counts | {f"{name}_median": median(arm[column]) for name, arm in found.items()}


def policy_distances(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """The distance between the policies of RDES and GES, a row a cell.

    Columns path [m] (nan where a rollout failed) and cost (in shares of theta_init's), failed
    (whether RDES's did: two that failed have the same cost and are not the same), and known
    (whether both runs and both paths are known).
    """
    asked = runs[runs.learner.isin(("RDES", "GES"))]
    found = [paths.get(experiment_of(row)) for row in asked.to_dict("records")]
    rdes, ges = arms(asked.assign(path=pd.Series(found, asked.index, object)), "RDES", "GES")
    known = rdes.path.notna() & ges.path.notna()
    pairs = zip(rdes.path[known], ges.path[known], strict=True)
    apart = [thresholds.path_distance(*pair) for pair in pairs]
    return pd.DataFrame(
        {
            "path": pd.Series(apart, rdes.index[known], dtype=float).reindex(rdes.index),
            "cost": thresholds.cost_difference(rdes, ges).abs(),
            "failed": np.isinf(rdes.final_cost),
            "known": known & rdes.stopped.notna() & ges.stopped.notna(),
        }
    )


def _policy_distance(runs: pd.DataFrame, paths: Paths) -> Values:
    """The distance in path or in cost, the larger one, in units of what counts as the same."""
    apart = policy_distances(runs, paths)
    path, cost = apart.path / thresholds.SAME_PATH, apart.cost / thresholds.SAME_COST
    worse = np.maximum(path, cost).fillna(np.inf)
    return worse.mask(apart.failed, np.inf).where(apart.known).to_frame("RDES and GES")


def _c5_numbers(runs: pd.DataFrame, paths: Paths, learners: Learners) -> Numbers:
    """Median distances; of theta, the largest relative difference between two components."""
    apart = policy_distances(runs, paths)
    one, other = (arm[[*THETA]].to_numpy(float) for arm in arms(runs, *learners))
    relative = np.abs(one - other) / np.maximum(np.abs(one), np.abs(other))
    theta = np.max(relative, axis=1, initial=0)
    return {"path": median(apart.path), "cost": median(apart.cost), "theta": median(theta)}


def _c6_numbers(runs: pd.DataFrame, _: Paths, learners: Learners) -> Numbers:
    (rdes,) = arms(runs, *learners, among=PAPER)
    return {"told": median(rdes.imitation_with), "alone": median(rdes.imitation_without)}


def _c7_numbers(runs: pd.DataFrame, _: Paths, learners: Learners) -> Numbers:
    """Violations of the constraints, in training and without noise (`eval_`)."""
    every = pd.concat(arms(runs, *learners), keys=learners, names=["learner"])
    judged = every[[*EVAL_INSIDE]].sum(axis=1).groupby(level="learner", sort=False).sum()
    largest = every[["worst_overlap", "eval_worst_overlap"]].max()
    sums = every[["inputs", "steps_done", "outside", *INSIDE, *EVAL_INSIDE]].sum()
    numbers: Numbers = pd.concat([largest, sums]).to_dict()
    return numbers | {"eval_inside": judged.to_dict()}


def kept_without_noise(runs: pd.DataFrame, learners: Learners) -> pd.DataFrame:
    """The answers of each run to the weaker question of C7, or of W7 with its learners.

    Columns kept (whether its rollouts without noise kept the constraints) and stopped (whether
    training was stopped: then only the rollouts before are asked).
    """
    every = pd.concat(arms(runs, *learners), keys=learners, names=["learner"])
    c7 = replace(BY_RUNS["C7"], learners=learners)
    kept = c7.answers(c7.measure(runs, {}))
    stopped = thresholds.was_stopped(every).reorder_levels(kept.index.names)
    return pd.DataFrame({"kept": kept, "stopped": stopped.reindex(kept.index)})


def _c9_numbers(runs: pd.DataFrame, _: Paths, learners: Learners) -> Numbers:
    every = zip(PAPER, arms(runs, *PAPER), strict=True)
    claimed = pd.concat(arms(runs, *learners))
    return {
        "medians": {name: median(thresholds.cost_reduction(arm)) for name, arm in every},
        "failed": int(np.isinf(claimed.final_cost).sum()),
        "stuck": int((claimed.distance > ARRIVED).sum()),
    }


_CLAIMS: tuple[Claim, ...] = (
    Contrast(
        **texts("C1"),
        learners=("DES", "RDES"),
        number=thresholds.training_cost_ratio,
        threshold=thresholds.DIVERGED,
        wrong="diverged",
        worst="had to be stopped",
        numbers=partial(_contrasted, thresholds.divergence, "cost_ratio"),
        nothing=1.0,
        borders=np.geomspace(1.02, 15, UP_TO),
    ),
    Contrast(
        **texts("C2"),
        learners=("ES", "GES"),
        number=thresholds.late_cost_range,
        threshold=thresholds.UNSTABLE,
        wrong="was unstable",
        worst="diverged",
        numbers=partial(_contrasted, thresholds.instability, "late_cost_range"),
        borders=np.geomspace(0.005, 1.5, UP_TO),
    ),
    TimeClaim(**texts("C3"), learner="RDES", claimed=HALF, near=NEAR_HALF, **TIMED),
    TimeClaim(**texts("C4"), learner="GES", claimed=SAME_TIME, near=NEAR_SAME_TIME, **TIMED),
    AtMost(
        **texts("C5"),
        learners=("RDES", "GES"),
        values=_policy_distance,
        threshold=1.0,
        numbers=_c5_numbers,
        borders=np.geomspace(0.1, 30, UP_TO),
    ),
    AtMost(
        **texts("C6"),
        learners=("RDES",),
        number=lambda rdes: rdes.imitation_with / rdes.imitation_without,
        among=PAPER,
        threshold=thresholds.MORE_ACCURATE,
        numbers=_c6_numbers,
        nothing=1.0,
        borders=np.geomspace(0.3, 1.3, UP_TO),
    ),
    AtMost(
        **texts("C7"),
        threshold=TOUCH,
        borders=np.geomspace(1e-8, 1.0, UP_TO),
        learners=("RDES",),
        number=lambda arm: arm.eval_worst_overlap.clip(lower=0).mask(arm.inputs > 0, np.inf),
        besides=lambda arm: arm[[*INSIDE]].sum(axis=1, skipna=False),
        numbers=_c7_numbers,
    ),
    TheoremClaim(
        **texts("C8"),
        words={REPRODUCED: "the guarantee applies", NOT: "the guarantee does not apply"},
    ),
    AtLeast(
        **texts("C9"),
        implied=True,
        threshold=thresholds.BETTER,
        borders=np.linspace(-0.05, 0.15, UP_TO),
        learners=("RDES", "GES"),
        number=thresholds.cost_reduction,
        numbers=_c9_numbers,
    ),
)
CLAIMS = {claim.name: claim for claim in _CLAIMS}
BY_RUNS = {name: claim for name, claim in CLAIMS.items() if isinstance(claim, RunClaim)}
BY_TIME = {name: claim for name, claim in CLAIMS.items() if isinstance(claim, TimeClaim)}

# Wider questions than the paper's: C7 and C9, which name some of its learners, asked of all four.
# Measure, threshold and rule are the claim's; the name is another.
WIDER_THAN = {"W7": "C7", "W9": "C9"}
WIDER_CLAIMS: dict[str, RunClaim] = {
    wider: replace(BY_RUNS[claim], **texts(wider), implied=False, learners=PAPER)
    for wider, claim in WIDER_THAN.items()
}

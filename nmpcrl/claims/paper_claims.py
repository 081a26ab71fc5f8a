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
from nmpcrl.claims.thresholds import HALF, NEAR_HALF, NEAR_SAME_TIME, SAME_TIME
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
        name="C1",
        statement="DES diverges within 300 episodes; RDES does not.",
        short="DES diverges,\nRDES does not",
        quotation="“shows divergent RL performance”, of DES; “with the learning process remaining"
        " stable throughout training episodes”, of RDES (Section IV-B)",
        question="Did DES diverge, and RDES with the same layout, decay and seed not?",
        measured="whether the run was stopped; median training cost of the last 20 episodes over"
        " that of the baseline without learning under the same noise",
        border=f"diverged: stopped, or above {thresholds.DIVERGED}",
        would_change="Other layouts and the untold details of the network; Algorithm 1 read"
        " literally (our assumption G).",
        learners=("DES", "RDES"),
        number=thresholds.training_cost_ratio,
        threshold=thresholds.DIVERGED,
        wrong="diverged",
        worst="had to be stopped",
        numbers=partial(_contrasted, thresholds.divergence, "cost_ratio"),
        nothing=1.0,
        label="training cost / baseline's",
        borders=np.geomspace(1.02, 15, UP_TO),
    ),
    Contrast(
        name="C2",
        statement="ES is unstable; GES is stable.",
        short="ES is unstable,\nGES is not",
        quotation="“an unstable learning process as training episodes progress”, of ES; “stable RL"
        " performance”, of GES (Section IV-B)",
        question="Was ES unstable, and GES with the same layout, decay and seed not?",
        measured="as C1; range of the noise-free cost in the second half of training, as a share"
        " of theta_init's",
        border=f"unstable: diverged, or above {thresholds.UNSTABLE:.0%}",
        would_change="A larger step size: alpha ||phi||^2 decides where a semi-gradient step"
        " overshoots.",
        learners=("ES", "GES"),
        number=thresholds.late_cost_range,
        threshold=thresholds.UNSTABLE,
        wrong="was unstable",
        worst="diverged",
        numbers=partial(_contrasted, thresholds.instability, "late_cost_range"),
        label="range of noise-free cost",
        borders=np.geomspace(0.005, 1.5, UP_TO),
    ),
    TimeClaim(
        name="C3",
        statement="RDES takes half of the time of ES.",
        quotation="“our RDES method completes the training episodes in half the time required for"
        " both the method from [ES] and our GES method” (Section IV-B)",
        question="How long does a step of RDES take, in steps of ES?",
        border=f"{HALF[0]} to {HALF[1]}; partly below {NEAR_HALF[1]:g}",
        would_change="The time of one solve: the slower the solver, the closer to one half. And"
        " where a solve starts: ES has already solved in the next state and starts its next step"
        " from there.",
        learner="RDES",
        claimed=HALF,
        near=NEAR_HALF,
        work="one solve instead of two, and a fit of the network",
        **TIMED,
    ),
    TimeClaim(
        name="C4",
        statement="GES takes the time of ES.",
        quotation="“≈ 18” hours, for ES and for GES (Table II)",
        question="How long does a step of GES take, in steps of ES?",
        border=f"{SAME_TIME[0]} to {SAME_TIME[1]}; partly from {NEAR_SAME_TIME[0]} to"
        f" {NEAR_SAME_TIME[1]}",
        would_change="Nothing that we know of: the work is the same.",
        learner="GES",
        claimed=SAME_TIME,
        near=NEAR_SAME_TIME,
        work="both solve twice",
        **TIMED,
    ),
    AtMost(
        name="C5",
        statement="RDES and GES reach the same policy.",
        short="RDES and GES:\nsame policy",
        quotation="“both methods achieve the same optimal policy” (Section V)",
        question="Did RDES and GES with the same layout, decay and seed end in the same policy?",
        measured="largest distance of their trajectories without noise; difference of the final"
        " noise-free costs, as a share of theta_init's (theta itself is compared, but not judged:"
        " two of them may act alike)",
        border=f"at most {thresholds.SAME_PATH} m and at most {thresholds.SAME_COST:.0%}",
        would_change="A looser meaning of 'same', and longer training.",
        learners=("RDES", "GES"),
        values=_policy_distance,
        threshold=1.0,
        numbers=_c5_numbers,
        label="apart / what counts as the same",
        borders=np.geomspace(0.1, 30, UP_TO),
    ),
    AtMost(
        name="C6",
        statement="theta as an input makes the network more accurate.",
        short="θ helps the\nnetwork",
        quotation="“by adding the parameter vector $\\boldsymbol{\\theta}$ to the training data,"
        " the NN gains more knowledge about the behavior of the primary NMPC” (Section III-A)",
        question="Fitted to the same run of RDES, does the network that has theta as an input err"
        " less?",
        measured="root mean square errors on held-out pairs of state and theta, with over without",
        border=f"at most {thresholds.MORE_ACCURATE}",
        would_change="How far theta moves: where it hardly does, the network gains nothing from"
        " it.",
        learners=("RDES",),
        number=lambda rdes: rdes.imitation_with / rdes.imitation_without,
        among=PAPER,
        threshold=thresholds.MORE_ACCURATE,
        numbers=_c6_numbers,
        unit="runs",
        nothing=1.0,
        label="error with θ / without",
        borders=np.geomspace(0.3, 1.3, UP_TO),
    ),
    AtMost(
        name="C7",
        statement="With RDES, input and obstacle constraints hold throughout.",
        short="constraints\nhold",
        question="Did every action stay in its bounds and every state out of the obstacles, in"
        " training and without noise? The weaker question: without noise?",
        measured="actions out of bounds; states in an obstacle, by the size of Xi",
        border=f"none beyond {TOUCH:g}; partly if only the weaker question is not refuted",
        would_change="The obstacle constraint is soft, and noise is added after it was enforced.",
        quotation="“even when replacing the subsequent action-value function by the NN"
        " approximator, the constraint satisfaction is always maintained since the policy is"
        " derived from the OCP scheme” (Section III-A)",
        threshold=TOUCH,
        unit="runs",
        label="largest Ξ without noise",
        linear_to=TOUCH,
        borders=np.geomspace(1e-8, 1.0, UP_TO),
        learners=("RDES",),
        number=lambda arm: arm.eval_worst_overlap.clip(lower=0).mask(arm.inputs > 0, np.inf),
        besides=lambda arm: arm[[*INSIDE]].sum(axis=1, skipna=False),
        numbers=_c7_numbers,
    ),
    TheoremClaim(
        name="C8",
        statement="Convergence of GES is guaranteed.",
        quotation="“Under some assumptions […] on the positive step sizes […], it follows that"
        " $\\boldsymbol{\\theta}$ converges almost surely to a stable equilibrium point” (Section"
        " III-B), of GES",
        question="Does what is run meet the assumptions of a theorem that is cited for it?",
        measured="each assumption beside the code, with a measurement where one is possible",
        border="all of one theorem's",
        test="of each theorem, one assumption that does not hold is enough",
        words={REPRODUCED: "the guarantee applies", NOT: "the guarantee does not apply"},
        would_change="Decaying step sizes, w faster than theta, the curvature term and a"
        " projection would bring it closer.",
    ),
    AtLeast(
        name="C9",
        statement="Learning with RDES and GES lowers the cost without noise.",
        short="RDES and GES\nbeat $\\theta_\\mathrm{init}$",
        question="Does the run of RDES, or of GES, end with a lower noise-free cost than"
        " theta_init's?",
        measured="share of theta_init's noise-free cost that the last three rollouts save",
        border=f"at least {thresholds.BETTER:.0%}",
        would_change="The layout, and theta_c: near d_o it removes the penalty altogether"
        " (our assumption N).",
        quotation="“an RL algorithm can advantageously adjust the parameters of the NMPC […] to"
        " enhance closed-loop performance” (Section II-B); no figure shows the performance without"
        " learning",
        implied=True,
        threshold=thresholds.BETTER,
        unit="runs",
        label="fall of noise-free cost",
        linear_to=0.1,
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
WIDER_CLAIMS: dict[str, RunClaim] = {
    "W7": replace(
        BY_RUNS["C7"],
        name="W7",
        statement="With all four learners, input and obstacle constraints hold throughout.",
        quotation="",
        learners=PAPER,
    ),
    "W9": replace(
        BY_RUNS["C9"],
        name="W9",
        statement="Learning with any of the four learners lowers the cost without noise.",
        question="Does the run of one of the four learners end with a lower noise-free cost than"
        " theta_init's?",
        short="all four\nbeat $\\theta_\\mathrm{init}$",
        quotation="",
        implied=False,
        learners=PAPER,
    ),
}
WIDER_THAN = {"W7": "C7", "W9": "C9"}

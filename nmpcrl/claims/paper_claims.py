"""The paper's claims, one object each: a question, numbers, a border and the sentences about them.

Where a border lies is said in `thresholds`, and how the answers of many runs become a verdict in
`rule`.
"""

from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.metrics import TOUCH
from nmpcrl.analysis.rows import THETA, experiment_of
from nmpcrl.analysis.summary import SIZES
from nmpcrl.claims.assumptions import TheoremClaim
from nmpcrl.claims.by_runs import AtLeast, AtMost, Contrast, RunClaim, Values, beside
from nmpcrl.claims.rule import CELL, Assumption, Claim, Observations, Paths, arms, median, shown
from nmpcrl.claims.thresholds import (
    BETTER,
    DIVERGED,
    HALF,
    MORE_ACCURATE,
    NEAR_HALF,
    NEAR_SAME_TIME,
    SAME_COST,
    SAME_PATH,
    SAME_TIME,
    UNSTABLE,
    cost_difference,
    cost_reduction,
    divergence,
    instability,
    late_cost_range,
    path_distance,
    training_cost_ratio,
    was_stopped,
)
from nmpcrl.claims.timing import TimeClaim
from nmpcrl.claims.verdict import NOT, REPRODUCED, Verdict
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


# C1, from Fig. 1


def _cost_ratios(runs: pd.DataFrame, _: Paths) -> Values:
    return beside(runs, ("DES", "RDES"), training_cost_ratio)


def _c1_evidence(runs: pd.DataFrame, _: Paths) -> str:
    des, rdes = arms(runs, "DES", "RDES")
    ratio = [shown(median(arm.cost_ratio), ".2f") for arm in (des, rdes)]
    return (
        f"{_of(divergence(des))} runs of DES and {_of(divergence(rdes))} of RDES diverged; their"
        f" training cost ended at {ratio[0]} and {ratio[1]} times the frozen arm's (medians; an"
        " episode that a failed solve cut short counts as ∞)."
    )


# C2, from Fig. 2


def _late_cost_ranges(runs: pd.DataFrame, _: Paths) -> Values:
    return beside(runs, ("ES", "GES"), late_cost_range)


def _c2_evidence(runs: pd.DataFrame, _: Paths) -> str:
    es, ges = arms(runs, "ES", "GES")
    ranges = [shown(median(arm.late_cost_range), ".1%") for arm in (es, ges)]
    return (
        f"{_of(instability(es))} runs of ES and {_of(instability(ges))} of GES were unstable; in"
        f" the second half the noise-free cost ranged over {ranges[0]} and {ranges[1]} (medians)."
    )


# C5, from Figs. 3 and 4 and the conclusion


def policy_distances(runs: pd.DataFrame, paths: Paths) -> pd.DataFrame:
    """How far the policies of RDES and GES are apart, a row a cell.

    Returns:
        Columns path [m] (nan where a rollout failed) and cost (in shares of theta_init's), failed
        (whether RDES's did: two that failed have the same cost and are not the same), and known
        (whether both runs and both paths are there).
    """
    rdes, ges = arms(runs, "RDES", "GES")
    wanted = runs[runs.learner.isin(("RDES", "GES"))].to_dict("records")
    found = {
        (row["learner"], *(row[name] for name in CELL)): paths.get(experiment_of(row))
        for row in wanted
    }
    pairs = [(found.get(("RDES", *cell)), found.get(("GES", *cell))) for cell in rdes.index]
    there = np.array([one is not None and other is not None for one, other in pairs], bool)
    return pd.DataFrame(
        {
            "path": pd.Series([path_distance(*pair) for pair in pairs], rdes.index, dtype=float),
            "cost": cost_difference(rdes, ges).abs(),
            "failed": np.isinf(rdes.final_cost),
            "known": there & rdes.stopped.notna() & ges.stopped.notna(),
        }
    )


def _policy_distance(runs: pd.DataFrame, paths: Paths) -> Values:
    """The distance in path or in cost, whichever is more, in units of what counts as the same."""
    apart = policy_distances(runs, paths)
    worse = np.maximum(apart.path / SAME_PATH, apart.cost / SAME_COST).fillna(np.inf)
    return worse.mask(apart.failed, np.inf).where(apart.known).to_frame("RDES and GES")


def _c5_evidence(runs: pd.DataFrame, paths: Paths) -> str:
    apart, thetas = policy_distances(runs, paths), arms(runs, "RDES", "GES")
    return (
        f"The trajectories come to be {shown(median(apart.path), '.2f')} m apart, the noise-free"
        f" costs differ by {shown(median(apart.cost), '.1%')} and the components of theta by up to"
        f" {shown(median(_theta_distances(*thetas)), '.0%')} (medians)."
    )


def _theta_distances(first: pd.DataFrame, second: pd.DataFrame) -> Vector:
    """Largest relative difference between the components of two final thetas, one a pair."""
    one, other = (arm[[*THETA]].to_numpy(float) for arm in (first, second))
    relative = np.abs(one - other) / np.maximum(np.abs(one), np.abs(other))
    result: Vector = np.max(relative, axis=1, initial=0)
    return result


# C6, from Section III-A


def _relative_error(runs: pd.DataFrame, _: Paths) -> Values:
    """Held-out error of the network that has theta as an input over that of the one without."""
    return beside(
        runs, ("RDES",), lambda arm: arm.imitation_with / arm.imitation_without, among=PAPER
    )


def _c6_evidence(runs: pd.DataFrame, _: Paths) -> str:
    (rdes,) = arms(runs, "RDES", among=PAPER)
    return (
        f"On held-out pairs the error is {shown(median(rdes.imitation_with), '.1f')} with theta and"
        f" {shown(median(rdes.imitation_without), '.1f')} without (medians of the root mean square,"
        " in units of cost)."
    )


# C7, from Section III-A and the conclusion


def constraints_held(learners: tuple[str, ...]) -> dict[str, Any]:
    """The fields of a claim that the constraints hold with some learners."""
    return {
        "learners": learners,
        "measure": partial(_largest_overlap, learners),
        "besides": partial(_states_inside, learners),
        "evidence": partial(_c7_evidence, learners),
        "each": partial(_c7_each, learners),
    }


def _largest_overlap(learners: tuple[str, ...], runs: pd.DataFrame, _: Paths) -> Values:
    """Largest Xi without noise, 0 if none was above; infinite for an input out of bounds."""
    return beside(
        runs,
        learners,
        lambda arm: arm.eval_worst_overlap.clip(lower=0).mask(arm.inputs > 0, np.inf),
    )


def _states_inside(learners: tuple[str, ...], runs: pd.DataFrame, _: Paths) -> Values:
    """How many states in training lay in an obstacle."""
    return beside(runs, learners, lambda arm: _inside(arm, "inside").sum(axis=1, skipna=False))


def _c7_evidence(learners: tuple[str, ...], runs: pd.DataFrame, paths: Paths) -> str:
    every = pd.concat(arms(runs, *learners), keys=learners, names=["learner"])
    training, judged = (_inside(every, name) for name in ("inside", "eval_inside"))
    worst = [shown(every[c].max(), ".3f") for c in ("worst_overlap", "eval_worst_overlap")]
    kept = BY_RUNS["C7"].answers(_largest_overlap(learners, runs, paths))
    by_learner = judged.sum(axis=1).groupby(level="learner", sort=False).sum()
    listed = ", ".join(f"{name} {states:.0f}" for name, states in by_learner.items())
    return (
        f"{every.inputs.sum():.0f} actions left their bounds. Of {every.steps_done.sum():.0f}"
        f" states in training, {_sized(training)} lay in an obstacle by a small, a medium and a"
        f" large Xi (up to 0.01, up to 0.1, and above; the largest is {worst[0]}), and of those"
        f" without noise {_sized(judged)} (the largest is {worst[1]}; by learner: {listed})."
        f" {every.outside.sum():.0f} states in training lay outside the box. Without noise,"
        f" {_of(kept)} runs kept the constraints."
    )


def _c7_each(learners: tuple[str, ...], runs: pd.DataFrame, paths: Paths) -> str:
    kept = BY_RUNS["C7"].answers(_largest_overlap(learners, runs, paths))
    every = pd.concat(arms(runs, *learners), keys=learners, names=["learner"])
    states = _inside(every, "eval_inside").sum(axis=1).groupby(level="learner", sort=False).sum()
    inside = ", ".join(f"{count:.0f} of {name}" for name, count in states.items())
    return (
        f"Without noise, the constraints held in {_by_learner(kept)}; states in an obstacle:"
        f" {inside}."
    )


def kept_without_noise(runs: pd.DataFrame, learners: tuple[str, ...]) -> pd.DataFrame:
    """The runs that C7's weaker question is put to, or that of the wider claim, by learner.

    Args:
        runs: of `rows.table`.
        learners: of whom the claim speaks.

    Returns:
        Columns kept (whether its rollouts without noise kept the constraints) and stopped (whether
        training had to be stopped: then only the rollouts up to there are asked).
    """
    every = pd.concat(arms(runs, *learners), keys=learners, names=["learner"])
    kept = BY_RUNS["C7"].answers(_largest_overlap(learners, runs, {})).dropna().astype(bool)
    stopped = was_stopped(every).reorder_levels(kept.index.names)
    return pd.DataFrame({"kept": kept, "stopped": stopped.reindex(kept.index)})


def _by_learner(answers: pd.Series) -> str:
    """In how many runs of each learner the answer is yes."""
    groups = answers.groupby(level="learner", sort=False)
    return ", ".join(f"{_of(group)} runs of {name}" for name, group in groups) or "no run"


def _inside(runs: pd.DataFrame, name: str) -> pd.DataFrame:
    """How many states lay in an obstacle, one column a size."""
    return runs[[f"{name}_{size}" for size in SIZES]]


def _sized(inside: pd.DataFrame) -> str:
    first, second, third = (f"{count:.0f}" for count in inside.sum())
    return f"{first}, {second} and {third}"


# C9, what the paper takes for granted


def cost_reduced(learners: tuple[str, ...]) -> dict[str, Any]:
    """The fields of a claim that some learners reduce the cost."""
    return {
        "learners": learners,
        "measure": partial(_cost_reductions, learners),
        "evidence": partial(_c9_evidence, learners),
        "each": partial(_c9_each, learners),
    }


def _cost_reductions(learners: tuple[str, ...], runs: pd.DataFrame, _: Paths) -> Values:
    return beside(runs, learners, cost_reduction)


def _c9_evidence(learners: tuple[str, ...], runs: pd.DataFrame, _: Paths) -> str:
    every = dict(zip(PAPER, arms(runs, *PAPER), strict=True))
    medians = {name: shown(median(cost_reduction(arm)), "+.1%") for name, arm in every.items()}
    claimed = pd.concat(arms(runs, *learners))
    failed = int(np.isinf(claimed.final_cost).sum())
    stuck = int((claimed.distance > ARRIVED).sum())
    listed = ", ".join(f"{name} {value}" for name, value in medians.items())
    named = f"{', '.join(learners[:-1])} and {learners[-1]}"
    return (
        f"Median reduction of the noise-free cost: {listed}. Of the last rollouts of {named},"
        f" {stuck} end more than {ARRIVED} away from the target, and in {failed} runs one of the"
        " last three failed or training was stopped; they count."
    )


def _c9_each(learners: tuple[str, ...], runs: pd.DataFrame, paths: Paths) -> str:
    better = BY_RUNS["C9"].answers(_cost_reductions(learners, runs, paths))
    return f"It holds in {_by_learner(better)}."


def _of(holds: pd.Series) -> str:
    known = holds.dropna()
    return f"{int(known.sum())} of {len(known)}"


CLAIMS: dict[str, Claim] = {
    claim.name: claim
    for claim in (
        Contrast(
            name="C1",
            statement="DES diverges within 300 episodes; RDES does not.",
            short="DES diverges,\nRDES does not",
            quotation="“shows divergent RL performance”, of DES; “with the learning process"
            " remaining stable throughout training episodes”, of RDES (Section IV-B)",
            question="Did DES diverge, and RDES with the same layout, decay and seed not?",
            measured="whether the run was stopped; median training cost of the last 20 episodes"
            " over that of the frozen arm under the same noise",
            border=f"diverged: stopped, or above {DIVERGED}",
            would_change="Other layouts and the untold details of the network; Algorithm 1 read"
            " literally (departure G).",
            learners=("DES", "RDES"),
            measure=_cost_ratios,
            threshold=DIVERGED,
            wrong="diverged",
            worst="had to be stopped",
            evidence=_c1_evidence,
            nothing=1.0,
            label="training cost / frozen arm's",
            borders=np.geomspace(1.02, 15, UP_TO),
        ),
        Contrast(
            name="C2",
            statement="ES is unstable; GES is stable.",
            short="ES is unstable,\nGES is not",
            quotation="“an unstable learning process as training episodes progress”, of ES; “stable"
            " RL performance”, of GES (Section IV-B)",
            question="Was ES unstable, and GES with the same layout, decay and seed not?",
            measured="as C1; range of the noise-free cost in the second half of training, as a"
            " share of theta_init's",
            border=f"unstable: diverged, or above {UNSTABLE:.0%}",
            would_change="A larger step size: alpha ||phi||^2 decides where a semi-gradient step"
            " overshoots.",
            learners=("ES", "GES"),
            measure=_late_cost_ranges,
            threshold=UNSTABLE,
            wrong="was unstable",
            worst="diverged",
            evidence=_c2_evidence,
            label="range of noise-free cost",
            borders=np.geomspace(0.005, 1.5, UP_TO),
        ),
        TimeClaim(
            name="C3",
            statement="RDES takes half of the time of ES.",
            quotation="“our RDES method completes the training episodes in half the time required"
            " for both the method from [ES] and our GES method” (Section IV-B)",
            question="How long does a step of RDES take, in steps of ES?",
            border=f"{HALF[0]} to {HALF[1]}; partly below {NEAR_HALF[1]:g}",
            would_change="The time of one solve: the slower the solver, the closer to one half. And"
            " where a solve starts: ES has already solved in the next state and starts its next"
            " step from there.",
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
            question="Did RDES and GES with the same layout, decay and seed end in the same"
            " policy?",
            measured="largest distance of their trajectories without noise; difference of the final"
            " noise-free costs, as a share of theta_init's (theta itself is compared, but not"
            " judged: two of them may act alike)",
            border=f"at most {SAME_PATH} m and at most {SAME_COST:.0%}",
            would_change="A looser meaning of 'same', and longer training.",
            learners=("RDES", "GES"),
            measure=_policy_distance,
            threshold=1.0,
            evidence=_c5_evidence,
            label="apart / what counts as the same",
            borders=np.geomspace(0.1, 30, UP_TO),
        ),
        AtMost(
            name="C6",
            statement="theta as an input makes the network more accurate.",
            short="θ helps the\nnetwork",
            quotation="“by adding the parameter vector $\\boldsymbol{\\theta}$ to the training"
            " data, the NN gains more knowledge about the behavior of the primary NMPC”"
            " (Section III-A)",
            question="Fitted to the same run of RDES, does the network that has theta as an input"
            " err less?",
            measured="root mean square errors on held-out pairs of state and theta, with over"
            " without",
            border=f"at most {MORE_ACCURATE}",
            would_change="How far theta moves: where it hardly does, the network gains nothing from"
            " it.",
            learners=("RDES",),
            measure=_relative_error,
            threshold=MORE_ACCURATE,
            evidence=_c6_evidence,
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
            would_change="The obstacle constraint is soft, and noise is added after it was"
            " enforced.",
            quotation="“even when replacing the subsequent action-value function by the NN"
            " approximator, the constraint satisfaction is always maintained since the policy is"
            " derived from the OCP scheme” (Section III-A)",
            threshold=TOUCH,
            unit="runs",
            label="largest Ξ without noise",
            linear_to=TOUCH,
            borders=np.geomspace(1e-8, 1.0, UP_TO),
            **constraints_held(("RDES",)),
        ),
        TheoremClaim(
            name="C8",
            statement="Convergence of GES is guaranteed.",
            quotation="“Under some assumptions […] on the positive step sizes […], it follows that"
            " $\\boldsymbol{\\theta}$ converges almost surely to a stable equilibrium"
            " point” (Section III-B), of GES",
            question="Does what is run meet the assumptions of a theorem that is cited for it?",
            measured="each assumption beside the code, with a measurement where one is possible",
            border="all of one theorem's",
            test="of each theorem, one assumption that does not hold is enough",
            words={
                REPRODUCED: "the guarantee applies",
                NOT: "the guarantee does not apply",
            },
            would_change="Decaying step sizes, w faster than theta, the curvature term and a"
            " projection would bring it closer.",
        ),
        AtLeast(
            name="C9",
            statement="Learning with RDES and GES beats theta_init without noise, which the paper"
            " takes for granted.",
            short="RDES and GES\nbeat $\\theta_\\mathrm{init}$",
            question="Does the run of RDES, or of GES, end with a lower noise-free cost than"
            " theta_init's?",
            measured="share of theta_init's noise-free cost that the last three rollouts save",
            border=f"at least {BETTER:.0%}",
            would_change="The layout, and theta_c: near d_o it removes the penalty altogether"
            " (departure N).",
            quotation="“an RL algorithm can advantageously adjust the parameters of the NMPC […] to"
            " enhance closed-loop performance” (Section II-B); no figure shows the performance"
            " without learning",
            implied=True,
            threshold=BETTER,
            unit="runs",
            label="fall of noise-free cost",
            linear_to=0.1,
            borders=np.linspace(-0.05, 0.15, UP_TO),
            **cost_reduced(("RDES", "GES")),
        ),
    )
}
BY_RUNS = {name: claim for name, claim in CLAIMS.items() if isinstance(claim, RunClaim)}
BY_TIME = {name: claim for name, claim in CLAIMS.items() if isinstance(claim, TimeClaim)}


def judge(
    runs: pd.DataFrame,
    *,
    paths: Paths,
    timings: pd.DataFrame,
    assumptions: Iterable[Assumption],
) -> tuple[Verdict, ...]:
    """Every claim of the paper, in order.

    Args:
        runs: of `rows.table`, all of one setting; a missing learner leaves its claims undecided.
        paths: states of the last rollout without noise; only those of RDES and GES are read.
        timings: of `time_learners`; what is not in it is not decided.
        assumptions: of `audit`.

    Raises:
        ValueError: the runs are of several settings.
    """
    observed = Observations(runs, paths, timings, tuple(assumptions))
    return tuple(claim.judge(observed) for claim in CLAIMS.values())


def judge_times(timings: pd.DataFrame) -> tuple[Verdict, ...]:
    """The claims that times alone decide, as `judge` has them."""
    return tuple(claim.judge(Observations(timings=timings)) for claim in BY_TIME.values())


def judge_runs(runs: pd.DataFrame, paths: Paths) -> tuple[Verdict, ...]:
    """The claims that the runs alone decide, as `judge` has them."""
    observed = Observations(runs, paths)
    return tuple(claim.judge(observed) for claim in BY_RUNS.values())

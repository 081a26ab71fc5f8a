"""The paper's claims, one function each: a question, a measure, a threshold and a verdict.

The thresholds below, and the rule in `verdicts` by which the answers of many runs become a verdict,
were fixed while the study was being trained and before any claim was put to it, and are
not to be moved after. A first study, of two seeds in layout A, had been seen by then.
# departure P

A run that got stuck, hit an obstacle, failed or left the box answers like any other: its cost is
what it is, and infinite where a solve failed or training had to be stopped.
"""

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis import metrics
from nmpcrl.bench.learners import ratio
from nmpcrl.claims.assumptions import Assumption
from nmpcrl.claims.rule import (
    CELL,
    NOT,
    PARTLY,
    REPRODUCED,
    UNDECIDABLE,
    Claim,
    Verdict,
    answered,
    arms,
    median,
    settle,
    shown,
)
from nmpcrl.study import paper
from nmpcrl.study.experiment import PAPER, Experiment
from nmpcrl.study.layouts import ARRIVED
from nmpcrl.study.records import Column, Records
from nmpcrl.study.store import Runs

# A run diverged if it had to be stopped, or if its training cost over the last 20 episodes has a
# median above this multiple of the frozen arm's under the same noise.
DIVERGED = 1.5
# A run is unstable if it diverged, or if its noise-free cost ranges over more than this share of
# theta_init's in the second half of training.
UNSTABLE = 0.05
# "Half the time" and "the same time": the ratio of the time of a step to that of ES.
HALF = (0.4, 0.6)
SAME_TIME = (0.9, 1.1)
# Two policies are the same if two robots driven side by side stay this close [m] and the
# noise-free costs differ by at most this share.
SAME_PATH = 0.25
SAME_COST = 0.01
# theta makes the network more accurate if the held-out error falls to this multiple or below.
MORE_ACCURATE = 0.8
# Learning beats the frozen theta if the noise-free cost falls by at least this share.
BETTER = 0.01

# A ratio of times is near what is claimed, and the claim partly reproduced, within these.
NEAR_HALF = (0.0, 1.0)
NEAR_SAME_TIME = (0.8, 1.25)

SOLVER = "ipopt"  # the paper's, with which C3 and C4 are judged
SIZES = ("small", "medium", "large")  # of an overlap: up to 0.01, to 0.1, and above
RATIO = "one ratio of medians, taken in turn in one process; no interval"

NAMES = ("learner", *CELL, "episodes")  # of a row: without them it names no run

Paths = Mapping[Experiment, Column]  # the states of each run's last rollout without noise

CLAIMS = {
    claim.name: claim
    for claim in (
        Claim(
            "C1",
            "DES diverges within 300 episodes; RDES does not.",
            "Did DES diverge, and RDES with the same layout, decay and seed not?",
            "whether the run was stopped; median training cost of the last 20 episodes over that of"
            " the frozen arm under the same noise",
            f"diverged: stopped, or above {DIVERGED}",
            would_change="Other layouts and the untold details of the network; Algorithm 1 read"
            " literally (departure G).",
            learners=("DES", "RDES"),
        ),
        Claim(
            "C2",
            "ES is unstable; GES is stable.",
            "Was ES unstable, and GES with the same layout, decay and seed not?",
            "as C1; range of the noise-free cost in the second half of training, as a share of"
            " theta_init's",
            f"unstable: diverged, or above {UNSTABLE:.0%}",
            would_change="A larger step size: alpha ||phi||^2 decides where a semi-gradient step"
            " overshoots.",
            learners=("ES", "GES"),
        ),
        Claim(
            "C3",
            "RDES takes half of the time of ES.",
            "How long does a step of RDES take, in steps of ES?",
            f"ratio of the median times of a step, with {SOLVER}, the paper's solver",
            f"{HALF[0]} to {HALF[1]}; partly below {NEAR_HALF[1]:g}",
            RATIO,
            "The time of one solve: the slower the solver, the closer to one half. And where a"
            " solve starts: ES has already solved in the next state and starts its next step from"
            " there.",
        ),
        Claim(
            "C4",
            "GES takes the time of ES.",
            "How long does a step of GES take, in steps of ES?",
            f"ratio of the median times of a step, with {SOLVER}, the paper's solver",
            f"{SAME_TIME[0]} to {SAME_TIME[1]}; partly from {NEAR_SAME_TIME[0]} to"
            f" {NEAR_SAME_TIME[1]}",
            RATIO,
            "Nothing that we know of: the work is the same.",
        ),
        Claim(
            "C5",
            "RDES and GES reach the same policy.",
            "Did RDES and GES with the same layout, decay and seed end in the same policy?",
            "largest distance of two robots that drive side by side without noise; difference of"
            " the final noise-free costs, as a share of theta_init's (theta itself is compared, but"
            " not judged: two of them may drive alike)",
            f"at most {SAME_PATH} m and at most {SAME_COST:.0%}",
            would_change="A looser meaning of 'same', and longer training.",
            learners=("RDES", "GES"),
        ),
        Claim(
            "C6",
            "theta as an input makes the network more accurate.",
            "Fitted to the same run of RDES, does the network that is told theta err less?",
            "root mean square errors on held-out pairs of state and theta, with over without",
            f"at most {MORE_ACCURATE}",
            would_change="How far theta moves: where it hardly does, there is nothing to tell the"
            " network.",
            learners=("RDES",),
        ),
        Claim(
            "C7",
            "Input and obstacle constraints hold throughout.",
            "Did every action stay in its bounds and every state out of the obstacles, in training"
            " and without noise? The weaker question: without noise?",
            "actions out of bounds; states in an obstacle, by the size of Xi",
            f"none beyond {metrics.TOUCH:g}; partly if only the weaker question is not refuted",
            would_change="The obstacle constraint is soft, and noise is added after it was"
            " enforced.",
            learners=PAPER,
        ),
        Claim(
            "C8",
            "Convergence of GES is guaranteed.",
            "Does what is run meet the assumptions of the theorem?",
            "each assumption beside the code, with a measurement where one is possible",
            "all of them",
            "one assumption that does not hold is enough",
            "Decaying step sizes, w faster than theta, the curvature term and a projection would"
            " bring it closer.",
        ),
        Claim(
            "C9",
            "Learning with RDES and GES beats theta_init without noise.",
            "Does the run of RDES, or of GES, end with a lower noise-free cost than theta_init's?",
            "share of theta_init's noise-free cost that the last three rollouts save",
            f"at least {BETTER:.0%}",
            would_change="The layout, and theta_c: near d_o it removes the penalty altogether"
            " (departure N).",
            learners=("RDES", "GES"),
        ),
    )
}


def judge(
    runs: pd.DataFrame,
    *,
    paths: Paths,
    timings: pd.DataFrame,
    assumptions: Iterable[Assumption],
) -> tuple[Verdict, ...]:
    """Every claim of the paper, in order.

    Args:
        runs: of `summary.table`, all of one setting; a missing learner leaves its claims undecided.
        paths: states of the last rollout without noise; only those of RDES and GES are read.
        timings: of `time_learners`; what is not in it is not decided.
        assumptions: of `audit`.

    Raises:
        ValueError: the runs are of several settings.
    """
    return (
        des_diverges_and_rdes_does_not(runs),
        es_is_unstable_and_ges_is_stable(runs),
        rdes_takes_half_the_time(timings),
        ges_takes_the_same_time(timings),
        rdes_and_ges_reach_the_same_policy(runs, paths),
        theta_makes_the_network_more_accurate(runs),
        constraints_hold(runs),
        convergence_is_guaranteed(tuple(assumptions)),
        learning_beats_the_frozen_theta(runs),
    )


def judge_runs(runs: pd.DataFrame, paths: Paths) -> tuple[Verdict, ...]:
    """The claims that the runs alone decide, as `judge` has them."""
    return tuple(
        verdict
        for verdict in judge(runs, paths=paths, timings=pd.DataFrame(), assumptions=())
        if verdict.claim not in ("C3", "C4", "C8")
    )


def des_diverges_and_rdes_does_not(runs: pd.DataFrame) -> Verdict:
    """C1, from Fig. 1."""
    des, rdes = arms(runs, *CLAIMS["C1"].learners)
    gone, stayed = divergence(des), ~divergence(rdes)
    cost_ratio = [shown(median(arm.cost_ratio), ".2f") for arm in (des, rdes)]
    return settle(
        CLAIMS["C1"],
        answered(gone & stayed, des, rdes),
        f"{_of(gone)} runs of DES and {_of(~stayed)} of RDES diverged; their training cost ended at"
        f" {cost_ratio[0]} and {cost_ratio[1]} times the frozen arm's (medians; an episode that a"
        " failed solve cut short counts as ∞).",
    )


def es_is_unstable_and_ges_is_stable(runs: pd.DataFrame) -> Verdict:
    """C2, from Fig. 2."""
    es, ges = arms(runs, *CLAIMS["C2"].learners)
    swung, stayed = instability(es), ~instability(ges)
    late_cost_range = [shown(median(arm.late_cost_range), ".1%") for arm in (es, ges)]
    return settle(
        CLAIMS["C2"],
        answered(swung & stayed, es, ges),
        f"{_of(swung)} runs of ES and {_of(~stayed)} of GES were unstable; in the second half the"
        f" noise-free cost ranged over {late_cost_range[0]} and {late_cost_range[1]} (medians).",
    )


def rdes_takes_half_the_time(timings: pd.DataFrame) -> Verdict:
    """C3, from Table II, with the paper's solver."""
    ratios = _ratios(timings, "RDES")
    fit = f", plus {median(timings.ms_per_fit):.2f} ms for the network" if ratios else ""
    evidence = f"{_listed('RDES', ratios)}: one solve instead of two{fit}."
    return _timed(CLAIMS["C3"], _within(ratios, HALF, NEAR_HALF), evidence)


def ges_takes_the_same_time(timings: pd.DataFrame) -> Verdict:
    """C4, from Table II."""
    ratios = _ratios(timings, "GES")
    evidence = f"{_listed('GES', ratios)}; all solve twice."
    return _timed(CLAIMS["C4"], _within(ratios, SAME_TIME, NEAR_SAME_TIME), evidence)


def rdes_and_ges_reach_the_same_policy(runs: pd.DataFrame, paths: Paths) -> Verdict:
    """C5, from Figs. 3 and 4 and the conclusion."""
    rdes, ges = arms(runs, *CLAIMS["C5"].learners)
    driven = _driven(runs, paths)
    path = pd.Series(
        [apart(driven.get(("RDES", *cell)), driven.get(("GES", *cell))) for cell in rdes.index],
        rdes.index,
        dtype=float,
    )
    cost = costlier(rdes, ges).abs()
    known = pd.Series([("RDES", *c) in driven and ("GES", *c) in driven for c in rdes.index])
    same = (path <= SAME_PATH) & (cost <= SAME_COST) & np.isfinite(rdes.final_cost)
    return settle(
        CLAIMS["C5"],
        answered(same, rdes, ges).where(known.to_numpy(bool)),
        f"The robots come to be {shown(median(path), '.2f')} m apart, their noise-free costs differ"
        f" by {shown(median(cost), '.1%')} and the components of theta by up to"
        f" {shown(median(_theta_apart(rdes, ges)), '.0%')} (medians).",
    )


def theta_makes_the_network_more_accurate(runs: pd.DataFrame) -> Verdict:
    """C6, from Section III-A."""
    (rdes,) = arms(runs, *CLAIMS["C6"].learners, among=PAPER)
    told = rdes.imitation_with / rdes.imitation_without
    return settle(
        CLAIMS["C6"],
        (told <= MORE_ACCURATE).astype("boolean").where(told.notna()),
        f"On held-out pairs the error is {shown(median(rdes.imitation_with), '.1f')} with theta and"
        f" {shown(median(rdes.imitation_without), '.1f')} without (medians of the root mean square,"
        " in units of cost).",
        unit="runs",
    )


def constraints_hold(runs: pd.DataFrame) -> Verdict:
    """C7, from Section III-A and the conclusion."""
    asked = CLAIMS["C7"].learners
    every = pd.concat(arms(runs, *asked), keys=asked, names=["learner"])
    training, judged = (_inside(every, name) for name in ("inside", "eval_inside"))
    kept = (judged.sum(axis=1) == 0) & (every.inputs == 0)
    whole = kept & (training.sum(axis=1) == 0)
    worst = [shown(every[c].max(), ".3f") for c in ("worst_overlap", "eval_worst_overlap")]
    return settle(
        CLAIMS["C7"],
        answered(whole, every),
        f"{every.inputs.sum():.0f} actions left their bounds. Of {every.steps_done.sum():.0f}"
        f" states in training, {_sized(training)} lay in an obstacle by a small, a medium and a"
        f" large Xi (up to 0.01, up to 0.1, and above; the largest is {worst[0]}), and of those"
        f" driven without noise {_sized(judged)} (the largest is {worst[1]})."
        f" {every.outside.sum():.0f} states in training lay outside the box. Without noise,"
        f" {_of(answered(kept, every))} runs kept the constraints.",
        weaker=answered(kept, every),
        unit="runs",
    )


def convergence_is_guaranteed(assumptions: tuple[Assumption, ...]) -> Verdict:
    """C8, from the title, the abstract and Section III-B."""
    broken = [a.theorem for a in assumptions if not a.holds]
    decided = NOT if broken else REPRODUCED
    listed = f": {'; '.join(broken)}" if broken else ""
    return _timed(
        CLAIMS["C8"],
        decided if assumptions else UNDECIDABLE,
        f"{len(broken)} of the theorem's {len(assumptions)} assumptions do not hold for what is"
        f" run{listed}.",
    )


def learning_beats_the_frozen_theta(runs: pd.DataFrame) -> Verdict:
    """C9, what the paper takes for granted."""
    asked = CLAIMS["C9"].learners
    claimed = pd.concat(arms(runs, *asked), keys=asked, names=["learner"])
    gains = {name: median(gain(arm)) for name, arm in zip(PAPER, arms(runs, *PAPER), strict=True)}
    listed = ", ".join(f"{name} {shown(value, '+.1%')}" for name, value in gains.items())
    failed = int(np.isinf(claimed.final_cost).sum())
    stuck = int((claimed.distance > ARRIVED).sum())
    return settle(
        CLAIMS["C9"],
        answered(gain(claimed) >= BETTER, claimed),
        f"Median fall of the noise-free cost: {listed}. Of the last drives of RDES and GES, {stuck}"
        f" end more than {ARRIVED} away from the target, and in {failed} runs one of the last three"
        " failed or training was stopped; they count.",
        unit="runs",
    )


def divergence(runs: pd.DataFrame) -> pd.Series:
    """Which runs diverged (see `DIVERGED`); missing where there is nothing to hold them against."""
    stopped = (runs.stopped != "finished") & runs.stopped.notna()
    return (
        _gone(runs.stopped, runs.cost_ratio)
        .astype("boolean")
        .where(runs.cost_ratio.notna() | stopped)
    )


def instability(runs: pd.DataFrame) -> pd.Series:
    """Which runs are unstable (see `UNSTABLE`); missing where that is not known."""
    return answered(divergence(runs) | (runs.late_cost_range > UNSTABLE), runs)


def gain(runs: pd.DataFrame) -> pd.Series:
    """Share of the noise-free cost that learning took away; minus infinity where a drive failed."""
    return 1 - runs.final_cost / runs.initial_cost


def costlier(first: pd.DataFrame, second: pd.DataFrame) -> pd.Series:
    """Final noise-free cost of the first arm over the second's, in shares of theta_init's.

    Two that failed cost the same.
    """
    more = (first.final_cost - second.final_cost) / first.initial_cost
    return more.where(first.final_cost != second.final_cost, 0.0)


def apart(first: Column | None, second: Column | None) -> float:
    """Largest distance [m] of two robots that drive side by side; nan where one is missing."""
    if first is None or second is None:
        return np.nan
    return float(np.max(np.linalg.norm(first[:, :2] - second[:, :2], axis=1)))


def diverged(study: Runs, experiment: Experiment, records: Records) -> bool:
    """Whether a run diverged: see `DIVERGED`."""
    frozen = {name: getattr(experiment, name) for name in CELL}
    (arm,) = study.select(learner="frozen", **frozen).values()
    return bool(_gone(records.facts["stopped"], metrics.cost_ratio(records, arm)))


def unstable(study: Runs, experiment: Experiment, records: Records) -> bool:
    """Whether a run is unstable: see `UNSTABLE`."""
    return diverged(study, experiment, records) or metrics.late_cost_range(records) > UNSTABLE


def experiment_of(row: Mapping[str, Any]) -> Experiment:
    """The experiment that a row of `summary.table` summarises.

    A field for which an older table has no column takes its default.

    Raises:
        LookupError: one of `NAMES` is missing.
    """
    missing = {one.name for one in fields(Experiment)} - row.keys()
    if missing & set(NAMES):
        raise LookupError(f"there is no column {min(missing & set(NAMES))}")
    named = {one.name: row[one.name] for one in fields(Experiment) if one.name not in missing}
    if "theta" in named:
        named["theta"] = tuple(float(value) for value in named["theta"].split())
    return Experiment(**named)


def _gone(stopped: Any, cost_ratio: Any) -> Any:
    """The rule of `DIVERGED`, for one run or a column of them."""
    return (stopped != "finished") | (cost_ratio > DIVERGED)


def _driven(runs: pd.DataFrame, paths: Paths) -> dict[tuple[Any, ...], Column]:
    """The paths of RDES and GES, by learner and cell."""
    wanted = runs[runs.learner.isin(("RDES", "GES"))].to_dict("records")
    found = {(row["learner"], *(row[n] for n in CELL)): experiment_of(row) for row in wanted}
    return {name: paths[one] for name, one in found.items() if one in paths}


def _theta_apart(first: pd.DataFrame, second: pd.DataFrame) -> Vector:
    """Largest relative difference between the components of two final thetas, one a pair."""
    names = [f"theta_{i}" for i in range(len(paper.THETA_INIT))]
    one, other = (arm[names].to_numpy(float) for arm in (first, second))
    return np.max(np.abs(one - other) / np.maximum(np.abs(one), np.abs(other)), axis=1, initial=0)


def _inside(runs: pd.DataFrame, name: str) -> pd.DataFrame:
    """How many states lay in an obstacle, one column a size."""
    return runs[[f"{name}_{size}" for size in SIZES]]


def _sized(inside: pd.DataFrame) -> str:
    first, second, third = (f"{count:.0f}" for count in inside.sum())
    return f"{first}, {second} and {third}"


def _timed(claim: Claim, outcome: str, evidence: str) -> Verdict:
    """A verdict for which no run is asked."""
    return Verdict(claim.name, claim.statement, outcome, evidence, claim.would_change)


def _ratios(timings: pd.DataFrame, learner: str) -> dict[str, float]:
    """Time of a step over that of ES, by solver; the paper's comes first."""
    if timings.empty:
        return {}
    timed = timings.groupby("solver").learner.agg(set)
    solvers = [name for name in timed.index if {learner, "ES"} <= timed[name]]
    return {
        solver: ratio(timings, solver, learner)
        for solver in sorted(solvers, key=lambda name: name != SOLVER)
    }


def _within(
    ratios: Mapping[str, float], claimed: tuple[float, float], near: tuple[float, float]
) -> str:
    if SOLVER not in ratios:
        return UNDECIDABLE
    value = ratios[SOLVER]
    if claimed[0] <= value <= claimed[1]:
        return REPRODUCED
    return PARTLY if near[0] <= value < near[1] else NOT


def _listed(learner: str, ratios: Mapping[str, float]) -> str:
    parts = [f"{value:.2f} with {solver}" for solver, value in ratios.items()]
    if not parts:
        return f"{learner} and ES were not timed"
    return f"A step of {learner} takes, in steps of ES, {', '.join(parts)}"


def _of(holds: pd.Series) -> str:
    known = holds.dropna()
    return f"{int(known.sum())} of {len(known)}"

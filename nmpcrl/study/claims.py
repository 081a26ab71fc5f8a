"""The paper's claims, one function each: a question, a measure, a threshold and a verdict.

The thresholds below were fixed before the study was trained, and are not to be moved after.
# departure P
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.control import Task
from nmpcrl.study import metrics, paper
from nmpcrl.study.audit import Assumption
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.imitation import Imitation
from nmpcrl.study.records import Records
from nmpcrl.study.store import Study
from nmpcrl.study.timing import ratio

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

REPRODUCED = "reproduced"
PARTLY = "partly reproduced"
NOT = "not reproduced"
UNDECIDABLE = "not decidable here"

Measured = TypeVar("Measured")


@dataclass(frozen=True)
class Verdict:
    """What became of one claim."""

    claim: str  # "C1"
    statement: str  # what the paper says
    outcome: str  # one of the four above
    evidence: str  # the numbers
    would_change: str  # where another verdict is to be expected


def judge(
    study: Study,
    timings: pd.DataFrame,
    imitations: Iterable[Imitation],
    assumptions: Iterable[Assumption],
) -> tuple[Verdict, ...]:
    """Every claim, in order.

    Args:
        study: the runs of `paper.study`.
        timings: of `time_learners`.
        imitations: of `imitate`, one a run.
        assumptions: of `audit`.
    """
    return (
        des_diverges_and_rdes_does_not(study),
        es_is_unstable_and_ges_is_stable(study),
        rdes_takes_half_the_time(timings),
        ges_takes_the_same_time(timings),
        rdes_and_ges_reach_the_same_policy(study),
        theta_makes_the_network_more_accurate(study, tuple(imitations)),
        constraints_hold(study),
        convergence_is_guaranteed(tuple(assumptions)),
        learning_beats_the_frozen_theta(study),
    )


def des_diverges_and_rdes_does_not(study: Study) -> Verdict:
    """C1, from Fig. 1."""
    des, rdes = _runs(study, "DES", diverged), _runs(study, "RDES", diverged)
    excess = {name: _median(_runs(study, name, _excess).values()) for name in ("DES", "RDES")}
    return Verdict(
        "C1",
        "DES diverges within 300 episodes; RDES does not.",
        _contrast(study, des, rdes),
        f"{_count(des)} runs of DES and {_count(rdes)} of RDES diverged; their training cost ended"
        f" at {_shown(excess['DES'], '.2f')} and {_shown(excess['RDES'], '.2f')} times the frozen"
        " arm's (medians; an episode that a failed solve cut short counts as ∞)."
        f" {_scope(study)}",
        "Other layouts and the untold details of the network; Algorithm 1 read literally"
        " (departure G).",
    )


def es_is_unstable_and_ges_is_stable(study: Study) -> Verdict:
    """C2, from Fig. 2."""
    es, ges = _runs(study, "ES", unstable), _runs(study, "GES", unstable)
    wander = {name: _median(_runs(study, name, _wander).values()) for name in ("ES", "GES")}
    return Verdict(
        "C2",
        "ES is unstable; GES is stable.",
        _contrast(study, es, ges),
        f"{_count(es)} runs of ES and {_count(ges)} of GES were unstable; in the second half the"
        f" noise-free cost ranged over {wander['ES']:.1%} and {wander['GES']:.1%} (medians)."
        f" {_scope(study)}",
        "A larger step size: alpha ||phi||^2 decides where a semi-gradient step overshoots.",
    )


def rdes_takes_half_the_time(timings: pd.DataFrame) -> Verdict:
    """C3, from Table II, with the paper's solver."""
    measured = ratio(timings, "ipopt", "RDES")
    return Verdict(
        "C3",
        "RDES takes half of the time of ES.",
        _within(measured, HALF, partly=(0.0, 1.0)),
        f"A step of RDES takes {measured:.2f} of a step of ES with Ipopt, the paper's solver,"
        f" {ratio(timings, 'fatrop', 'RDES'):.2f} with fatrop and"
        f" {ratio(timings, 'riccati', 'RDES'):.1f} with riccati: one solve instead of two, plus"
        f" {_fit(timings):.2f} ms for the network.",
        "The time of one solve: the slower the solver, the closer to one half. And where a solve"
        " starts: ES has already solved in the next state and starts its next step from there.",
    )


def ges_takes_the_same_time(timings: pd.DataFrame) -> Verdict:
    """C4, from Table II."""
    measured = ratio(timings, "ipopt", "GES")
    return Verdict(
        "C4",
        "GES takes the time of ES.",
        _within(measured, SAME_TIME, partly=(0.8, 1.25)),
        f"A step of GES takes {measured:.2f} of a step of ES with Ipopt,"
        f" {ratio(timings, 'fatrop', 'GES'):.2f} with fatrop and"
        f" {ratio(timings, 'riccati', 'GES'):.2f} with riccati; all solve twice.",
        "Nothing that we know of: the work is the same.",
    )


def rdes_and_ges_reach_the_same_policy(study: Study) -> Verdict:
    """C5, from Figs. 3 and 4 and the conclusion."""
    pairs = [
        (records, _counterpart(study, experiment, "GES"))
        for experiment, records in study.select(learner="RDES").items()
    ]
    same = {i: same_policy(a, b) for i, (a, b) in enumerate(pairs)}
    path = _median(metrics.path_distance(a, b) for a, b in pairs)
    cost = _median(abs(_cost_difference(a, b)) for a, b in pairs)
    theta = _median(metrics.theta_distance(a, b) for a, b in pairs)
    return Verdict(
        "C5",
        "RDES and GES reach the same policy.",
        _all(study, same),
        f"In {_count(same)} pairs; the robots come to be {path:.2f} m apart, their noise-free costs"
        f" differ by {cost:.1%} and the components of theta by up to {theta:.0%} (medians)."
        f" {_scope(study)}",
        "A looser meaning of 'same', and longer training.",
    )


def theta_makes_the_network_more_accurate(
    study: Study, imitations: tuple[Imitation, ...]
) -> Verdict:
    """C6, from Section III-A."""
    ratios = np.array([imitation.ratio for imitation in imitations])
    clear = dict(enumerate(ratios <= MORE_ACCURATE))
    if not _full_length(study):
        outcome = UNDECIDABLE
    elif all(clear.values()):
        outcome = REPRODUCED
    else:
        outcome = PARTLY if np.median(ratios) < 1 else NOT
    with_theta = _median(i.error("with_theta") for i in imitations)
    without = _median(i.error("without_theta") for i in imitations)
    return Verdict(
        "C6",
        "theta as an input makes the network more accurate.",
        outcome,
        f"On held-out episodes the error is {with_theta:.1f} with theta and {without:.1f} without"
        f" (medians of the root mean square, in units of cost), clearly lower in"
        f" {_count(clear)} runs.",
        "How far theta moves: where it hardly does, there is nothing to tell the network.",
    )


def constraints_hold(study: Study) -> Verdict:
    """C7, from Section III-A and the conclusion."""
    task, plant = _task(study), paper.nmpc().plant
    runs = [records for e, records in study.items() if e.learner != "frozen"]
    training = [metrics.obstacle_violations(r.steps["state"], task) for r in runs]
    testing = [metrics.obstacle_violations(r.evaluations["states"], task) for r in runs]
    inputs = sum(
        metrics.input_violations(r.steps["action"], plant.lower, plant.upper) for r in runs
    )
    in_training, in_testing = np.concatenate(training), np.concatenate(testing)
    steps = sum(len(r.steps["cost"]) for r in runs)
    if not _full_length(study):
        outcome = UNDECIDABLE
    elif in_testing.size or inputs:
        outcome = NOT
    else:
        outcome = PARTLY if in_training.size else REPRODUCED
    return Verdict(
        "C7",
        "Input and obstacle constraints hold throughout.",
        outcome,
        f"{inputs} inputs left the action space. A state overlapped an obstacle in"
        f" {in_training.size / steps:.1%} of the training steps (worst Xi {_worst(in_training)})"
        f" and at {in_testing.size} states of the noise-free rollouts (worst"
        f" {_worst(in_testing)}).",
        "The obstacle constraint is soft, and noise is added after it was enforced.",
    )


def convergence_is_guaranteed(assumptions: tuple[Assumption, ...]) -> Verdict:
    """C8, from the title, the abstract and Section III-B."""
    broken = [a.theorem for a in assumptions if not a.holds]
    return Verdict(
        "C8",
        "Convergence of GES is guaranteed.",
        REPRODUCED if not broken else NOT,
        f"{len(broken)} of the theorem's {len(assumptions)} assumptions do not hold for what is"
        f" run: {'; '.join(broken)}.",
        "Decaying step sizes, w faster than theta, the curvature term and a projection would bring"
        " it closer.",
    )


def learning_beats_the_frozen_theta(study: Study) -> Verdict:
    """C9, what the paper takes for granted."""
    better = {
        experiment: metrics.gain(records) >= BETTER
        for experiment, records in study.items()
        if experiment.learner in ("RDES", "GES")
    }
    gains = {
        name: _median(_runs(study, name, lambda _, __, r: metrics.gain(r)).values())
        for name in ("ES", "DES", "RDES", "GES")
    }
    listed = ", ".join(f"{name} {_shown(value, '+.1%')}" for name, value in gains.items())
    return Verdict(
        "C9",
        "Learning with RDES and GES beats theta_init without noise.",
        _all(study, better),
        f"In {_count(better)} runs; median fall of the noise-free cost: {listed}. {_scope(study)}",
        "The layout, and theta_c: near d_o it removes the penalty altogether (departure N).",
    )


def diverged(study: Study, experiment: Experiment, records: Records) -> bool:
    """Whether a run diverged: see `DIVERGED`."""
    stopped = records.facts["stopped"] != "finished"
    return stopped or _excess(study, experiment, records) > DIVERGED


def unstable(study: Study, experiment: Experiment, records: Records) -> bool:
    """Whether a run is unstable: see `UNSTABLE`."""
    return diverged(study, experiment, records) or metrics.wander(records) > UNSTABLE


def same_policy(a: Records, b: Records) -> bool:
    """Whether two runs ended in the same policy: see `SAME_PATH` and `SAME_COST`."""
    return metrics.path_distance(a, b) <= SAME_PATH and abs(_cost_difference(a, b)) <= SAME_COST


def _cost_difference(a: Records, b: Records) -> float:
    """Final noise-free cost of the first run minus the second's, as a share of theta_init's."""
    return (metrics.final_cost(a) - metrics.final_cost(b)) / metrics.initial_cost(a)


def _excess(study: Study, experiment: Experiment, records: Records) -> float:
    return metrics.excess(records, _counterpart(study, experiment, "frozen"))


def _wander(_: Study, __: Experiment, records: Records) -> float:
    return metrics.wander(records)


def _counterpart(study: Study, experiment: Experiment, learner: str) -> Records:
    """The run of another learner under the same noise."""
    fields = {name: getattr(experiment, name) for name in ("seed", "layout", "decay")}
    (records,) = study.select(learner=learner, **fields).values()
    return records


def _runs(
    study: Study, learner: str, measure: Callable[[Study, Experiment, Records], Measured]
) -> dict[Experiment, Measured]:
    return {e: measure(study, e, r) for e, r in study.select(learner=learner).items()}


def _contrast(study: Study, claimed: dict[Any, bool], spared: dict[Any, bool]) -> str:
    """The first learner is claimed to suffer what the second is spared."""
    if not _full_length(study):
        return UNDECIDABLE
    if all(claimed.values()) and not any(spared.values()):
        return REPRODUCED
    return PARTLY if sum(claimed.values()) > sum(spared.values()) else NOT


def _all(study: Study, holds: dict[Any, bool]) -> str:
    """Claimed of every run."""
    if not _full_length(study):
        return UNDECIDABLE
    if all(holds.values()):
        return REPRODUCED
    return PARTLY if any(holds.values()) else NOT


def _within(value: float, claimed: tuple[float, float], *, partly: tuple[float, float]) -> str:
    if claimed[0] <= value <= claimed[1]:
        return REPRODUCED
    return PARTLY if partly[0] <= value < partly[1] else NOT


def _full_length(study: Study) -> bool:
    """Whether all runs were asked for as many episodes as the paper's."""
    return all(experiment.episodes >= paper.EPISODES for experiment in study)


def _count(holds: dict[Any, bool]) -> str:
    return f"{sum(holds.values())} of {len(holds)}"


def _scope(study: Study) -> str:
    """What the evidence covers."""
    counts = {name: len(study.values_of(name)) for name in ("layout", "seed", "decay")}
    episodes = "/".join(str(n) for n in study.values_of("episodes"))
    parts = [f"{n} {_plural(name, n)}" for name, n in counts.items()]
    return f"({', '.join(parts)} of the decay; {episodes} episodes.)"


def _plural(name: str, count: int) -> str:
    word = "reading" if name == "decay" else name
    return word if count == 1 else f"{word}s"


def _shown(value: float, form: str) -> str:
    """A number as a sentence shows it; the cost of what could not be finished is infinite."""
    return f"{value:{form}}" if np.isfinite(value) else str(value).replace("inf", "∞")


def _median(values: Iterable[float]) -> float:
    return float(np.median(list(values)))


def _worst(violations: Vector) -> str:
    return f"{violations.max():.3f}" if violations.size else "none"


def _fit(timings: pd.DataFrame) -> float:
    """Time of one fit and prediction [ms]."""
    return float(timings.ms_per_fit.median())


def _task(study: Study) -> Task:
    (layout,) = study.values_of("layout")
    return paper.task(layout)

"""The main finding in a few numbers: closed gaps, theta_c by hand, and the endings of RDES.

theta_c tightens the obstacle constraint, Eq. (2f). A gap that the first rollout goes through closes
at a theta_c that is known before training (`trajectory.closes_at`). Runs of ES and GES are sorted
by their final theta_c, which is known only after training.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pandas as pd

from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims.failure_modes import Ending, ending
from nmpcrl.claims.published import Published
from nmpcrl.claims.thresholds import cost_reduction, solved, was_stopped, worsens
from nmpcrl.learning.rollout import Persistent, Rollout, evaluate
from nmpcrl.study import paper

LEARNERS = ("ES", "GES")  # which fit no network
EARLY = 20  # episodes
THETA_C = len(paper.THETA_INIT) - 1


Count: TypeAlias = tuple[int, int]  # yes, of


@dataclass(frozen=True)
class Finding:
    """Counts of runs or layouts of the published study, and shares of the cost."""

    arrived_open: Count  # runs of `LEARNERS` with open gaps that solve their layout
    arrived_closed: Count  # such runs with a closed gap
    open_in: tuple[str, ...]  # layouts of the runs with open gaps
    closed_in: tuple[str, ...]  # and of those with a closed one
    learned: float  # median reduction of the noise-free cost by runs with open gaps that solve it
    by_hand: Count  # layouts that theta_init with theta_c = d_o solves
    better: Count  # of these, layouts where it costs less than any run of `LEARNERS` in the end
    saved_by_hand: float  # median of these layouts
    lost_by_hand: tuple[float, float]  # least and largest increase of the cost in the others
    saved_there: float  # median of the runs in the layouts that are solved
    stopped: Count  # runs of RDES, with noise that decays per episode
    stopped_early: int  # of these, within `EARLY` episodes
    stopped_per_step: Count  # the same with noise that decays per step
    early_per_step: int
    not_there: Mapping[str, Count]  # by learner, runs that did not end at the target
    above: Mapping[str, Count]  # runs with a higher final cost than theta_init's
    worse: Mapping[str, Count]  # runs whose cost is higher by more than `BETTER`
    seconds: float  # of one core, a run of ES with the compiled solver
    hours: float  # of the robot's motion in a run


def finding(found: Published) -> Finding | None:
    """The finding of the published study; None if nothing is published."""
    if not found.rows:
        return None
    runs = _with_gaps(found.main[found.main.learner.isin(LEARNERS)])
    arrived = solved(runs)
    hand = {layout: _by_hand(layout) for layout in dict.fromkeys(runs.layout)}
    there = {layout: saved for layout, (saved, is_solved) in hand.items() if is_solved}
    others = [-saved for saved, is_solved in hand.values() if not is_solved] or [np.nan]
    most = runs.groupby("layout").saved.max()
    mine = {name: found.main[found.main.learner == name] for name in (*LEARNERS, "TDC")}
    stopped, early = _stopped(found.main, "episode")
    per_step, early_per_step = _stopped(found.main, "step")
    return Finding(
        arrived_open=_count(arrived[~runs.closed]),
        arrived_closed=_count(arrived[runs.closed]),
        open_in=tuple(dict.fromkeys(runs.layout[~runs.closed])),
        closed_in=tuple(dict.fromkeys(runs.layout[runs.closed])),
        learned=float(runs.saved[arrived & ~runs.closed].median()),
        by_hand=(len(there), len(hand)),
        better=(sum(bool(saved > most[name]) for name, saved in there.items()), len(there)),
        saved_by_hand=float(np.median(list(there.values()))),
        lost_by_hand=(min(others), max(others)),
        saved_there=float(runs.saved[runs.layout.isin(list(there))].median()),
        stopped=stopped,
        stopped_early=early,
        stopped_per_step=per_step,
        early_per_step=early_per_step,
        not_there={name: _count(one.ending != Ending.ARRIVED) for name, one in mine.items()},
        above={name: _count(cost_reduction(one) < 0) for name, one in mine.items()},
        worse={name: _count(worsens(one)) for name, one in mine.items()},
        seconds=3600 * float(found.timings.set_index(["solver", "learner"]).hours["riccati", "ES"]),
        hours=paper.EPISODES * paper.STEPS * paper.nmpc().plant.period / 3600,
    )


def _with_gaps(runs: pd.DataFrame) -> pd.DataFrame:
    """The runs, whether theta_c ended where a gap is closed, and the reduction of the cost."""
    first = {layout: _rollout(layout, paper.THETA_INIT[THETA_C]) for layout in set(runs.layout)}
    closes = {
        layout: closes_at(paper.task(layout), one.states[:, :2]) for layout, one in first.items()
    }
    return runs.assign(
        closed=runs[f"theta_{THETA_C}"] >= runs.layout.map(closes),
        saved=1 - runs.final_cost / runs.initial_cost,
    )


def _stopped(main: pd.DataFrame, decay: str) -> tuple[Count, int]:
    """Stopped runs of RDES in one reading, and how many were stopped within `EARLY` episodes."""
    rdes = main[(main.learner == "RDES") & (main.decay == decay)]
    stopped = rdes[was_stopped(rdes)]
    early = int((stopped.steps_done <= EARLY * paper.STEPS).sum())
    return (len(stopped), len(rdes)), early


def _by_hand(layout: str) -> tuple[float, bool]:
    """The reduction of the cost with theta_c = d_o, and whether it solves the layout."""
    task = paper.task(layout)
    before, after = (_rollout(layout, c) for c in (paper.THETA_INIT[THETA_C], task.margin))
    saved = 1 - after.cost / before.cost
    return saved, saved >= 0 and ending(after.states, task) == Ending.ARRIVED


def _rollout(layout: str, theta_c: float) -> Rollout:
    """A rollout without noise with theta_init and another theta_c."""
    theta = np.array([*paper.THETA_INIT[:THETA_C], theta_c])
    return evaluate(Persistent(paper.nmpc(layout)), theta, paper.STEPS)


def _count(answers: pd.Series) -> Count:
    return int(answers.sum()), len(answers)

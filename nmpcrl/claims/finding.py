"""What was found, in a few numbers: whether a gap closed, theta_c by hand, and how RDES ended.

theta_c tightens the obstacle constraint, Eq. (2f). A gap that the first rollout goes through closes
at a theta_c that is known before anything is trained (`trajectory.closes_at`). So each run of ES
and GES is sorted by the theta_c that it ends with, and not by how it ended.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pandas as pd

from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims.failure_modes import Ending, ending
from nmpcrl.claims.published import Published
from nmpcrl.claims.thresholds import was_stopped
from nmpcrl.learning.rollout import Persistent, Rollout, evaluate
from nmpcrl.study import paper

LEARNERS = ("ES", "GES")  # which fit no network
EARLY = 20  # episodes
THETA_C = len(paper.THETA_INIT) - 1


Count: TypeAlias = tuple[int, int]  # yes, of


@dataclass(frozen=True)
class Finding:
    """What the published study found, in counts of runs or layouts, and in shares of the cost."""

    arrived_open: Count  # runs of `LEARNERS` at the target at a lower cost, every gap being open
    arrived_closed: Count  # such runs, theta_c having closed a gap
    learned: float  # median reduction of the noise-free cost by the former
    by_hand: Count  # layouts in which the robot arrives with theta_c = d_o and all else as it was
    better: Count  # of these, where that costs less than each run of `LEARNERS` ends at
    saved_by_hand: float  # median of these layouts
    saved_there: float  # median of the runs in these layouts
    stopped: Count  # runs of RDES, with noise that decays per episode
    stopped_early: int  # of these, within `EARLY` episodes
    not_there: Mapping[str, Count]  # runs that did not end at the target, of some learners
    seconds: float  # of one core, a run of ES with the compiled solver
    hours: float  # that the robot moves in a run


def finding(found: Published) -> Finding | None:
    """The finding of the published study; None if nothing is published."""
    if not found.rows:
        return None
    runs = _with_gaps(found.main[found.main.learner.isin(LEARNERS)])
    arrived = (runs.ending == Ending.ARRIVED) & (runs.saved > 0)
    hand = {layout: _by_hand(layout) for layout in dict.fromkeys(runs.layout)}
    there = {layout: saved for layout, saved in hand.items() if saved is not None}
    most = runs.groupby("layout").saved.max()
    rdes = found.main[(found.main.learner == "RDES") & (found.main.decay == "episode")]
    stopped = rdes[was_stopped(rdes)]
    return Finding(
        arrived_open=_count(arrived[~runs.closed]),
        arrived_closed=_count(arrived[runs.closed]),
        learned=float(runs.saved[arrived & ~runs.closed].median()),
        by_hand=(len(there), len(hand)),
        better=(sum(bool(saved > most[name]) for name, saved in there.items()), len(there)),
        saved_by_hand=float(np.median(list(there.values()))),
        saved_there=float(runs.saved[runs.layout.isin(list(there))].median()),
        stopped=(len(stopped), len(rdes)),
        stopped_early=int((stopped.steps_done <= EARLY * paper.STEPS).sum()),
        not_there={
            name: _count(found.main.ending[found.main.learner == name] != Ending.ARRIVED)
            for name in (*LEARNERS, "TDC")
        },
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


def _by_hand(layout: str) -> float | None:
    """The reduction of the cost with theta_c = d_o; None if the robot does not arrive."""
    task = paper.task(layout)
    before, after = (_rollout(layout, c) for c in (paper.THETA_INIT[THETA_C], task.margin))
    return 1 - after.cost / before.cost if ending(after.states, task) == Ending.ARRIVED else None


def _rollout(layout: str, theta_c: float) -> Rollout:
    """Without noise, with theta_init but for theta_c."""
    theta = np.array([*paper.THETA_INIT[:THETA_C], theta_c])
    return evaluate(Persistent(paper.nmpc(layout)), theta, paper.STEPS)


def _count(answers: pd.Series) -> Count:
    return int(answers.sum()), len(answers)

"""The main finding in a few numbers: closed gaps, theta_c by hand, and the endings of RDES.

A gap that the first rollout goes through closes at a theta_c that is known before training
(`trajectory.closes_at`); the final theta_c of a run of ES or GES only after training.
"""

from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.rows import THETA
from nmpcrl.analysis.statistics import count
from nmpcrl.analysis.trajectory import closes_at
from nmpcrl.claims.failure_modes import Ending, ending
from nmpcrl.claims.published import Published
from nmpcrl.claims.thresholds import cost_reduction, solved, was_stopped, worsens
from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import paper

LEARNERS = ("ES", "GES")  # which fit no network
EARLY = 20  # episodes


def finding(found: Published) -> "pd.Series[Any]":
    """Counts of runs or layouts of the published study, and shares of the cost, by name.

    Counts are (yes, of). Empty if nothing is published.
    """
    if not found.rows:
        return pd.Series(dtype=object)
    main = found.main.runs.assign(saved=cost_reduction(found.main.runs))
    runs = main[main.learner.isin(LEARNERS)]
    hand = pd.DataFrame.from_dict({one: _by_hand(one) for one in runs.layout.unique()}, "index")
    closed = runs[THETA[-1]] >= runs.layout.map(hand.closes)
    arrived, there, lost = solved(runs), hand[hand.solved], -hand.saved[~hand.solved]
    most = runs.groupby("layout").saved.max()[there.index]
    each = {name: main[main.learner == name] for name in (*LEARNERS, "TDC")}
    stopped, early = _stopped(main, "episode")
    per_step, early_per_step = _stopped(main, "step")
    riccati = found.timings.set_index(["solver", "learner"]).hours["riccati", "ES"]
    numbers = {
        # runs of `LEARNERS` that solve their layout: with open gaps, and with a closed gap
        "arrived_open": count(arrived[~closed]),
        "arrived_closed": count(arrived[closed]),
        "open_in": tuple(runs.layout[~closed].unique()),  # layouts of runs with open gaps
        "closed_in": tuple(runs.layout[closed].unique()),
        # median reduction of the noise-free cost by runs with open gaps that solve their layout
        "learned": float(runs.saved[arrived & ~closed].median()),
        # layouts that theta_init with theta_c = d_o solves; of these, layouts where it costs less
        # than any run of `LEARNERS` in the end; its median reduction there, and the runs';
        # the least and largest increase of the cost in the others
        "by_hand": (len(there), len(hand)),
        "better": count(there.saved > most),
        "saved_by_hand": float(there.saved.median()),
        "saved_there": float(runs.saved[runs.layout.isin(there.index)].median()),
        "lost_by_hand": (float(lost.min()), float(lost.max())),
        # runs of RDES that were stopped, and how many of them within `EARLY` episodes
        "stopped": stopped,
        "stopped_early": early,
        "stopped_per_step": per_step,
        "early_per_step": early_per_step,
        # by learner: runs that did not end at the target, that cost more than theta_init, and that
        # cost more by more than `BETTER`
        "not_there": {name: count(one.ending != Ending.ARRIVED) for name, one in each.items()},
        "above": {name: count(one.saved < 0) for name, one in each.items()},
        "worse": {name: count(worsens(one)) for name, one in each.items()},
        "seconds": 3600 * float(riccati),  # of one core, a run of ES with the compiled solver
        "hours": paper.EPISODES * paper.STEPS * paper.nmpc().plant.period / 3600,  # of motion a run
    }
    return pd.Series(numbers, dtype=object)


def _by_hand(layout: str) -> dict[str, Any]:
    """theta_c that closes a gap of the first rollout, and the result of theta_c = d_o."""
    task, theta = paper.task(layout), np.array(paper.THETA_INIT)
    thetas = theta, np.array([*theta[:-1], task.margin])
    first, hand = (evaluate(paper.nmpc(layout), one, paper.STEPS) for one in thetas)
    saved = 1 - hand.cost / first.cost
    arrives = ending(hand.states, task) == Ending.ARRIVED
    closes = closes_at(task, first.states[:, :2])
    return {"closes": closes, "saved": saved, "solved": saved >= 0 and arrives}


def _stopped(main: pd.DataFrame, decay: str) -> tuple[tuple[int, int], int]:
    """Stopped runs of RDES in one reading, and how many were stopped within `EARLY` episodes."""
    rdes = main[(main.learner == "RDES") & (main.decay == decay)]
    stopped = was_stopped(rdes)
    return count(stopped), int((rdes.steps_done[stopped] <= EARLY * paper.STEPS).sum())

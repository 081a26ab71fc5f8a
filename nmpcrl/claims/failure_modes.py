"""Why a run went wrong, and where its robot ended, read off its summary.

A run went wrong if it was stopped or diverged in training (`paper_claims.divergence`), or if its
final noise-free cost is above theta_init's by more than `BETTER`. Its cost rose between the last
rollout without noise that was not above theta_init's by so much and the first that was; where none
was, in its last episodes. In these some ten episodes the mechanisms are looked for in the order of
`MECHANISMS`, and the first one found is the one, because each can bring about those after it. What
came first within these episodes, a summary cannot tell.

The thresholds were fixed before they were put to the study, but after a look at the ranges of
these columns in five short runs. They sort runs, and decide no claim.
"""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from nmpcrl.analysis.metrics import TOUCH
from nmpcrl.analysis.summary import RunSummary, table
from nmpcrl.claims.paper_claims import BETTER, divergence
from nmpcrl.control import Task
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment, frozen_arm
from nmpcrl.study.layouts import ARRIVED, gaps
from nmpcrl.study.records import Column

# A step with alpha ||phi||^2 above this overshoots: it turns the TD error round and makes it grow.
OVERSHOOT = 2.0
# The network is to blame if it says more than the true next value, so that on average this share
# of the TD error (its root mean square) is of the network's making.
OVER_PREDICTED = 0.5
# The solver is to blame if it cut short at least this share of the episodes, or the rollout itself.
CUT_SHORT = 0.5

MECHANISMS = ("overshoot", "network", "gap", "solver", "none of these")
ENDINGS = ("arrived", "stuck", "left the box", "hit", "failed")
WELL = "went well"  # in the place of a mechanism
NAMED = ("learner", "layout", "decay", "seed")


def fates(summaries: Mapping[Experiment, RunSummary] | Iterable[RunSummary]) -> pd.DataFrame:
    """What became of each run that learned, one row a run.

    Args:
        summaries: runs and their frozen arms.

    Returns:
        Columns learner, layout, decay, seed, ending (of the last drive: one of `ENDINGS`), cost
        (noise-free, at the end, over theta_init's), wrong ("stopped", "training", "without noise"
        or ""), episode (after which the cost rose; missing where nothing went wrong) and mechanism
        (one of `MECHANISMS`, or `WELL`).

    Raises:
        KeyError: the frozen arm of a run is not among them.
    """
    listed = list(summaries.values() if isinstance(summaries, Mapping) else summaries)
    named = {run.name: run for run in listed}
    runs = table(listed)
    shares = runs.final_cost / runs.initial_cost
    rows = []
    for run, share, wrong in zip(listed, shares, went_wrong(runs), strict=True):
        if run.name.learner == "frozen":
            continue
        task = paper.task(run.name.layout, box=run.name.box)
        first_drive = named[frozen_arm(run.name)].states
        rows.append(
            {
                **{name: run.experiment[name] for name in NAMED},
                "ending": ending(run.states, task),
                "cost": share,
                "wrong": wrong,
                "episode": rise(run).start if wrong else pd.NA,
                "mechanism": mechanism(run, task, first_drive) if wrong else WELL,
            }
        )
    return pd.DataFrame(rows)


def counted(fates: pd.DataFrame, what: str = "mechanism") -> pd.DataFrame:
    """How many runs of each learner met each fate: `what` is "mechanism" or "ending"."""
    known = ENDINGS if what == "ending" else (*MECHANISMS, WELL)
    counts = pd.crosstab(fates.learner, fates[what])
    return counts.reindex(index=fates.learner.unique(), columns=list(known), fill_value=0)


def went_wrong(runs: pd.DataFrame) -> list[str]:
    """What went wrong in each run: "stopped", "training", "without noise", or "" for nothing."""
    signs = {
        "stopped": runs.stopped != "finished",
        "training": divergence(runs).fillna(False),
        "without noise": runs.final_cost > (1 + BETTER) * runs.initial_cost,
    }
    conditions = [sign.to_numpy(bool) for sign in signs.values()]
    return np.select(conditions, list(signs), "").tolist()


def rise(run: RunSummary) -> slice:
    """The episodes in which a run's cost rose."""
    episode, cost = run.evaluations["episode"], run.evaluations["cost"]
    above = np.flatnonzero(cost > (1 + BETTER) * cost[0])
    if above.size:
        return slice(int(episode[above[0] - 1]), int(episode[above[0]]))
    reached = int((run.episodes["steps"] > 0).sum())
    return slice(max(0, reached - run.experiment["evaluate_every"]), reached)


def mechanism(run: RunSummary, task: Task, first_drive: Column) -> str:
    """Which of `MECHANISMS` was at work when the cost of a run rose.

    Args:
        run: one that went wrong.
        task: what it was trained in.
        first_drive: states of theta_init's drive without noise, shape (K + 1, n).
    """
    window = rise(run)
    signs = (
        overshot(run, window),
        over_predicted(run, window),
        gap_closed(run, window, task, first_drive),
        cut_short(run, window),
        True,
    )
    return MECHANISMS[signs.index(True)]


def overshot(run: RunSummary, window: slice) -> bool:
    """Whether a step moved theta so far that the TD error grew: see `OVERSHOOT`."""
    return bool((run.episodes["alpha_phi2"][window] > OVERSHOOT).any())


def over_predicted(run: RunSummary, window: slice) -> bool:
    """Whether the network said too much: see `OVER_PREDICTED`; False for who has none."""
    bias, delta = run.episodes["bias"][window], run.episodes["delta"][window]
    known = np.isfinite(bias) & np.isfinite(delta)
    share = paper.GAMMA * bias[known].sum() / delta[known].sum() if known.any() else 0.0
    return bool(share >= OVER_PREDICTED)


def gap_closed(run: RunSummary, window: slice, task: Task, first_drive: Column) -> bool:
    """Whether theta_c grew until no plan fits through a gap that the first drive went through."""
    start = run.experiment["theta"][-1]
    reached = np.fmax.reduce(run.episodes["theta"][window, -1], initial=start)
    before, after = (gaps(task, first_drive[:, :2], theta_c) for theta_c in (start, reached))
    return any(width > 0 >= after[sides] for sides, width in before.items())


def cut_short(run: RunSummary, window: slice) -> bool:
    """Whether solves failed: see `CUT_SHORT`."""
    judged = run.evaluations["episode"] == window.stop
    failed = np.isinf(run.evaluations["cost"][judged]).any()
    shares = run.episodes["failed"][window]
    return bool(failed or (shares.size and shares.mean() >= CUT_SHORT))


def ending(states: Column, task: Task) -> str:
    """How a drive without noise ended, the worst that can be said of it: one of `ENDINGS`.

    Args:
        states: shape (K + 1, n); nan from a failed solve on.
        task: what is driven in.
    """
    if np.isnan(states).any():
        return "failed"
    if task.overlap(states).max() > TOUCH:
        return "hit"
    if ((states < task.lower - TOUCH) | (states > task.upper + TOUCH)).any():
        return "left the box"
    return "stuck" if task.distance(states[-1]) > ARRIVED else "arrived"

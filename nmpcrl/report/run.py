"""One run in words, for `nmpcrl train`, `nmpcrl show` and the titles of figures."""

import numpy as np

from nmpcrl import Matrix
from nmpcrl.analysis import metrics
from nmpcrl.study.records import LAST, Records, Stopped

SAME = f"{0:.1%}"  # how a change is shown that is less than half of the last digit


def verdict(records: Records) -> str:
    """The noise-free cost before and after, in a sentence; after is `metrics.final_cost`."""
    before, after = metrics.initial_cost(records), metrics.final_cost(records)
    if not np.isfinite(after):
        return f"no noise-free cost at the end; theta_init's was {before:.1f}"
    change = f"{abs(1 - after / before):.1%}"
    end = f"noise-free cost {after:.1f} (mean of the last {LAST} rollouts)"
    if change == SAME:
        return f"{end}, within 0.1% of the {before:.1f} of theta_init"
    word = "less" if after <= before else "more"
    return f"{end}, {change} {word} than the {before:.1f} of theta_init"


def finding(records: Records) -> str:
    """What became of the noise-free cost, as the title of a picture."""
    learner, stopped = records.experiment["learner"], records.facts["stopped"]
    before, after = metrics.initial_cost(records), metrics.final_cost(records)
    if stopped != Stopped.FINISHED:
        episodes = int(records.steps["episode"][-1]) + 1
        largest = np.nanmax(np.abs(metrics.final_theta(records)), initial=0.0)
        of = f"{episodes} of {records.experiment['episodes']}"
        return f"{learner} diverged in episode {of}, where a component of theta was {largest:.2g}"
    if learner == "frozen":
        return f"A frozen theta keeps its noise-free cost of {before:.0f}"
    if not np.isfinite([before, after]).all():
        return f"{learner} ends without a noise-free cost: a solve failed"
    change = f"{abs(1 - after / before):.1%}"
    if change == SAME:
        return f"{learner} keeps the noise-free cost within 0.1% of {before:.0f}"
    verb = "lowers" if after <= before else "raises"
    return f"{learner} {verb} the noise-free cost by {change}, from {before:.0f} to {after:.0f}"


def thetas(records: Records) -> Matrix:
    """theta at the start and after each episode, shape (episodes + 1, d)."""
    last = np.append(np.flatnonzero(np.diff(records.steps["episode"])), -1)
    return np.vstack([records.experiment["theta"], records.steps["theta"][last]])

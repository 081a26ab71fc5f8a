"""The assumptions of the theorems that are cited for convergence, beside the algorithm: claim C8.

The paper cites Maei et al. (2010), for values that are linear in theta. Its introduction credits
that work with what Maei et al. (2009) prove for smooth values. So C8 asks about both theorems.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from nmpcrl.analysis import metrics
from nmpcrl.claims.rule import Claim, Observations
from nmpcrl.claims.thresholds import TEXTS
from nmpcrl.claims.verdict import NOT, REPRODUCED, UNDECIDABLE, Assumption, Verdict
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Records

SMOOTH, LINEAR = "Maei et al. (2009)", "Maei et al. (2010)"
THEOREMS = (SMOOTH, LINEAR)


class TheoremClaim(Claim):
    """A claim that rests on a theorem: it holds if all assumptions of one theorem hold."""

    def judge(self, observed: Observations) -> Verdict:
        """The verdict, with the assumptions."""
        made = observed.assumptions
        by_theorem = [[a.holds for a in made if name in a.by] for name in THEOREMS]
        applies = any(holds and all(holds) for holds in by_theorem)
        outcome = UNDECIDABLE if not made else REPRODUCED if applies else NOT
        return self.verdict(outcome, assumptions=made)


@dataclass(frozen=True)
class Measurement:
    """Three numbers of a run of GES, which the assumptions are compared with."""

    kinks: float  # share of its steps that start exactly on a boundary
    memory: float  # correlation of consecutive TD errors
    dropped: float  # size of the curvature term beside the printed direction, median


def measured(experiment: Experiment, records: Records, curvature: pd.DataFrame) -> Measurement:
    """The numbers of one run of GES, whose `dropped_curvature` is given."""
    kinks, delta = metrics.boundary_share(records, experiment.task), records.steps["delta"]
    delta = delta[np.isfinite(delta)]
    memory = float(np.corrcoef(delta[:-1], delta[1:])[0, 1])
    return Measurement(kinks, memory, float(np.median(curvature.ratio)))


def audit(experiment: Experiment, found: Measurement) -> tuple[Assumption, ...]:
    """The assumptions of `THEOREMS`, in `claims.toml`, beside one run of GES."""
    a, b = experiment.alpha, experiment.beta
    met = {
        "no kinks": found.kinks == 0,
        "w is faster": a < b,
        "nothing is dropped": found.dropped == 0,
    }
    numbers = {**vars(found), "alpha": a, "beta": b, "ratio": a / b}
    return tuple(
        Assumption(
            one["theorem"],
            " ".join(one["here"].split()).format(**numbers),
            met.get(one.get("holds_if"), False),
            tuple(one["by"]),
        )
        for one in TEXTS["assumptions"]
    )

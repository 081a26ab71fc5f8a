"""The assumptions of the theorems that are cited for convergence, beside the algorithm: claim C8.

The paper cites Maei et al. (2010), for values that are linear in theta. Its introduction credits
that work with what Maei et al. (2009) prove for smooth values. So C8 asks about both theorems.
"""

from dataclasses import dataclass

import numpy as np

from nmpcrl.analysis import metrics
from nmpcrl.analysis.gradient_td import Curvature
from nmpcrl.claims.rule import Claim, Observations
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


def measured(experiment: Experiment, records: Records, curvature: Curvature) -> Measurement:
    """The numbers of one run of GES."""
    kinks, delta = metrics.boundary_share(records, experiment.task), records.steps["delta"]
    delta = delta[np.isfinite(delta)]
    memory = float(np.corrcoef(delta[:-1], delta[1:])[0, 1])
    return Measurement(kinks, memory, float(np.median(curvature.ratio)))


def audit(experiment: Experiment, found: Measurement) -> tuple[Assumption, ...]:
    """The assumptions of `THEOREMS`, beside one run of GES."""
    a, b = experiment.alpha, experiment.beta
    rows = (
        ("the value is linear in theta",
         "it is the value of an optimal control problem, which is not",
         False, (LINEAR,)),
        ("the value is three times differentiable in theta",
         f"it has a kink wherever an active set changes; {found.kinks:.1%} of the steps of a run"
         " of GES start exactly on one",
         found.kinks == 0, (SMOOTH,)),
        ("a finite MDP", "states and actions are continuous", False, THEOREMS),
        ("transitions drawn independently from one distribution",
         "one trajectory of a policy that changes; consecutive TD errors have a correlation of"
         f" {found.memory:.2f}",
         False, (SMOOTH,)),
        ("the policy that acts stays the same", "it is that of theta, and moves with it",
         False, THEOREMS),
        ("step sizes that decay, their squares summable",
         f"constant, alpha = {a:g} and beta = {b:g}",
         False, THEOREMS),
        ("w moves faster than theta, alpha / beta to 0", f"alpha / beta = {a / b:g}",
         a < b, THEOREMS),
        ("theta is projected onto a compact set", "there is no projection", False, (SMOOTH,)),
        ("the update follows the gradient of the MSPBE, curvature included",
         "the paper's (16) drops the curvature term, whose size beside the printed direction is"
         f" {found.dropped:.1e} in the median; a value that is linear has none",
         found.dropped == 0, (SMOOTH,)),
    )  # fmt: skip
    return tuple(Assumption(*row) for row in rows)

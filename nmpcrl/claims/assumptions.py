"""What the convergence theorem of nonlinear TDC assumes, beside what is run: claim C8."""

import numpy as np

from nmpcrl.analysis import metrics
from nmpcrl.analysis.gradient_td import Curvature
from nmpcrl.claims.rule import (
    NOT,
    REPRODUCED,
    UNDECIDABLE,
    Assumption,
    Claim,
    Observations,
    Verdict,
)
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs


class TheoremClaim(Claim):
    """A claim that rests on a theorem: it holds if what is run meets all of the assumptions."""

    def judge(self, observed: Observations) -> Verdict:
        """The verdict; one assumption that does not hold is enough against it."""
        assumptions = observed.assumptions
        broken = [a.theorem for a in assumptions if not a.holds]
        listed = f": {'; '.join(broken)}" if broken else ""
        return self.verdict(
            UNDECIDABLE if not assumptions else NOT if broken else REPRODUCED,
            f"{len(broken)} of the theorem's {len(assumptions)} assumptions do not hold for what is"
            f" run{listed}.",
        )


def audit(study: Runs[Records], curvature: Curvature) -> tuple[Assumption, ...]:
    """The assumptions of the convergence theorem of nonlinear TDC, beside what is run."""
    ges = study.select(learner="GES")
    experiment = next(iter(ges))
    task = experiment.task
    kinks = float(np.mean([metrics.boundary_share(r, task) for r in ges.values()]))
    memory = float(np.median([metrics.memory(r) for r in ges.values()]))
    dropped = float(np.median(curvature.ratio))
    return (
        Assumption(
            "a finite MDP",
            "states and actions are continuous",
            holds=False,
        ),
        Assumption(
            "transitions drawn independently from one distribution",
            "one trajectory of a policy that changes; consecutive TD errors have a correlation of"
            f" {memory:.2f}",
            holds=False,
        ),
        Assumption(
            "Q is three times differentiable in theta",
            f"the value has a kink wherever an active set changes; {kinks:.1%} of the steps start"
            " exactly on one",
            holds=kinks == 0,
        ),
        Assumption(
            "step sizes that decay, their squares summable",
            f"constant, alpha = {experiment.alpha:g} and beta = {experiment.beta:g}",
            holds=False,
        ),
        Assumption(
            "w moves faster than theta, alpha / beta to 0",
            f"alpha / beta = {experiment.alpha / experiment.beta:g}",
            holds=experiment.alpha < experiment.beta,
        ),
        Assumption(
            "theta is projected onto a compact set",
            "there is no projection",
            holds=False,
        ),
        Assumption(
            "the update follows the gradient of the MSPBE",
            "the paper's (16) drops the curvature term, whose size beside the printed direction is"
            f" {dropped:.1e} in the median",
            holds=dropped == 0,
        ),
    )

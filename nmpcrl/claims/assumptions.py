"""What the theorems that are cited for convergence assume, beside what is run: claim C8.

The paper's sentence cites Maei et al. (2010), whose values are linear in theta, as the paper says
itself two equations earlier. Its introduction credits that work with what Maei et al. (2009) prove,
for smooth values that need not be linear. So C8 is put to both. An assumption is listed for a
theorem where the paper, or what is public of the work, says that it is made.
"""

import numpy as np

from nmpcrl.analysis import metrics
from nmpcrl.analysis.gradient_td import Curvature
from nmpcrl.claims.rule import Assumption, Claim, Observations
from nmpcrl.claims.verdict import NOT, REPRODUCED, UNDECIDABLE, Verdict
from nmpcrl.study.records import Records
from nmpcrl.study.store import Runs

SMOOTH, LINEAR = "Maei et al. (2009)", "Maei et al. (2010)"
THEOREMS = (SMOOTH, LINEAR)


class TheoremClaim(Claim):
    """A claim that rests on a theorem: it holds if what is run meets all of its assumptions."""

    def judge(self, observed: Observations) -> Verdict:
        """The verdict; of each theorem, one assumption that does not hold is enough against it."""
        assumptions = observed.assumptions
        asked = {name: [a for a in assumptions if name in a.by] for name in THEOREMS}
        broken = {name: [a for a in made if not a.holds] for name, made in asked.items()}
        parts = [
            f"{len(broken[name])} of {len(made)} of {name}" for name, made in asked.items() if made
        ]
        listed = "; ".join(a.theorem for a in assumptions if not a.holds)
        applies = any(made and not broken[name] for name, made in asked.items())
        return self.verdict(
            UNDECIDABLE if not assumptions else REPRODUCED if applies else NOT,
            f"Of the assumptions of the two theorems that are cited, {' and '.join(parts)} do not"
            f" hold for what is run{f': {listed}' if listed else ''}.",
        )


def audit(study: Runs[Records], curvature: Curvature) -> tuple[Assumption, ...]:
    """The assumptions of `THEOREMS`, beside what is run."""
    ges = study.select(learner="GES")
    experiment = next(iter(ges))
    task = experiment.task
    kinks = float(np.mean([metrics.boundary_share(r, task) for r in ges.values()]))
    memory = float(np.median([metrics.memory(r) for r in ges.values()]))
    dropped = float(np.median(curvature.ratio))
    return (
        Assumption(
            "the value is linear in theta",
            "it is the value of an optimal control problem, which is not",
            holds=False,
            by=(LINEAR,),
        ),
        Assumption(
            "the value is three times differentiable in theta",
            f"it has a kink wherever an active set changes; {kinks:.1%} of the steps of a run"
            " of GES start exactly on one",
            holds=kinks == 0,
            by=(SMOOTH,),
        ),
        Assumption(
            "a finite MDP",
            "states and actions are continuous",
            holds=False,
            by=THEOREMS,
        ),
        Assumption(
            "transitions drawn independently from one distribution",
            "one trajectory of a policy that changes; consecutive TD errors have a correlation of"
            f" {memory:.2f}",
            holds=False,
            by=(SMOOTH,),
        ),
        Assumption(
            "the policy that acts stays the same",
            "it is that of theta, and moves with it",
            holds=False,
            by=THEOREMS,
        ),
        Assumption(
            "step sizes that decay, their squares summable",
            f"constant, alpha = {experiment.alpha:g} and beta = {experiment.beta:g}",
            holds=False,
            by=THEOREMS,
        ),
        Assumption(
            "w moves faster than theta, alpha / beta to 0",
            f"alpha / beta = {experiment.alpha / experiment.beta:g}",
            holds=experiment.alpha < experiment.beta,
            by=THEOREMS,
        ),
        Assumption(
            "theta is projected onto a compact set",
            "there is no projection",
            holds=False,
            by=(SMOOTH,),
        ),
        Assumption(
            "the update follows the gradient of the MSPBE, curvature included",
            "the paper's (16) drops the curvature term, whose size beside the printed direction is"
            f" {dropped:.1e} in the median; a value that is linear has none",
            holds=dropped == 0,
            by=(SMOOTH,),
        ),
    )

"""How a ratio of times becomes a verdict, on a machine that may be busy.

The constants were fixed by the reasons below, before anything was judged with them; where a claim's
borders lie was fixed with all thresholds, in `thresholds`.

The interval of the ratio (`bench.paired`) decides, and it has to lie on one side of every border:

- reproduced: it lies within what is claimed;
- partly reproduced: it lies within what is near, and outside what is claimed;
- not reproduced: it lies outside what is near;
- not decidable: it reaches across a border, too few steps were timed, or the process waited for
  more than `WAITED` of the time.

`WAITED` = 3/4 is where four share a processor. The process then finds most of the caches filled by
others at each of its turns. Filling them again takes up to 0.1 ms (a megabyte at 10 GB/s) in a turn
of 1 ms or more, so that up to a tenth of what the processor's clock shows may be others' doing, as
much as C4 leaves between its claim and its border; beyond that, pairs are not trusted to cancel it.

An interval that reaches across a border is blamed on the machine where the process had to wait for
more than `paired.IDLE` = 5 % of the time; a machine with nothing else to do makes it wait for less.
Below that, the ratio is too near to the border for so many steps.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pandas as pd

from nmpcrl.bench.learners import REFERENCE, ratio
from nmpcrl.bench.paired import IDLE, Ratio
from nmpcrl.claims.rule import Claim, Observations
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome, Verdict

WAITED = 0.75  # share of the time

Range: TypeAlias = tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class TimeClaim(Claim):
    """A claim about the time of a step, in steps of ES, with one solver."""

    learner: str  # whose step
    solver: str
    claimed: Range  # where the claim holds
    near: Range  # and where in part
    work: str  # why so long, for the evidence

    def judge(self, observed: Observations) -> Verdict:
        """The verdict, by `decide`; not decidable where there was no time taken."""
        ratios = self.ratios(observed.timings)
        listed = ", ".join(f"{value} with {solver}" for solver, value in ratios.items())
        taken = f"A step of {self.learner} takes, in steps of {REFERENCE}, {listed}: {self.work}."
        if self.solver not in ratios:
            missing = f"{self.learner} and {REFERENCE} were not timed with {self.solver}."
            return self.verdict(UNDECIDABLE, missing)
        measured = ratios[self.solver]
        outcome, reason = decide(measured, self.claimed, self.near)
        interval = None if np.isnan(measured.low) else (measured.low, measured.high)
        evidence = f"{taken} {reason}".strip()
        return self.verdict(outcome, evidence, ratio=measured.value, interval=interval)

    def ratios(self, timings: pd.DataFrame) -> dict[str, Ratio]:
        """Time of a step over that of ES, by solver; the one that decides comes first."""
        if timings.empty:
            return {}
        timed = timings.groupby("solver").learner.agg(set)
        solvers = [name for name in timed.index if {self.learner, REFERENCE} <= timed[name]]
        ordered = sorted(solvers, key=lambda name: name != self.solver)
        return {name: ratio(timings, name, self.learner) for name in ordered}


def decide(ratio: Ratio, claimed: Range, near: Range) -> tuple[Outcome, str]:
    """The outcome, and, where there is none, why.

    Args:
        ratio: as it was measured.
        claimed: where the claim holds, both ends included.
        near: where it holds in part, the lower end included.
    """
    if np.isnan([ratio.low, ratio.high]).any():
        return UNDECIDABLE, "Not decidable here: too few steps were timed."
    low, high = ratio.low, ratio.high
    inside = claimed[0] <= low and high <= claimed[1]
    beside = high < claimed[0] or low > claimed[1]
    close, far = near[0] <= low and high < near[1], high < near[0] or low >= near[1]
    outcome = REPRODUCED if inside else PARTLY if beside and close else NOT if far else UNDECIDABLE
    if ratio.waited > WAITED or (outcome == UNDECIDABLE and ratio.waited > IDLE):
        reason = "Not decidable here: the machine was too busy, the process waited for"
        return UNDECIDABLE, f"{reason} {ratio.waited:.0%} of the time."
    if outcome == UNDECIDABLE:
        return outcome, "Not decidable here: the interval reaches across a border of the claim."
    return outcome, ""

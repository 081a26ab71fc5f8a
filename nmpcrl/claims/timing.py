"""How a ratio of times becomes a verdict, on a machine that may be busy.

The interval of the ratio (`bench.paired`) decides, and must lie on one side of every border:

- reproduced: it lies within the claimed range;
- partly reproduced: it lies within the near range, and outside the claimed one;
- not reproduced: it lies outside the near range;
- not decidable: it reaches across a border, too few steps were timed, or the process waited for
  more than `WAITED` of the time.

All was fixed before any ratio was judged. `WAITED` = 3/4 is where four share a processor: then to
fill the caches again takes up to a tenth of the time, as much as C4 leaves between its claim and
its border.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from nmpcrl.bench.learners import REFERENCE, ratio
from nmpcrl.bench.paired import Ratio
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

    def judge(self, observed: Observations) -> Verdict:
        """The verdict, by `decide`, with the ratio of each solver; the solver of the claim first.

        Not decidable without times.
        """
        timings = observed.timings
        learners = timings.groupby("solver").learner.agg(set) if len(timings) else {}
        timed = [name for name, those in learners.items() if {self.learner, REFERENCE} <= those]
        if self.solver not in timed:
            return self.verdict(UNDECIDABLE)
        ordered = sorted(timed, key=lambda name: name != self.solver)
        ratios = {name: ratio(timings, name, self.learner) for name in ordered}
        own = ratios[self.solver]
        interval = None if np.isnan(own.low) else (own.low, own.high)
        outcome = decide(own, self.claimed, self.near)
        return self.verdict(outcome, ratio=own.value, interval=interval, numbers=ratios)


def decide(ratio: Ratio, claimed: Range, near: Range) -> Outcome:
    """The outcome of a claim; the upper end of `near` is outside, the other ends are inside."""
    low, high = ratio.low, ratio.high
    if np.isnan([low, high]).any() or ratio.waited > WAITED:
        return UNDECIDABLE
    if claimed[0] <= low and high <= claimed[1]:
        return REPRODUCED
    if high < near[0] or low >= near[1]:
        return NOT
    beside = high < claimed[0] or low > claimed[1]
    return PARTLY if beside and near[0] <= low and high < near[1] else UNDECIDABLE

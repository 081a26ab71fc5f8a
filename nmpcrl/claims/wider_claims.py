"""Wider questions than the paper's: C7 and C9, which name some of its learners, asked of all four.

Measure, threshold and rule are the claim's; the name is another.
"""

from dataclasses import replace

import pandas as pd

from nmpcrl.claims.by_runs import RunClaim
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.rule import Observations, Paths
from nmpcrl.claims.verdict import Verdict
from nmpcrl.study.experiment import PAPER

WIDER_CLAIMS: dict[str, RunClaim] = {
    "W7": replace(
        BY_RUNS["C7"],
        name="W7",
        statement="With all four learners, input and obstacle constraints hold throughout.",
        quotation="",
        learners=PAPER,
    ),
    "W9": replace(
        BY_RUNS["C9"],
        name="W9",
        statement="Learning with any of the four learners beats theta_init without noise.",
        question="Does the run of one of the four learners end with a lower noise-free cost than"
        " theta_init's?",
        short="all four\nbeat $\\theta_\\mathrm{init}$",
        quotation="",
        implied=False,
        learners=PAPER,
    ),
}
WIDER_THAN = {"W7": "C7", "W9": "C9"}


def judge_wider(runs: pd.DataFrame, paths: Paths) -> tuple[Verdict, ...]:
    """The verdicts on the wider claims, in order; arguments as for `paper_claims.judge_runs`."""
    observed = Observations(runs, paths)
    return tuple(claim.judge(observed) for claim in WIDER_CLAIMS.values())

"""Wider questions than the paper's: its claims on two or fewer learners, asked of all four.

C7 and C9 speak of some of the paper's learners. What becomes of the same statement with all of them
is another question, with a name of its own; measure, threshold and rule are those of the claim.
"""

from dataclasses import replace

import pandas as pd

from nmpcrl.claims.by_runs import RunClaim
from nmpcrl.claims.paper_claims import BY_RUNS, constraints_held, cost_reduced
from nmpcrl.claims.rule import Observations, Paths
from nmpcrl.claims.verdict import Verdict
from nmpcrl.study.experiment import PAPER

WIDER_CLAIMS: dict[str, RunClaim] = {
    "W7": replace(
        BY_RUNS["C7"],
        name="W7",
        statement="With all four learners, input and obstacle constraints hold throughout.",
        quotation="",
        **constraints_held(PAPER),
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
        **cost_reduced(PAPER),
    ),
}
WIDER_THAN = {"W7": "C7", "W9": "C9"}  # the claim that each widens


def judge_wider(runs: pd.DataFrame, paths: Paths) -> tuple[Verdict, ...]:
    """The verdicts on all of them, in order; arguments as `paper_claims.judge_runs` takes them."""
    observed = Observations(runs, paths)
    return tuple(claim.judge(observed) for claim in WIDER_CLAIMS.values())

"""What we add to the paper: learners that it does not have, held against those that it has.

Decided as the paper's claims are, by the thresholds of `claims` and the rule of `verdicts`, and
fixed with them before they were put to the study. A claim is judged wherever its learner was run.
"""

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import probability_of_improvement
from nmpcrl.claims.paper_claims import BETTER, SAME_COST, costlier, gain
from nmpcrl.claims.rule import Claim, Verdict, answered, arms, median, settle, shown
from nmpcrl.study.experiment import PAPER

MEASURE = "final noise-free costs, in shares of theta_init's"

ADDITIONS = {
    claim.name: claim
    for claim in (
        Claim(
            "B1",
            "Exact TDC is at least as good as GES.",
            "Does TDC end no costlier than GES with the same layout, decay and seed?",
            MEASURE,
            f"costlier by at most {SAME_COST:.0%}",
            would_change="The step size of w, which is ours.",
            learners=("TDC", "GES"),
        ),
        Claim(
            "B2",
            "The direction of a step matters: ES beats steps of its length in random directions.",
            "Does ES end cheaper than the random walk with the same layout, decay and seed?",
            MEASURE,
            f"cheaper by at least {BETTER:.0%}",
            would_change="Layouts in which theta_init can hardly be improved.",
            learners=("ES", "random"),
        ),
        Claim(
            "B3",
            "Only the length of its steps sets GES apart: ES with steps as long ends alike.",
            "Does ES with GES's step length end as GES does with the same layout, decay and seed?",
            MEASURE,
            f"apart by at most {SAME_COST:.0%}",
            would_change="A larger beta (departure J): w starts near 0, and with w = 0 GES is ES.",
            learners=("matched", "GES"),
        ),
        Claim(
            "B4",
            "Q-learning with Q(s, a) is at least as good as ES.",
            "Does Q-learning end no costlier than ES with the same layout, decay and seed?",
            MEASURE,
            f"costlier by at most {SAME_COST:.0%}",
            would_change="Exploration late in training: without it, a is what the policy says.",
            learners=("QL", "ES"),
        ),
    )
}


def judge_additions(runs: pd.DataFrame) -> tuple[Verdict, ...]:
    """The verdicts on all of them, in order; `runs` as `paper_claims.judge` takes them."""
    return (
        tdc_is_at_least_as_good_as_ges(runs),
        direction_matters(runs),
        only_the_step_length_sets_ges_apart(runs),
        q_learning_is_at_least_as_good_as_es(runs),
    )


def tdc_is_at_least_as_good_as_ges(runs: pd.DataFrame) -> Verdict:
    """B1: GES is TDC without the curvature term, and with w slower than theta."""
    return _against(ADDITIONS["B1"], runs, (-np.inf, SAME_COST))


def direction_matters(runs: pd.DataFrame) -> Verdict:
    """B2: the control of ES takes steps of its length in uniformly random directions."""
    return _against(ADDITIONS["B2"], runs, (-np.inf, -BETTER))


def only_the_step_length_sets_ges_apart(runs: pd.DataFrame) -> Verdict:
    """B3: the control of GES takes steps of its length in the direction of ES."""
    return _against(ADDITIONS["B3"], runs, (-SAME_COST, SAME_COST))


def q_learning_is_at_least_as_good_as_es(runs: pd.DataFrame) -> Verdict:
    """B4: the Q-learning of Gros and Zanon (2020), which the paper builds on."""
    return _against(ADDITIONS["B4"], runs, (-np.inf, SAME_COST))


def _against(claim: Claim, runs: pd.DataFrame, bounds: tuple[float, float]) -> Verdict:
    """Whether the first learner ends costlier than the second by a share within these bounds."""
    added = tuple(name for name in claim.learners if name not in PAPER)
    first, second = arms(runs, *claim.learners, among=added)
    more = costlier(first, second)
    answers = answered((bounds[0] <= more) & (more <= bounds[1]), first, second)
    return settle(claim, answers, _compared(claim.learners, first, second))


def _compared(learners: tuple[str, ...], first: pd.DataFrame, second: pd.DataFrame) -> str:
    """Probability of improvement and median gains, of the pairs that are whole."""
    whole = (first.stopped.notna() & second.stopped.notna()).to_numpy(bool)
    if not whole.any():
        return f"{learners[0]} and {learners[1]} were not run together."
    one, other = first[whole], second[whole]
    better = probability_of_improvement(
        one.final_cost.to_numpy(float),
        other.final_cost.to_numpy(float),
        list(one.index.get_level_values("layout")),
    )
    falls = [shown(median(gain(arm)), "+.1%") for arm in (one, other)]
    return (
        f"A run of {learners[0]} costs less than one of {learners[1]} with probability"
        f" {better:.2f}; the noise-free cost fell by {falls[0]} and {falls[1]} (medians)."
    )

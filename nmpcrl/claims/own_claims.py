"""What we add to the paper: learners that it does not have, compared with those that it has.

Decided as the paper's claims are, by `thresholds` and the rule of `rule`, and
fixed with them before they were put to the study. A claim is judged wherever its learner was run.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import Estimate, probability_of_improvement
from nmpcrl.claims.by_runs import AtMost, RunClaim, Values
from nmpcrl.claims.rule import Observations, Paths, arms, drawn_anew, median, shown
from nmpcrl.claims.thresholds import BETTER, SAME_COST, cost_difference, cost_reduction
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, Verdict
from nmpcrl.study.experiment import PAPER


def compared(
    learners: tuple[str, str],
    size: Callable[[pd.Series], pd.Series] = lambda difference: difference,
) -> dict[str, Any]:
    """The fields of a claim that compares the final noise-free costs of two learners.

    Args:
        learners: the cost of the first minus that of the second is judged, in shares of
            theta_init's.
        size: what is judged of the difference.
    """
    first, second = learners
    return {
        "learners": learners,
        "measured": "final noise-free costs, in shares of theta_init's",
        "measure": partial(_difference, learners, size),
        "evidence": partial(_evidence, learners),
        "label": f"noise-free cost, {first} - {second}",
        "words": {
            REPRODUCED: "confirmed",
            PARTLY: "confirmed in part",
            NOT: "not confirmed",
        },
    }


def _difference(
    learners: tuple[str, str],
    size: Callable[[pd.Series], pd.Series],
    runs: pd.DataFrame,
    _: Paths,
) -> Values:
    difference = size(cost_difference(*_pairs(learners, runs)))
    return difference.astype(float).to_frame(f"{learners[0]} and {learners[1]}")


def _evidence(learners: tuple[str, str], runs: pd.DataFrame, _: Paths) -> str:
    """Probability of improvement and median reductions, of the pairs that are whole."""
    first, second = _pairs(learners, runs)
    whole = (first.stopped.notna() & second.stopped.notna()).to_numpy(bool)
    if not whole.any():
        return f"{learners[0]} and {learners[1]} were not run together."
    one, other = first[whole], second[whole]
    better = _costs_less(one, other)
    medians = [shown(median(cost_reduction(arm)), "+.1%") for arm in (one, other)]
    return (
        f"A run of {learners[0]} costs less than one of {learners[1]} with probability"
        f" {better:.2f}; the noise-free cost was reduced by {medians[0]} and {medians[1]}"
        " (medians)."
    )


def costs_less(runs: pd.DataFrame, first: str, second: str) -> Estimate:
    """Probability that a run of the first learner costs less than one of the second in its layout.

    Every pair counts alike: one that got stuck loses, by however much, no more than once. Runs
    without a counterpart do not count; without any pair the estimate is nan.
    """
    one, other = arms(runs, first, second)
    whole = (one.stopped.notna() & other.stopped.notna()).to_numpy(bool)
    return _costs_less(one[whole], other[whole]) if whole.any() else Estimate(*[np.nan] * 3)


def costs_less_anew(runs: pd.DataFrame, first: str, second: str) -> Estimate:
    """As `costs_less`, with the interval for layouts drawn anew (see `rule.drawn_anew`)."""
    layouts = (of for _, of in runs[runs.learner.isin((first, second))].groupby("layout"))
    return drawn_anew(costs_less(one, first, second).value for one in layouts)


def _costs_less(first: pd.DataFrame, second: pd.DataFrame) -> Estimate:
    layouts = list(first.index.get_level_values("layout"))
    one, other = (arm.final_cost.to_numpy(float) for arm in (first, second))
    return probability_of_improvement(one, other, layouts)


def _pairs(learners: tuple[str, str], runs: pd.DataFrame) -> tuple[pd.DataFrame, ...]:
    """The runs of both, where the one that the paper does not have was run."""
    return arms(runs, *learners, among=tuple(name for name in learners if name not in PAPER))


OWN_CLAIMS: dict[str, RunClaim] = {
    claim.name: claim
    for claim in (
        AtMost(
            name="B1",
            statement="Exact TDC is at least as good as GES.",
            short="TDC as good\nas GES",
            question="Does TDC end at no higher cost than GES with the same layout, decay and"
            " seed?",
            border=f"higher by at most {SAME_COST:.0%}",
            would_change="The step size of w, which is ours.",
            threshold=SAME_COST,
            **compared(("TDC", "GES")),
        ),
        AtMost(
            name="B2",
            statement="The direction of a step matters: ES beats steps of its length in random"
            " directions.",
            question="Does ES end at a lower cost than the random walk with the same layout,"
            " decay and seed?",
            border=f"lower by at least {BETTER:.0%}",
            would_change="Layouts in which theta_init can hardly be improved.",
            threshold=-BETTER,
            **compared(("ES", "random")),
        ),
        AtMost(
            name="B3",
            statement="Only the length of its steps sets GES apart: ES with steps as long ends"
            " alike.",
            question="Does ES with GES's step length end as GES does with the same layout, decay"
            " and seed?",
            border=f"apart by at most {SAME_COST:.0%}",
            would_change="A larger beta (departure J): w starts near 0, and with w = 0 GES is ES.",
            threshold=SAME_COST,
            **compared(("matched", "GES"), pd.Series.abs),
        ),
        AtMost(
            name="B4",
            statement="Q-learning with Q(s, a) is at least as good as ES.",
            question="Does Q-learning end at no higher cost than ES with the same layout, decay"
            " and seed?",
            border=f"higher by at most {SAME_COST:.0%}",
            would_change="Exploration late in training: without it, a is the input that the policy"
            " chooses.",
            threshold=SAME_COST,
            **compared(("QL", "ES")),
        ),
    )
}


def judge_own(runs: pd.DataFrame) -> tuple[Verdict, ...]:
    """The verdicts on all of them, in order; `runs` as `paper_claims.judge` takes them."""
    return tuple(claim.judge(Observations(runs)) for claim in OWN_CLAIMS.values())

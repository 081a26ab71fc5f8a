"""Our own claims: learners that the paper does not have, compared with the paper's.

`thresholds` and the rule of `rule` decide them, and all was fixed together, before any claim was
tested on the study. A claim is judged in the cells in which its learner was run.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import Estimate, probability_of_improvement
from nmpcrl.claims.by_runs import AtMost, RunClaim, Values
from nmpcrl.claims.rule import Paths, arms, drawn_anew, median
from nmpcrl.claims.thresholds import BETTER, SAME_COST, cost_difference, cost_reduction, texts
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED
from nmpcrl.study.experiment import PAPER

WORDS = {REPRODUCED: "confirmed", PARTLY: "confirmed in part", NOT: "not confirmed"}


def _compared(
    name: str,
    threshold: float,
    learners: tuple[str, str],
    size: Callable[[pd.Series], pd.Series] = lambda difference: difference,
) -> RunClaim:
    """A claim that compares the final noise-free costs of two learners.

    The numbers are `size` of the cost of the first minus the second's, in shares of theta_init's,
    in the cells of our own learner.
    """
    first, second = learners
    ours = tuple(name for name in learners if name not in PAPER)

    def values(runs: pd.DataFrame, _: Paths) -> Values:
        difference = size(cost_difference(*arms(runs, first, second, among=ours)))
        return difference.astype(float).to_frame(f"{first} and {second}")

    return AtMost(
        **texts(name),
        threshold=threshold,
        learners=learners,
        measured="final noise-free costs, in shares of theta_init's",
        values=values,
        numbers=_numbers,
        label=f"noise-free cost, {first} - {second}",
        words=WORDS,
    )


def _numbers(runs: pd.DataFrame, _: Paths, learners: tuple[str, ...]) -> dict[str, Any]:
    """Probability of improvement and median reductions, of complete pairs; empty without any."""
    first, second = (median(cost_reduction(arm)) for arm in _pairs(runs, *learners))
    better = costs_less(runs, *learners)
    return {} if np.isnan(better.value) else {"better": better, "first": first, "second": second}


def costs_less(runs: pd.DataFrame, first: str, second: str) -> Estimate:
    """Probability that a run of the first learner costs less than one of the second in its layout.

    Runs without a counterpart do not count; without any pair the estimate is nan.
    """
    one, other = _pairs(runs, first, second)
    if one.empty:
        return Estimate(np.nan, np.nan, np.nan)
    ours, theirs = (arm.final_cost.to_numpy(float) for arm in (one, other))
    return probability_of_improvement(ours, theirs, [*one.index.get_level_values("layout")])


def costs_less_anew(runs: pd.DataFrame, first: str, second: str) -> Estimate:
    """As `costs_less`, with the interval for other layouts (see `rule.drawn_anew`)."""
    layouts = (of for _, of in runs[runs.learner.isin((first, second))].groupby("layout"))
    return drawn_anew(costs_less(one, first, second).value for one in layouts)


def _pairs(runs: pd.DataFrame, first: str, second: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The runs of two learners in the cells in which both are known."""
    one, other = arms(runs, first, second)
    known = one.stopped.notna() & other.stopped.notna()
    return one[known], other[known]


_CLAIMS = (
    _compared("B1", SAME_COST, ("TDC", "GES")),
    _compared("B2", -BETTER, ("ES", "random")),
    _compared("B3", SAME_COST, ("matched", "GES"), pd.Series.abs),
    _compared("B4", SAME_COST, ("QL", "ES")),
)
OWN_CLAIMS = {claim.name: claim for claim in _CLAIMS}

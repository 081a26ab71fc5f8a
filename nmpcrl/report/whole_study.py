"""How many runs of the whole study went wrong, from what is published."""

from collections.abc import Callable, Sequence

import pandas as pd

from nmpcrl.claims import evidence

EVERY = "all layouts"  # the last column of `went_wrong`


def main_table() -> pd.DataFrame:
    """The published runs of the main table, as `Evidence.runs` has them.

    Raises:
        Damaged: what is published is not there, or not what was written.
    """
    return evidence.gather("published").main.runs


def went_wrong(wrong: Callable[[pd.DataFrame], pd.Series], learners: Sequence[str]) -> pd.DataFrame:
    """In how many runs of the published main table each learner went wrong.

    Args:
        wrong: which runs of a table did: `thresholds.divergence` or `instability`.
        learners: of which each has as many runs.

    Returns:
        A row a reading of the decay and learner, a column a layout, and then `EVERY` and runs: how
        many of each learner there are in a reading.

    Raises:
        Damaged: what is published is not there, or not what was written.
    """
    runs = main_table()
    runs = runs[runs.learner.isin(learners)]
    cells = runs.assign(wrong=wrong(runs)).groupby(["decay", "learner"], sort=False)
    counts = cells.apply(lambda of: of.groupby("layout").wrong.sum(), include_groups=False)
    order = [(decay, name) for decay in runs.decay.unique() for name in learners]
    found = counts.astype(int).loc[order]
    found.columns.name = None
    return found.assign(**{EVERY: found.sum(axis=1), "runs": cells.size()})

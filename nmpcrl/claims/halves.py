"""What a claim about two learners says of each, counted by itself in each reading of the decay.

"DES diverges and RDES does not" joins two statements, and one share of pairs cannot tell which of
them fails. Only pairs that differ, in which one of the two went wrong and the other did not, tell
the learners apart: in `against` of these `apart` the claim is the wrong way round.
"""

from collections.abc import Mapping

import pandas as pd

from nmpcrl.claims.verdict import Halves


def halves(
    learners: tuple[str, str], values: pd.DataFrame, borders: Mapping[str, float]
) -> tuple[Halves, ...]:
    """Both halves of a claim in each reading of the decay, by the claim's own measure first.

    Args:
        learners: the claim says that the first goes wrong, and the second does not.
        values: a number of each run, a column a learner, indexed by layout, decay and seed.
        borders: what counts as going wrong, in words, and above which number a run does; the
            claim's own first.
    """
    known = values.dropna()
    readings = known.index.get_level_values("decay")
    return tuple(
        _count(learners, wrong, str(decay), known[readings == decay] > border)
        for wrong, border in borders.items()
        for decay in readings.unique()
    )


def _count(learners: tuple[str, str], wrong: str, decay: str, bad: pd.DataFrame) -> Halves:
    first, second = (bad[name].astype(bool) for name in learners)
    counts = int(first.sum()), int(second.sum())
    against, apart = int((second & ~first).sum()), int((first != second).sum())
    return Halves(learners, wrong, decay, len(bad), counts, against, apart)

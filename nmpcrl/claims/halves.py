"""What a claim about two learners says of each, and where the runs go with it or against it.

"DES diverges and RDES does not" joins two statements, and one share of pairs cannot tell which of
them fails. So both are counted, in each reading of the decay and in each layout. Only pairs that
differ, in which one of the two went wrong and the other did not, tell the learners apart. Where the
interval of the share of these that go with the claim lies above `rule.MAJORITY`, what was seen is
as claimed, and where that of those that go against it does, it is the reverse of the claim. That
rule is the one for a majority, and was fixed with it; that it is asked of single cells as well was
decided after the study had been seen, and with a dozen cells a claim an interval is not corrected
for being the most striking of them.
"""

from collections.abc import Callable, Iterator, Mapping
from itertools import groupby

import pandas as pd

from nmpcrl.analysis.statistics import rate
from nmpcrl.claims.rule import MAJORITY
from nmpcrl.claims.verdict import WHOLE, Halves


def halves(
    learners: tuple[str, str], values: pd.DataFrame, borders: Mapping[str, float]
) -> list[Halves]:
    """Both halves of a claim in each reading of the decay, over all layouts and in each.

    Args:
        learners: the claim says that the first goes wrong, and the second does not.
        values: a number of each run, a column a learner, indexed by layout, decay and seed.
        borders: what counts as going wrong, in words, and above which number a run does.
    """
    known = values.dropna()
    readings, places = (known.index.get_level_values(name) for name in ("decay", "layout"))
    return [
        _count(learners, wrong, decay, layout, known[chosen] > border)
        for wrong, border in borders.items()
        for decay in readings.unique()
        for layout, chosen in [
            (WHOLE, readings == decay),
            *((one, (readings == decay) & (places == one)) for one in places.unique()),
        ]
    ]


def _count(
    learners: tuple[str, str], wrong: str, decay: str, layout: str, bad: pd.DataFrame
) -> Halves:
    first, second = (bad[name].astype(bool) for name in learners)
    return Halves(
        learners,
        wrong,
        decay,
        (layout,),
        len(bad),
        (int(first.sum()), int(second.sum())),
        int((second & ~first).sum()),
        int((first != second).sum()),
    )


def reversals(found: list[Halves]) -> Iterator[Halves]:
    """Where the reverse of the claim was seen: in a whole reading, else its layouts together."""
    return _clear(found, lambda one: _most(one.against, one.apart))


def confirmations(found: list[Halves]) -> Iterator[Halves]:
    """Where the two were seen to differ as claimed, likewise."""
    return _clear(found, lambda one: _most(one.apart - one.against, one.apart))


def _clear(found: list[Halves], clear: Callable[[Halves], bool]) -> Iterator[Halves]:
    for _, group in groupby(found, key=lambda one: (one.wrong, one.decay)):
        reading, *layouts = group
        some = [one for one in layouts if clear(one)]
        if clear(reading):
            yield reading
        elif some:
            yield sum(some[1:], some[0])


def _most(some: int, of: int) -> bool:
    return of > 0 and rate(some, of).low > MAJORITY

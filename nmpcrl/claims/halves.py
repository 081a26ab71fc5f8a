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

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby

import pandas as pd

from nmpcrl.analysis.statistics import rate
from nmpcrl.claims.rule import MAJORITY

WHOLE = "all"  # in the place of a layout


@dataclass(frozen=True)
class Halves:
    """In how many runs each of two learners went wrong, in one reading of the decay."""

    learners: tuple[str, str]  # the claim says that the first goes wrong, and the second does not
    wrong: str  # how: "diverged"
    decay: str
    layouts: tuple[str, ...]  # (`WHOLE`,) for all of them together
    pairs: int  # of which both answers are known
    counts: tuple[int, int]  # of the first and of the second
    against: int  # pairs in which only the second went wrong
    apart: int  # pairs in which only one of them did

    @property
    def reversed(self) -> bool:
        """Whether this is the reverse of what is claimed."""
        return _most(self.against, self.apart)

    @property
    def as_claimed(self) -> bool:
        """Whether the two differ in the way that is claimed."""
        return _most(self.apart - self.against, self.apart)

    def __add__(self, other: "Halves") -> "Halves":
        """Two cells of one reading together."""
        first, second = (a + b for a, b in zip(self.counts, other.counts, strict=True))
        return Halves(
            self.learners,
            self.wrong,
            self.decay,
            self.layouts + other.layouts,
            self.pairs + other.pairs,
            (first, second),
            self.against + other.against,
            self.apart + other.apart,
        )


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
    return _clear(found, lambda one: one.reversed)


def confirmations(found: list[Halves]) -> Iterator[Halves]:
    """Where the two were seen to differ as claimed, likewise."""
    return _clear(found, lambda one: one.as_claimed)


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


def counted(found: Iterable[Halves]) -> str:
    """How often each learner went wrong in each reading, in a sentence a way of going wrong."""
    wholes = [one for one in found if one.layouts == (WHOLE,)]
    return " ".join(
        _counted(list(group)) for _, group in groupby(wholes, key=lambda one: one.wrong)
    )


def _counted(readings: list[Halves]) -> str:
    first, second = readings[0].learners
    parts = [
        f"with noise that decays per {one.decay} in {one.counts[0]} of {one.pairs} runs of {first}"
        f" and {one.counts[1]} of {second}"
        for one in readings
    ]
    return f"{readings[0].wrong.capitalize()}: {', '.join(parts)}."


def sentence(found: Halves) -> str:
    """How the two differ where that is clear, with the counts and the interval."""
    first, second = found.learners
    one, other = found.counts
    seen, going = "as claimed", found.apart - found.against
    if found.reversed:
        first, second, one, other = second, first, other, one
        seen, going = "the reverse was seen", found.against
    several = "s" if len(found.layouts) > 1 else ""
    where = (
        "" if found.layouts == (WHOLE,) else f", in layout{several} {' and '.join(found.layouts)}"
    )
    return (
        f"With noise that decays per {found.decay}{where}, {seen}: {first} {found.wrong} in"
        f" {one} of {found.pairs} runs and {second} in {other} ({going} of {found.apart} pairs that"
        f" differ: {rate(going, found.apart):.0%})."
    )


def readings(sentences: Iterable[str]) -> tuple[str, ...]:
    """The readings of the decay of which sentences of `sentence` are, each once."""
    named = (re.match(r"With noise that decays per (\w+)", one) for one in sentences)
    return tuple(dict.fromkeys(found[1] for found in named if found))

"""The outcome of a claim and the numbers behind it, as data."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from nmpcrl.analysis.statistics import paired_p, rate


class Outcome(StrEnum):
    """The outcome of a claim or of a question."""

    REPRODUCED = "reproduced"
    PARTLY = "partly reproduced"
    NOT = "not reproduced"
    UNDECIDABLE = "not decidable here"


REPRODUCED, PARTLY, NOT, UNDECIDABLE = Outcome


def differ(first: Outcome, second: Outcome) -> bool:
    """Whether both outcomes are decided, and differ."""
    return UNDECIDABLE not in (first, second) and first != second


@dataclass(frozen=True, eq=False)
class Assumption:
    """One assumption of the theorems behind C8, beside the algorithm that is run."""

    theorem: str  #: the assumption
    here: str  #: the paper's algorithm, with a measurement where one is possible
    holds: bool
    by: tuple[str, ...] = ()  #: the theorems that make it, by their names in `assumptions.THEOREMS`


@dataclass(frozen=True)
class Halves:
    """How many runs of two learners went wrong, in one reading of the decay."""

    learners: tuple[str, str]  #: by the claim the first goes wrong, and the second does not
    wrong: str  #: how, "diverged"
    decay: str
    pairs: int  #: with two known answers
    counts: tuple[int, int]  #: runs of the first and of the second that went wrong
    against: int  #: pairs in which only the second went wrong
    apart: int  #: pairs in which only one of them did

    @property
    def as_claimed(self) -> int:
        """Pairs in which only the first went wrong."""
        return self.apart - self.against

    @property
    def p(self) -> float:
        """The probability of so uneven a split if both go wrong as often (McNemar's test)."""
        return paired_p(self.as_claimed, self.against)


@dataclass(frozen=True)
class Verdict:
    """The verdict on one claim."""

    claim: str  #: "C1"
    statement: str
    outcome: Outcome
    would_change: str = ""  #: where another verdict is expected
    share: float | None = None  #: of yes; None for a claim that asks no runs
    interval: tuple[float, float] | None = None  #: of the share with any missing answers; or ratio
    by_layout: dict[str, Outcome] = field(default_factory=dict)
    by_decay: dict[str, Outcome] = field(default_factory=dict)
    counts: dict[str, tuple[int, int]] = field(default_factory=dict)  #: yes, answers, "all", "A"
    by_learner: dict[str, tuple[int, int]] = field(default_factory=dict)  #: of the weaker question
    missing: int = 0  #: answers
    unit: str = "pairs"  #: of answers
    levels: dict[str, int] = field(default_factory=dict)  #: how many layouts, seeds and so on
    ratio: float | None = None  #: of times, for a claim about time
    halves: tuple[Halves, ...] = ()  #: of a claim that joins two statements
    numbers: Mapping[str, Any] = field(default_factory=dict)  #: further ones, by name
    assumptions: tuple[Assumption, ...] = ()  #: of a claim that rests on a theorem
    said: str = ""  #: the outcome in the claim's own words, if it has any

    @property
    def words(self) -> str:
        """The outcome as a page shows it."""
        return self.said or str(self.outcome)

    @property
    def own_halves(self) -> tuple[Halves, ...]:
        """The halves by the claim's own measure, for each decay of the noise."""
        return tuple(one for one in self.halves if one.wrong == self.halves[0].wrong)

    @property
    def turns(self) -> bool:
        """Whether the decay of the noise reverses a claim of two halves.

        With one decay surely more than half of the pairs that differ go as claimed (by `rate`);
        with another, more pairs go against the claim.
        """
        split = [one for one in self.own_halves if one.apart]
        sure = any(rate(one.as_claimed, one.apart).low > 0.5 for one in split)
        return sure and any(one.against > one.as_claimed for one in split)

    def differs_by(self, field: str) -> bool:
        """Whether the decided outcomes differ between the values of "layout" or of "decay"."""
        outcomes = {"layout": self.by_layout, "decay": self.by_decay}[field]
        return len({*outcomes.values()} - {UNDECIDABLE}) > 1

    def depends_on(self, field: str) -> bool:
        """Whether the outcome differs by layout, or by the decay, or `turns` with the decay."""
        return self.differs_by(field) or (field == "decay" and self.turns)

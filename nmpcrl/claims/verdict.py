"""What became of a claim, as data; the sentences about it are made in `report`."""

from dataclasses import dataclass, field
from enum import StrEnum

from nmpcrl.analysis.statistics import paired_p, rate


class Outcome(StrEnum):
    """What becomes of a claim."""

    REPRODUCED = "reproduced"
    PARTLY = "partly reproduced"
    NOT = "not reproduced"
    UNDECIDABLE = "not decidable here"


REPRODUCED, PARTLY, NOT, UNDECIDABLE = Outcome


def differ(first: Outcome, second: Outcome) -> bool:
    """Whether both are decided, and differently."""
    return UNDECIDABLE not in (first, second) and first != second


@dataclass(frozen=True)
class Halves:
    """In how many runs each of two learners went wrong, in one reading of the decay."""

    learners: tuple[str, str]  # the claim says that the first goes wrong, and the second does not
    wrong: str  # how: "diverged"
    decay: str
    pairs: int  # of which both answers are known
    counts: tuple[int, int]  # of the first and of the second
    against: int  # pairs in which only the second went wrong
    apart: int  # pairs in which only one of them did

    @property
    def as_claimed(self) -> int:
        """Pairs in which only the first went wrong."""
        return self.apart - self.against

    @property
    def p(self) -> float:
        """How likely pairs split as far by chance if both go wrong as often, by McNemar's test."""
        return paired_p(self.as_claimed, self.against)


@dataclass(frozen=True)
class Verdict:
    """What became of one claim."""

    claim: str  # "C1"
    statement: str  # what the paper says
    outcome: Outcome
    evidence: str  # the numbers
    would_change: str  # where another verdict is to be expected
    share: float | None = None  # of the answers, how many are yes; None where no run is asked
    interval: tuple[float, float] | None = None  # of the share, whatever the missing say; or ratio
    by_layout: dict[str, Outcome] = field(default_factory=dict)  # the outcome in each
    by_decay: dict[str, Outcome] = field(default_factory=dict)  # and in each reading of the decay
    counts: dict[str, tuple[int, int]] = field(default_factory=dict)  # yes of answers: "all", "A"
    ratio: float | None = None  # of times, where the claim is about time
    each: str = ""  # what a claim on several learners comes to for each of them
    halves: tuple[Halves, ...] = ()  # of a claim that joins two statements; see `claims.halves`
    said: str = ""  # the outcome in the claim's own words, where it has any

    @property
    def words(self) -> str:
        """The outcome as a page says it."""
        return self.said or str(self.outcome)

    @property
    def own_halves(self) -> tuple[Halves, ...]:
        """The halves by the claim's own measure, in each reading."""
        return tuple(one for one in self.halves if one.wrong == self.halves[0].wrong)

    @property
    def turns(self) -> bool:
        """Whether most pairs that differ go as claimed in one reading, and not in another.

        "Most" is sure (`rate` above one half) in the one; in the other more go against the claim.
        """
        there = [one for one in self.own_halves if one.apart]
        sure = any(rate(one.as_claimed, one.apart).low > 0.5 for one in there)
        return sure and any(one.against > one.as_claimed for one in there)

    def differs_by(self, field: str) -> bool:
        """Whether not all layouts, or readings of the decay, have the same decided outcome.

        Args:
            field: "layout" or "decay".
        """
        outcomes = {"layout": self.by_layout, "decay": self.by_decay}[field]
        return len({*outcomes.values()} - {UNDECIDABLE}) > 1

    def depends_on(self, field: str) -> bool:
        """Whether it differs by layout; or by the reading of the decay, or `turns` with it."""
        return self.differs_by(field) or (field == "decay" and self.turns)

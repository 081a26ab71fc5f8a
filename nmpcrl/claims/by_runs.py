"""Claims that runs decide: a threshold divides the numbers of runs, or pairs, into yes and no.

Three classes ask three questions of the numbers. The answer is missing where the number is nan.
"""

import operator
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import astuple, dataclass, field, replace
from typing import Any, ClassVar, TypeAlias

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.statistics import rate
from nmpcrl.claims.rule import Claim, Observations, Paths, arms, read, settle
from nmpcrl.claims.verdict import Halves, Verdict

# One row a cell of layout, decay and seed, one column an arm; nan is unknown.
Values: TypeAlias = pd.DataFrame
Number: TypeAlias = Callable[[pd.DataFrame], pd.Series]  # of each of one learner's runs


@dataclass(frozen=True, kw_only=True, eq=False)
class RunClaim(Claim):
    """A claim that runs decide, by `number` of each learner's runs, or by `values` of all runs."""

    number: Number | None = None
    values: Callable[[pd.DataFrame, Paths], Values] | None = None
    among: tuple[str, ...] = ()  #: the learners whose cells are covered; by default `learners`
    threshold: float  #: where yes ends
    besides: Number | None = None  #: counts that must be 0; the weaker question omits them
    numbers: Callable[[pd.DataFrame, Paths, tuple[str, ...]], Mapping[str, Any]] | None = None
    unit: str = "pairs"  #: of answers, in the plural
    nothing: float = 0.0  #: the number of a run without the effect
    short: str = ""  #: the statement in the head of a column
    label: str = ""  #: of the axis with the numbers
    borders: Vector = field(default_factory=lambda: np.empty(0))  #: others, for `at_borders`
    holds: ClassVar[Callable[..., Any]] = operator.le  #: of a number and a border, is it yes?

    def yes(self, values: Values, border: float) -> pd.Series:
        """The answers to these numbers at a border: True, False or missing."""
        numbers = _long(values)
        return _known(self.holds(numbers, border), numbers)

    def measure(self, runs: pd.DataFrame, paths: Paths) -> Values:
        """The numbers that the claim asks about."""
        if self.values:
            return self.values(runs, paths)
        assert self.number
        return self._of_each(self.number, runs)

    def answers(self, values: Values, border: float | None = None) -> pd.Series:
        """The known answers, at the claim's own border or at another one."""
        return self.yes(values, self.threshold if border is None else border).dropna().astype(bool)

    def judge(self, observed: Observations) -> Verdict:
        """The verdict, by the rule of `rule`, with further numbers."""
        further = self.numbers and self.numbers(observed.runs, observed.paths, self.learners)
        return replace(self.settled(observed), numbers=further or {})

    def settled(self, observed: Observations) -> Verdict:
        """The verdict without the further numbers, which take longer."""
        return settle(self, *self.asked(observed), unit=self.unit)

    def asked(self, observed: Observations) -> tuple[pd.Series, pd.Series]:
        """The answers to the claim's question, and to its weaker one (else the same)."""
        answers = self.yes(self.measure(observed.runs, observed.paths), self.threshold)
        if not self.besides:
            return answers, answers
        counts = _long(self._of_each(self.besides, observed.runs))
        return answers & _known(counts == 0, counts), answers

    def at_borders(self, values: Values, borders: Iterable[float]) -> pd.DataFrame:
        """The outcome of the known answers at other borders, by `rule.read`; no row without any.

        Columns border, share (of yes), low and high (ends of its interval) and outcome.
        """
        rows = []
        for border in borders:
            answers = self.answers(values, border)
            if len(answers):
                count = int(answers.sum()), len(answers)
                rows.append((border, *astuple(rate(*count)), read(*count)))
        names = ["border", "share", "low", "high"]
        return pd.DataFrame(rows, columns=[*names, "outcome"]).astype(dict.fromkeys(names, float))

    def steady(self, values: Values) -> bool:
        """Whether the outcome is the same with a border half and twice as far from `nothing`."""
        around = self.nothing + (self.threshold - self.nothing) * np.array([0.5, 1.0, 2.0])
        return bool(self.at_borders(values, around).outcome.nunique() <= 1)

    def _of_each(self, number: Number, runs: pd.DataFrame) -> Values:
        found = arms(runs, *self.learners, among=self.among)
        named = zip(self.learners, found, strict=True)
        return pd.DataFrame({name: number(arm).astype(float) for name, arm in named})


class AtMost(RunClaim):
    """Is each number at most the border?"""


class AtLeast(RunClaim):
    """Is each number at least the border?"""

    holds = operator.ge


@dataclass(frozen=True, kw_only=True, eq=False)
class Contrast(RunClaim):
    """Is the first number of each pair above the border, and the second not?"""

    wrong: str  #: of a run above the border, "diverged"
    worst: str  #: of a run whose number is infinite

    def judge(self, observed: Observations) -> Verdict:
        """See `RunClaim.judge`; each half of the claim is counted, too."""
        values = self.measure(observed.runs, observed.paths)
        return replace(super().judge(observed), halves=tuple(self.split(values)))

    def split(self, values: Values) -> Iterator[Halves]:
        """Both halves for each decay of the noise, by the claim's own border and then `worst`."""
        learners = self.learners[0], self.learners[1]
        for wrong, border in ((self.wrong, self.threshold), (self.worst, np.finfo(float).max)):
            for decay, known in values.dropna().groupby(level="decay", sort=False):
                first, second = (known[name] > border for name in learners)
                counts = int(first.sum()), int(second.sum())
                against, apart = int((second & ~first).sum()), int((first != second).sum())
                yield Halves(learners, wrong, str(decay), len(known), counts, against, apart)

    def yes(self, values: Values, border: float) -> pd.Series:
        """See `RunClaim.yes`."""
        first, second = (values[name] for name in values)
        return _known((first > border) & (second <= border), first.where(second.notna()))


def _long(values: Values) -> pd.Series:
    """One column below the other."""
    return pd.concat({name: values[name] for name in values}, names=["learner"])


def _known(holds: pd.Series, numbers: pd.Series) -> pd.Series:
    """Answers that are missing where a number is unknown."""
    return holds.astype("boolean").where(numbers.notna())

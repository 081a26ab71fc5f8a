"""Claims that runs decide: each run, or pair of runs, has a number, and a border ends the yes.

Three questions are asked of numbers, a class each. The number of a run that is missing, or of which
it is not known, is nan, and so is the answer missing.
"""

from abc import abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
import pandas as pd

from nmpcrl import Vector
from nmpcrl.analysis.statistics import rate
from nmpcrl.claims.halves import halves
from nmpcrl.claims.rule import Claim, Observations, Paths, arms, read, settle
from nmpcrl.claims.verdict import Verdict

# One row a cell of layout, decay and seed, one column an arm; nan is unknown.
Values: TypeAlias = pd.DataFrame
Measure: TypeAlias = Callable[[pd.DataFrame, Paths], Values]


@dataclass(frozen=True, kw_only=True, eq=False)
class RunClaim(Claim):
    """A claim that runs decide."""

    measure: Measure  # the numbers behind it: runs and paths to values
    threshold: float  # where yes ends
    evidence: Callable[[pd.DataFrame, Paths], str]  # what the numbers are, in sentences
    besides: Measure | None = None  # counts that have to be 0; the weaker question forgives them
    each: Callable[[pd.DataFrame, Paths], str] | None = None  # and for each learner
    unit: str = "pairs"  # what is asked, in the plural
    nothing: float = 0.0  # the number of a run in which nothing is to be seen
    short: str = ""  # statement for the head of a column
    label: str = ""  # of the axis on which the numbers are drawn
    linear_to: float = 0.0  # up to this size they are drawn on a linear axis, above on a log one
    borders: Vector = field(default_factory=lambda: np.empty(0))  # at which it is decided once more

    @abstractmethod
    def yes(self, values: Values, border: float) -> pd.Series:
        """The answers that these numbers give with a border: True, False or missing."""

    def answers(self, values: Values, border: float | None = None) -> pd.Series:
        """The answers that are known, with another border than the claim's if one is given."""
        return self.yes(values, self.threshold if border is None else border).dropna().astype(bool)

    def judge(self, observed: Observations) -> Verdict:
        """The verdict, by the rule of `rule`."""
        found = (observed.runs, observed.paths)
        verdict = self.settled(observed, self.evidence(*found))
        return replace(verdict, each=self.each(*found) if self.each else "")

    def settled(self, observed: Observations, evidence: str = "") -> Verdict:
        """The verdict with its counts, without what else `judge` says of it, which takes longer."""
        answers, weaker = self.asked(observed)
        return settle(self, answers, evidence, weaker=weaker, unit=self.unit)

    def asked(self, observed: Observations) -> tuple[pd.Series, pd.Series]:
        """The answers to the claim's question, and to the weaker one, if it has one: else twice."""
        found = (observed.runs, observed.paths)
        answers = self.yes(self.measure(*found), self.threshold)
        if not self.besides:
            return answers, answers
        counts = _long(self.besides(*found))
        return answers & _known(counts == 0, counts), answers

    def at_borders(self, values: Values, borders: Iterable[float]) -> pd.DataFrame:
        """What would become of the claim at other borders than its own, which stays where it is.

        Returns:
            Columns border, share (of yes), low and high (its interval) and outcome, by `rule.read`
            for the answers that are known; no row where none is.
        """
        rows = []
        for border in borders:
            answers = self.answers(values, border)
            if len(answers):
                yes, of = int(answers.sum()), len(answers)
                share = rate(yes, of)
                rows.append((border, share.value, share.low, share.high, read(yes, of)))
        names = ["border", "share", "low", "high"]
        return pd.DataFrame(rows, columns=[*names, "outcome"]).astype(dict.fromkeys(names, float))

    def steady(self, values: Values) -> bool:
        """Whether the verdict stays with a border half and twice as far from nothing."""
        far = self.threshold - self.nothing
        around = self.nothing + far * np.array([0.5, 1.0, 2.0])
        result: bool = self.at_borders(values, around).outcome.nunique() <= 1
        return result


class AtMost(RunClaim):
    """Asked of each number: is it at most the border?"""

    def yes(self, values: Values, border: float) -> pd.Series:
        """See `RunClaim.yes`."""
        numbers = _long(values)
        return _known(numbers <= border, numbers)


class AtLeast(RunClaim):
    """Asked of each number: is it at least the border?"""

    def yes(self, values: Values, border: float) -> pd.Series:
        """See `RunClaim.yes`."""
        numbers = _long(values)
        return _known(numbers >= border, numbers)


@dataclass(frozen=True, kw_only=True, eq=False)
class Contrast(RunClaim):
    """Asked of each pair of numbers: is the first above the border, and the second not?"""

    wrong: str  # what a run above the border did
    worst: str  # and one whose number is infinite

    def judge(self, observed: Observations) -> Verdict:
        """See `RunClaim.judge`; both halves of the claim are counted, too."""
        first, second = self.learners
        borders = {self.wrong: self.threshold, self.worst: np.finfo(float).max}
        values = self.measure(observed.runs, observed.paths)
        found = halves((first, second), values, borders)
        return replace(super().judge(observed), halves=found)

    def yes(self, values: Values, border: float) -> pd.Series:
        """See `RunClaim.yes`."""
        first, second = (values[name] for name in values)
        return _known((first > border) & (second <= border), first.where(second.notna()))


def beside(
    runs: pd.DataFrame,
    learners: tuple[str, ...],
    number: Callable[[pd.DataFrame], pd.Series],
    *,
    among: tuple[str, ...] = (),
) -> Values:
    """A number of each learner's runs, side by side; `among` as `arms` takes it."""
    found = arms(runs, *learners, among=among)
    return pd.DataFrame(
        {name: number(arm).astype(float) for name, arm in zip(learners, found, strict=True)}
    )


def _long(values: Values) -> pd.Series:
    """One column below the other."""
    return pd.concat({name: values[name] for name in values}, names=["learner"])


def _known(holds: pd.Series, numbers: pd.Series) -> pd.Series:
    """Answers that are missing where a number is not known."""
    return holds.astype("boolean").where(numbers.notna())

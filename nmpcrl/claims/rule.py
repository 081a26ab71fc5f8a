"""How the answers of many runs become a verdict.

A claim asks each run, or each pair of runs with the same layout, decay and seed, one question with
the answer yes or no. One rule reads the share of yes. It was fixed before any claim was tested on
the study, and stays as it is:

- reproduced: the interval of the share lies above `MAJORITY`, and the share is at least
  `NEARLY_ALL`;
- not reproduced: the interval lies below `MAJORITY`, and the share is at most `NEARLY_NONE`;
- not decidable: the runs are so few that even one answer from all of them would leave `MAJORITY`
  inside the interval, or the missing answers would decide;
- partly reproduced: all else, so that it depends on layout, decay or seed whether the claim holds.

- a claim with a weaker question, which a yes to the first implies, is partly reproduced where it
  would not be reproduced and the weaker question is not "not reproduced" (C7 and W7).

The interval alone is not enough: of 1000 runs, 55 % are surely more than half, and surely not what
"DES diverges" says. Nor is the share alone: two of two runs are all runs. The interval is Wilson's,
for other seeds in the same layouts (see `statistics.rate`); for other layouts see `drawn_anew`.

An answer is missing if the run was not made, is shorter than the paper's, or has no run with theta
frozen for comparison. If missing answers could change the verdict, the claim is undecidable.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import Estimate, over_layouts, rate
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Assumption, Outcome, Verdict
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Column, Stopped

MAJORITY = 0.5
NEARLY_ALL = 0.9
NEARLY_NONE = 0.1
FEWEST_LAYOUTS = 5  # of an interval for other layouts

CELL = ["layout", "decay", "seed"]  # equal in two runs that are compared

Paths: TypeAlias = Mapping[Experiment, Column]  # the states of each run's last rollout


@dataclass(frozen=True, eq=False)
class Observations:
    """The data that claims are judged by; each claim takes a part."""

    runs: pd.DataFrame = field(default_factory=pd.DataFrame)  #: of `rows.table`
    paths: Paths = field(default_factory=dict)
    timings: pd.DataFrame = field(default_factory=pd.DataFrame)  #: of `time_learners`
    assumptions: tuple[Assumption, ...] = ()  #: of `audit`


@dataclass(frozen=True, kw_only=True, eq=False)
class Claim(ABC):
    """A statement of the paper, or of this book, and how it is decided."""

    name: str  #: "C1"
    statement: str
    question: str
    measured: str  #: the numbers that answer the question, in words
    border: str  #: where yes ends, in words
    test: str = "share of yes, with its interval"
    would_change: str  #: where another verdict is expected
    learners: tuple[str, ...] = ()  #: whose runs answer, in the order of the question
    quotation: str = ""  #: the paper's sentences behind it, in Markdown
    implied: bool = False  #: whether the paper implies it, and nowhere says it
    words: Mapping[Outcome, str] = field(default_factory=dict)  #: for outcomes with own words

    @abstractmethod
    def judge(self, observed: Observations) -> Verdict:
        """The verdict on these observations."""

    def verdict(self, outcome: Outcome, **numbers: Any) -> Verdict:
        """A verdict on this claim; `numbers` are further fields of `Verdict`."""
        said = self.words.get(outcome, "")
        return Verdict(self.name, self.statement, outcome, self.would_change, said=said, **numbers)


def judge(claims: Mapping[str, Claim], *observed: Any, **further: Any) -> tuple[Verdict, ...]:
    """The verdicts on claims, in order; the other arguments make the `Observations`."""
    known = Observations(*observed, **further)
    return tuple(claim.judge(known) for claim in claims.values())


@dataclass(frozen=True)
class Answers:
    """The counts of yes, of no, and of missing answers."""

    yes: int
    no: int
    missing: int = 0

    @property
    def known(self) -> tuple[int, int]:
        """Yes, and all answers."""
        return self.yes, self.yes + self.no

    @property
    def outcome(self) -> Outcome:
        """The outcome by the rule; undecidable if missing answers could change it."""
        asked = self.yes + self.no + self.missing
        least, most = read(self.yes, asked), read(self.yes + self.missing, asked)
        return least if least == most else UNDECIDABLE

    @property
    def share(self) -> Estimate | None:
        """Share of yes among the answers; its interval covers all values of the missing ones."""
        yes, answered = self.known
        if not answered:
            return None
        asked = answered + self.missing
        return Estimate(yes / answered, rate(yes, asked).low, rate(yes + self.missing, asked).high)


def read(yes: int, of: int) -> Outcome:
    """The outcome by the rule for `yes` of `of` answers, with none missing."""
    if not of or rate(of, of).low <= MAJORITY:
        return UNDECIDABLE
    share = rate(yes, of)
    if share.low > MAJORITY and share.value >= NEARLY_ALL:
        return REPRODUCED
    if share.high < MAJORITY and share.value <= NEARLY_NONE:
        return NOT
    return PARTLY


def forgiving(strict: Outcome, weaker: Outcome) -> Outcome:
    """The outcome of a claim whose weaker question has an outcome of its own."""
    if strict != NOT:
        return strict
    return weaker if weaker in (NOT, UNDECIDABLE) else PARTLY


def counted(answers: pd.Series, level: str = "") -> dict[str, Answers]:
    """The answers by value of a level of their index, in order of appearance, or as "all"."""
    known = answers.astype("boolean")
    groups = known.groupby(level=level, sort=False) if level else (("all", known),)
    return {
        str(name): Answers(int(one.sum()), int((~one).sum()), int(one.isna().sum()))
        for name, one in groups
    }


def settle(
    claim: Claim, answers: pd.Series, weaker: pd.Series | None = None, unit: str = "pairs"
) -> Verdict:
    """The verdict on a claim, overall, in each layout and for each decay of the noise.

    Answers are True, False or missing, indexed by layout, decay, seed or by other levels; `weaker`
    are those to a weaker question, which a yes to the first implies.
    """
    names = [*map(str, answers.index.names)]
    lenient = answers if weaker is None else weaker
    counts, outcomes = dict[str, Answers](), dict[str, dict[str, Outcome]]()
    for level in ("", *(name for name in ("layout", "decay") if name in names)):
        counts |= (strict := counted(answers, level))
        outcomes[level] = {
            name: forgiving(strict[name].outcome, one.outcome)
            for name, one in counted(lenient, level).items()
        }
    share = counts["all"].share
    by_learner = counted(lenient, "learner") if "learner" in names else {}
    return claim.verdict(
        outcomes[""]["all"],
        share=share.value if share else None,
        interval=(share.low, share.high) if share else None,
        by_layout=outcomes.get("layout", {}),
        by_decay=outcomes.get("decay", {}),
        counts={name: one.known for name, one in counts.items()},
        by_learner={name: one.known for name, one in by_learner.items() if one.known[1]},
        missing=counts["all"].missing,
        unit=unit,
        levels={
            name: answers.index.unique(name).size
            for name in (CELL if {*CELL} <= {*names} else names)
            if name != "learner"
        },
    )


def drawn_anew(values: Iterable[float]) -> Estimate:
    """The mean of one value a layout, with the interval of 95 % for other layouts.

    The bootstrap draws layouts. Where all values are 0, or all 1, it would have no width, and the
    interval is Wilson's of as many layouts. Below `FEWEST_LAYOUTS` the bounds are nan.
    """
    known = np.array([*values], float)
    value = float(known.mean()) if known.size else np.nan
    if known.size < FEWEST_LAYOUTS:
        return Estimate(value, np.nan, np.nan)
    if np.ptp(known) == 0 and value in (0, 1):
        return rate(int(known.sum()), known.size)
    return over_layouts(partial(np.mean, axis=-1), known)


def anew(verdict: Verdict) -> Estimate:
    """The share of yes with the interval of `drawn_anew`; nan where no layout was asked."""
    counts = [verdict.counts[name] for name in verdict.by_layout]
    return drawn_anew(yes / of for yes, of in counts if of)


def arms(
    runs: pd.DataFrame, *learners: str, among: tuple[str, ...] = ()
) -> tuple[pd.DataFrame, ...]:
    """The runs of each learner, in the same order of layout, decay and seed.

    A run that is missing, or shorter than the paper's, is a row of nan. One that was stopped left
    no policy, so its final cost is infinite. `runs` are of `rows.table`, all of one setting. The
    cells are the ones of the learners in `among`, by default of `learners`.
    """
    asked = runs[runs.learner.isin(among or learners)]
    cells = pd.MultiIndex.from_frame(asked[CELL].drop_duplicates())
    return tuple(_arm(runs, learner).reindex(cells) for learner in learners)


def _arm(runs: pd.DataFrame, learner: str) -> pd.DataFrame:
    full = runs[(runs.learner == learner) & (runs.episodes >= paper.EPISODES)].set_index(CELL)
    twice = full.index[full.index.duplicated()]
    if len(twice):
        cell = ", ".join(f"{n} {value}" for n, value in zip(CELL, twice[0], strict=True))
        raise ValueError(
            f"{learner} has several runs in {cell}: judge the runs of one setting at a time"
        )
    return full.assign(final_cost=full.final_cost.where(full.stopped == Stopped.FINISHED, np.inf))


def median(values: Iterable[float]) -> float:
    """The median of the known values; nan without any."""
    known = np.array([value for value in values if not np.isnan(value)])
    return float(np.median(known)) if known.size else np.nan

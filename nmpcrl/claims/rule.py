"""How a claim is put to many runs, and how their answers become a verdict.

A claim is put to each run, or to each pair of runs with the same layout, decay and seed, as a
question with the answer yes or no. The share of yes is then read by one rule. It was fixed before
any claim was put to the study, and is not to be moved after:

- reproduced: the interval of the share lies above `MAJORITY`, and the share is at least
  `NEARLY_ALL`;
- not reproduced: the interval lies below `MAJORITY`, and the share is at most `NEARLY_NONE`;
- not decidable: so few runs were asked that even one answer from all of them would leave the
  interval about `MAJORITY`, or the answers that are missing would decide;
- partly reproduced: all else, so that it depends on layout, decay or seed whether the claim holds.

- a claim with a weaker question, which a yes to the first implies, is partly reproduced where it
  would not be reproduced and the weaker question is not "not reproduced" (C7 and W7).

The interval alone would not do: of 1000 runs, 55 % are surely more than half, and surely not what
"DES diverges" says. Nor would the share alone: two of two runs are all there are. The interval is
Wilson's, over all layouts too: it is for other seeds in the same layouts, where it is not too
narrow (see `statistics.rate`). What other layouts would say is another question: see `drawn_anew`.

What is missing (a run that was not made, or is shorter than the paper's, or has no frozen arm to be
compared with) is excluded; if it could change the verdict, the claim is undecidable.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from nmpcrl.analysis.predictors import over_layouts
from nmpcrl.analysis.statistics import Estimate, rate
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome, Verdict
from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.records import Column, Stopped

MAJORITY = 0.5
NEARLY_ALL = 0.9
NEARLY_NONE = 0.1
FEWEST_LAYOUTS = 5  # of an interval for layouts drawn anew

CELL = ["layout", "decay", "seed"]  # what two runs share that are compared
NAMED = {"decay": ("reading", " of the decay")}  # a level that a sentence calls otherwise

Paths: TypeAlias = Mapping[Experiment, Column]  # the states of each run's last rollout


@dataclass(frozen=True, eq=False)
class Assumption:
    """One assumption of the theorems behind C8, beside what is run."""

    theorem: str  # what is assumed
    here: str  # what the paper does, with a measurement where one is possible
    holds: bool
    by: tuple[str, ...] = ()  # the theorems that assume it, as `assumptions.THEOREMS` names them


@dataclass(frozen=True, eq=False)
class Observations:
    """All that a claim may be judged by; each takes what it asks for."""

    runs: pd.DataFrame = field(default_factory=pd.DataFrame)  # of `rows.table`
    paths: Paths = field(default_factory=dict)
    timings: pd.DataFrame = field(default_factory=pd.DataFrame)  # of `time_learners`
    assumptions: tuple[Assumption, ...] = ()  # of `audit`


@dataclass(frozen=True, kw_only=True, eq=False)
class Claim(ABC):
    """What the paper says, or we do, and how it is decided: fixed before it was put to a run."""

    name: str  # "C1"
    statement: str
    question: str  # what is asked
    measured: str  # the numbers that answer it, in words
    border: str  # and where yes ends, in words
    test: str = "share of yes, with its interval"
    would_change: str  # where another verdict is to be expected
    learners: tuple[str, ...] = ()  # whose runs answer, in the order of the question
    quotation: str = ""  # the sentences of the paper that it rests on, in Markdown
    implied: bool = False  # whether the paper takes it for granted, and nowhere says it
    words: Mapping[Outcome, str] = field(default_factory=dict)  # for outcomes, where not their own

    @abstractmethod
    def judge(self, observed: Observations) -> Verdict:
        """The verdict on what was observed."""

    def verdict(self, outcome: Outcome, evidence: str, **numbers: Any) -> Verdict:
        """A verdict on this claim; `numbers` are further fields of `Verdict`."""
        texts = (self.name, self.statement, outcome, evidence, self.would_change)
        return Verdict(*texts, said=self.words.get(outcome, ""), **numbers)


@dataclass(frozen=True)
class Answers:
    """How many runs say yes, no, and nothing."""

    yes: int
    no: int
    missing: int = 0

    @property
    def outcome(self) -> Outcome:
        """The rule at the top, whatever the missing ones would say."""
        asked = self.yes + self.no + self.missing
        least, most = read(self.yes, asked), read(self.yes + self.missing, asked)
        return least if least == most else UNDECIDABLE

    @property
    def share(self) -> Estimate | None:
        """Share of yes among the answers; its interval also covers what the missing may say."""
        answered, asked = self.yes + self.no, self.yes + self.no + self.missing
        if not answered:
            return None
        low, high = rate(self.yes, asked).low, rate(self.yes + self.missing, asked).high
        return Estimate(self.yes / answered, low, high)


def read(yes: int, of: int) -> Outcome:
    """The rule at the top, for `yes` of `of` answers of which none is missing."""
    if not of or rate(of, of).low <= MAJORITY:
        return UNDECIDABLE
    share = rate(yes, of)
    if share.low > MAJORITY and share.value >= NEARLY_ALL:
        return REPRODUCED
    if share.high < MAJORITY and share.value <= NEARLY_NONE:
        return NOT
    return PARTLY


def counted(answers: pd.Series, level: str = "") -> dict[str, Answers]:
    """How runs answer for each value of a level, in the order in which they come, or as "all".

    Args:
        answers: True, False or missing.
        level: of their index; without one all are counted together.
    """
    known = answers.astype("boolean")
    missing, yes = known.isna().to_numpy(), known.to_numpy(bool, na_value=False)
    if level:
        place, names = pd.factorize(answers.index.get_level_values(level))
    else:
        place, names = np.zeros(len(answers), int), pd.Index(["all"])
    found = [np.bincount(place[where], minlength=len(names)) for where in (yes, missing)]
    of = np.bincount(place, minlength=len(names))
    return {
        name: Answers(int(yeses), int(all_of - yeses - unknown), int(unknown))
        for name, all_of, yeses, unknown in zip(names, of, *found, strict=True)
    }


def settle(
    claim: Claim,
    answers: pd.Series,
    evidence: str,
    *,
    weaker: pd.Series | None = None,
    unit: str = "pairs",
) -> Verdict:
    """The verdict on a claim, overall, in each layout and in each reading of the decay.

    Args:
        claim: what was asked.
        answers: True, False or missing, indexed by layout, decay, seed and whatever else.
        evidence: what the numbers are, in sentences.
        weaker: answers to a weaker question, which a yes to the first implies. Where that one is
            not refuted, the claim is partly reproduced.
        unit: what was asked, in the plural.
    """

    levels = [level for level in ("layout", "decay") if level in answers.index.names]
    found = {level: counted(answers, level) for level in ("", *levels)}
    forgiven = answers if weaker is None else weaker[answers.index]
    lenient = {level: counted(forgiven, level) for level in found}

    outcomes = {
        level: {
            name: forgiving(one.outcome, lenient[level][name].outcome)
            for name, one in parts.items()
        }
        for level, parts in found.items()
    }
    whole = found[""]["all"]
    return claim.verdict(
        outcomes[""]["all"],
        f"{evidence} {_held(whole, unit)} {scope(answers)}",
        share=whole.share.value if whole.share else None,
        interval=(whole.share.low, whole.share.high) if whole.share else None,
        by_layout=outcomes.get("layout", {}),
        by_decay=outcomes.get("decay", {}),
        counts={
            name: (one.yes, one.yes + one.no)
            for parts in found.values()
            for name, one in parts.items()
        },
    )


def forgiving(strict: Outcome, weaker: Outcome) -> Outcome:
    """What is refuted is partly reproduced where the weaker question is not refuted."""
    if strict != NOT:
        return strict
    return weaker if weaker in (NOT, UNDECIDABLE) else PARTLY


def drawn_anew(values: Iterable[float]) -> Estimate:
    """The mean of one value a layout, with the interval of 95 % for layouts drawn anew.

    The bootstrap draws layouts. Where all layouts say 0, or all 1, it would be sure of what it saw,
    and the interval is Wilson's of as many layouts. Below `FEWEST_LAYOUTS` the bounds are nan. Six
    layouts are few for a bootstrap: the interval is, if anything, too narrow.
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

    A run that is missing, or shorter than the paper's, is a row of nan. One that had to be stopped
    left no policy, so its final cost is infinite, whatever the last rollout cost.

    Args:
        runs: of `rows.table`, all of one setting.
        learners: whose runs are wanted.
        among: the learners in whose cells they are wanted; by default themselves.

    Raises:
        ValueError: a learner has two runs in one cell, so that the runs are of several settings.
    """
    asked = runs[runs.learner.isin(among or learners)]
    cells = pd.MultiIndex.from_frame(asked[CELL].drop_duplicates())
    return tuple(_arm(runs, learner).reindex(cells) for learner in learners)


def _arm(runs: pd.DataFrame, learner: str) -> pd.DataFrame:
    whole = runs[(runs.learner == learner) & (runs.episodes >= paper.EPISODES)].set_index(CELL)
    twice = whole.index[whole.index.duplicated()]
    if len(twice):
        cell = ", ".join(f"{n} {value}" for n, value in zip(CELL, twice[0], strict=True))
        raise ValueError(
            f"{learner} has several runs in {cell}: judge the runs of one setting at a time"
        )
    return whole.assign(
        final_cost=whole.final_cost.where(whole.stopped == Stopped.FINISHED, np.inf)
    )


def scope(answers: pd.Series) -> str:
    """What the answers cover: layouts, readings and seeds, or what another study has for levels."""
    levels = [name for name in answers.index.names if name != "learner"]
    counts = [
        (answers.index.unique(name).size, *NAMED.get(name, (str(name), "")))
        for name in (CELL if {*CELL} <= {*levels} else levels)
    ]
    parts = [f"{n} {name}{'' if n == 1 else 's'}{rest}" for n, name, rest in counts]
    return f"({', '.join(parts)}.)"


def _held(answers: Answers, unit: str) -> str:
    missing = f"; {answers.missing} {unit} are missing" if answers.missing else ""
    if answers.share is None:
        return f"No {unit} are there to be asked{missing}."
    asked = answers.yes + answers.no
    return f"It holds in {answers.yes} of {asked} {unit}: {answers.share:.0%}{missing}."


def shown(value: float, form: str) -> str:
    """A number as a sentence shows it; the cost of what could not be finished is infinite."""
    return f"{value:{form}}" if np.isfinite(value) else str(value).replace("inf", "∞")


def median(values: Iterable[float]) -> float:
    """Of those that are known; nan where none is."""
    known = np.array([value for value in values if not np.isnan(value)])
    return float(np.median(known)) if known.size else np.nan

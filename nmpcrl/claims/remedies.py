"""What the comparison of remedies says, by the definitions of `remedy_questions`.

All of it is made of one table, a row a judged run, with `COLUMNS`. What is missing is left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import Estimate, interquartile_mean, rate
from nmpcrl.analysis.suite import TOLERANCE
from nmpcrl.claims.population import Answer, by_share
from nmpcrl.claims.remedy_questions import (
    ADVISED,
    DIGITS,
    EXPECTED_FIRST,
    EXPECTED_NEVER,
    FIRST,
    HALF,
    LATER,
    LEAST_GAIN,
    NEVER,
    OPEN,
    PARTS,
    SECOND,
    SETTINGS,
)
from nmpcrl.claims.rule import MAJORITY
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE, Outcome

COLUMNS = (
    "part",  # of `PARTS`
    "entry",  # of `SETTINGS`
    "name",  # with what is set
    "layout",
    "k",  # which seed of the layout
    "initial", "best", "cost",  # J_init, J_best, and that of what the entry returned
    "arrived",
    "episodes", "over",  # begun, and whether there were too many
    "seconds",  # of processor time
)  # fmt: skip
NEARLY = 0.9  # of the possible gain, in "search nears the best"
NO_DIFFERENCE = "no difference shown"  # an interval that holds 0 confirms nothing in part
UNTUNED = "frozen"  # the control, on which nothing is advised


@dataclass(frozen=True)
class RemedyRow:
    """What an entry did in one part."""

    part: str
    entry: str
    name: str  # with what is set
    gain: Estimate  # share of the possible one: interquartile mean over layouts
    solved: Estimate  # share of the layouts
    layouts: int
    left_out: int  # of the gain, since hardly any is possible there
    rollouts: int  # of a layout and seed at most, confirming ones and a tuner's included
    seconds: float  # of processor time, mean of a layout and seed
    disqualified: bool  # whether it began too many somewhere


@dataclass(frozen=True)
class Advice:
    """Whether to try an entry, and why."""

    entry: str
    word: str  # of `ADVICE`
    rows: Mapping[str, RemedyRow] = field(default_factory=dict)  # by part
    tuning: int = 0  # rollouts that were spent to find its setting


def shares(runs: pd.DataFrame) -> pd.Series:
    """The share of the possible gain by layout, the mean over its seeds; -inf where one failed.

    Args:
        runs: of one entry, setting and part.
    """
    possible = runs.initial - runs.best
    there = runs[possible >= LEAST_GAIN * runs.initial]
    share = (there.initial - there.cost) / (there.initial - there.best)
    return share.groupby(there.layout, sort=False).mean()


def solved(runs: pd.DataFrame) -> pd.Series:
    """Whether each layout is solved, under every seed."""
    yes = runs.arrived.astype(bool) & (runs.cost <= runs.initial * (1 + TOLERANCE))
    return yes.groupby(runs.layout, sort=False).all()


def gain(share: pd.Series) -> Estimate:
    """The interquartile mean over layouts, with its interval; nan where no layout is known."""
    if share.empty:
        return Estimate(np.nan, np.nan, np.nan)
    return interquartile_mean(share.to_numpy(), ["layouts"] * len(share))


def best_setting(tuned: pd.DataFrame) -> str:
    """The name of an entry's best setting, the first of equal ones.

    Args:
        tuned: its runs of the part `tune`, those of the first setting first.
    """
    values = {
        str(name): gain(shares(runs)).value for name, runs in tuned.groupby("name", sort=False)
    }
    return max(values, key=lambda name: values[name])


def rows(table: pd.DataFrame, part: str) -> tuple[RemedyRow, ...]:
    """One row an entry, in the order of `SETTINGS`."""
    there = table[table.part == part]
    return tuple(
        row(part, name, there[there.entry == name])
        for name in SETTINGS
        if (there.entry == name).any()
    )


def row(part: str, entry: str, runs: pd.DataFrame) -> RemedyRow:
    """The row of one entry, of its runs in a part."""
    share, arrived = shares(runs), solved(runs)
    return RemedyRow(
        part=part,
        entry=entry,
        name=str(runs["name"].iloc[0]),
        gain=gain(share),
        solved=rate(int(arrived.sum()), len(arrived)),
        layouts=len(arrived),
        left_out=len(arrived) - len(share),
        rollouts=int(runs.episodes.max()),
        seconds=float(runs.seconds.mean()),
        disqualified=bool(runs.over.any()),
    )


def advice(table: pd.DataFrame) -> tuple[Advice, ...]:
    """What to try first, second and never, in that order, by `remedy_questions.ADVICE`."""
    judged = [row for part in ADVISED for row in rows(table, part)]
    refused = {UNTUNED, *(row.entry for row in judged if row.disqualified)}
    found: dict[str, dict[str, RemedyRow]] = {}
    for row in judged:
        if row.entry not in refused:
            found.setdefault(row.entry, {})[row.part] = row
    words = {entry: _word(list(by_part.values())) for entry, by_part in found.items()}
    order = sorted(found, key=lambda entry: (RANK.index(words[entry]), _order(found[entry])))
    for entry, word in zip(
        [one for one in order if words[one] == LATER], (FIRST, SECOND), strict=False
    ):
        words[entry] = word
    spent = table[table.part == "tune"].groupby("entry").episodes.sum()
    return tuple(
        Advice(entry, words[entry], found[entry], int(spent.get(entry, 0))) for entry in order
    )


RANK = (LATER, OPEN, NEVER)  # before first and second are chosen


def _word(judged: list[RemedyRow]) -> str:
    """Never, open, or one of those that may be first."""
    if all(one.gain.high < 0 or one.solved.high < HALF for one in judged):
        return NEVER
    return LATER if all(one.gain.low > 0 for one in judged) else OPEN


def _order(judged: Mapping[str, RemedyRow]) -> tuple[float, ...]:
    """The greater lower end first, with the first budget, then the next; then the less time."""
    ends = [-round(judged[part].gain.low, DIGITS) if part in judged else np.inf for part in ADVISED]
    known = next(iter(judged.values()))
    return (*(np.inf if np.isnan(one) else one for one in ends), known.seconds)


def greatest(table: pd.DataFrame) -> dict[int, str]:
    """The entry whose gain has the greatest lower end, by budget; what `EXPECTED_FIRST` expects."""
    found = {}
    for part in ADVISED:
        known = [one for one in rows(table, part) if not np.isnan(one.gain.low)]
        if known:
            found[PARTS[part].budget] = max(known, key=lambda one: one.gain.low).entry
    return found


def expectations(table: pd.DataFrame) -> dict[str, bool]:
    """Whether what was expected of the order came true, where it can be told."""
    first = greatest(table)
    said = {
        f"{entry} is first with {budget} episodes": first[budget] == entry
        for budget, entry in EXPECTED_FIRST.items()
        if budget in first
    }
    words = {one.entry: one.word for one in advice(table)}
    never = {f"{one} is never advised": words[one] == NEVER for one in EXPECTED_NEVER
             if one in words}  # fmt: skip
    return said | never


def answers(table: pd.DataFrame) -> tuple[Answer, ...]:
    """All questions of `REMEDY_QUESTIONS`."""
    short, long = ADVISED
    return (
        _search_and_learning(table, long),
        _nears(table, long),
        _gains(table, short, "undone-GN-J", "undone steps on the loop's cost gain"),
        _gains(table, short, "undone-LSTD-Q", "undone steps on the TD error gain"),
        _by_hand(table, long),
        _difference(table, short, ("GES-3", "GES"), "faster auxiliary weights"),
        _guard(table),
        _difference(table, short, ("guarded-RDES", "control-RDES"), "lengths or directions"),
        _difference(table, short, ("averaged-ES", "ES"), "averaging"),
        _difference(table, short, ("undone-ES", "ES"), "undo"),
    )


def _of(table: pd.DataFrame, part: str, entry: str) -> pd.DataFrame:
    return table[(table.part == part) & (table.entry == entry)]


def _paired(table: pd.DataFrame, part: str, entries: tuple[str, str]) -> pd.DataFrame:
    """The shares of two entries in the layouts that both were judged in."""
    found = {one: shares(_of(table, part, one)) for one in entries}
    return pd.DataFrame(found, columns=[*entries]).dropna()


def _search_and_learning(table: pd.DataFrame, part: str) -> Answer:
    both = _paired(table, part, ("CMA-ES", "ES"))
    numbers = {
        f"{entry} in {layout}": float(share)
        for entry in both
        for layout, share in shares(_of(table, "named 300", str(entry))).items()
    }
    return by_share("search and learning", both["CMA-ES"] > both["ES"], numbers=numbers)


def _nears(table: pd.DataFrame, part: str) -> Answer:
    return by_share("search nears the best", shares(_of(table, part, "CMA-ES")) >= NEARLY)


def _costs(runs: pd.DataFrame) -> pd.DataFrame:
    """Mean costs by layout."""
    return runs.groupby("layout", sort=False)[["initial", "cost"]].mean()


def _gains(table: pd.DataFrame, part: str, entry: str, name: str) -> Answer:
    costs = _costs(_of(table, part, entry))
    return by_share(name, costs.cost < costs.initial)


def _by_hand(table: pd.DataFrame, part: str) -> Answer:
    by_hand = _of(table, part, "grid")
    there = by_hand[by_hand.arrived.astype(bool)].groupby("layout").cost.mean()
    both = pd.DataFrame({"grid": there, "GES": _costs(_of(table, part, "GES")).cost}).dropna()
    return by_share("one number by hand", both["grid"] < both["GES"])


def _guard(table: pd.DataFrame) -> Answer:
    """By layout: with how many of the step sizes that RDES does not solve it with, a guard does."""
    tune = table[table.part == "tune"]
    by: dict[str, Any] = {
        entry: pd.Series(
            {
                (layout, _set(str(name))): bool(solved(runs).iloc[0])
                for (name, layout), runs in tune[tune.entry == entry].groupby(["name", "layout"])
            },
            dtype=object,
        )
        for entry in ("RDES", "guarded-RDES")
    }
    both = pd.DataFrame(by).dropna()
    asked = both[~both["RDES"].astype(bool)]["guarded-RDES"].astype(float)
    if asked.empty:
        return Answer("guard", UNDECIDABLE, {"layouts": (0, 0)})
    return by_share("guard", asked.groupby(level=0).mean() > MAJORITY)


def _set(name: str) -> str:
    """What a name says is set: "alpha=3e-07"."""
    return name.partition("[")[2].rstrip("]")


def _difference(table: pd.DataFrame, part: str, entries: tuple[str, str], name: str) -> Answer:
    """Confirmed if the first has surely more of the gain, contradicted if it has surely less."""
    both = _paired(table, part, entries)
    first, second = (both[one] for one in entries)
    with np.errstate(invalid="ignore"):  # where both failed
        more = pd.Series(np.where(first == second, 0.0, first - second), dtype=float)
    if len(more) < 2:
        return Answer(name, UNDECIDABLE, {"layouts": (0, len(more))})
    found = gain(more)
    outcome: Outcome = REPRODUCED if found.low > 0 else NOT if found.high < 0 else PARTLY
    numbers = {"difference": found.value, "low": found.low, "high": found.high}
    beside = {"layouts with more": (int((more > 0).sum()), len(more))}
    said = NO_DIFFERENCE if outcome == PARTLY else ""
    return Answer(name, outcome, numbers=numbers, beside=beside, said=said)

"""Both editions side by side: verdicts, answers and numbers of the first, and of what is published.

`first_edition.json`, beside the published tables, has what the first edition came to, commit
be2ed13. It was written before any row was made anew, and never changes.
The rule for a comparison is of the same date: an outcome stands if it is the same word, and a
number with an interval stands if the two intervals overlap.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import pandas as pd

from nmpcrl.analysis.statistics import Estimate, rate
from nmpcrl.claims import published as study
from nmpcrl.claims import robustness
from nmpcrl.claims.finding import finding
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import BY_TIME
from nmpcrl.claims.published import RUNS, SEARCHES, TIMINGS
from nmpcrl.claims.verdict import Outcome, Verdict
from nmpcrl.report.cited import Count
from nmpcrl.report.tables import shown
from nmpcrl.report.text import SURE
from nmpcrl.studies import interventions, population, remedies
from nmpcrl.studies.agents import SAC_AND_TD3
from nmpcrl.studies.difficulty import DIFFICULTY
from nmpcrl.studies.interventions import INTERVENTIONS
from nmpcrl.studies.investigation import WORDS, Answer, Investigation
from nmpcrl.studies.main_study import gather
from nmpcrl.studies.other_problems import OTHER_PROBLEMS
from nmpcrl.studies.population import POPULATION
from nmpcrl.studies.remedies import REMEDIES
from nmpcrl.studies.worlds import WORLDS
from nmpcrl.study import design, published
from nmpcrl.study.provenance import EPOCHS

FILE = "first_edition.json"
FIRST = dict.fromkeys(EPOCHS, 1)  # epochs of the first edition
Part = tuple[str, str]  # a published table and one of its parts; "" for all of a table


@dataclass(frozen=True)
class Line:
    """A verdict, an answer or a number."""

    group: str
    name: str
    text: str = ""  # the claim or question in words
    expected: str = ""  # outcome, before any row was made
    outcome: str = ""  # in words; empty for a number
    value: float | None = None  # share, ratio or other number
    low: float | None = None  # of its interval of 95 %
    high: float | None = None
    counts: str = ""  # "26 of 120 pairs"

    @property
    def shown(self) -> str:
        """Outcome, counts and number."""
        number = "" if self.value is None else f"{self.value:.3g}"
        if self.low is not None and self.high is not None:
            number += f" [{self.low:.3g}, {self.high:.3g}]"
        return "; ".join(filter(None, (self.outcome, self.counts, number)))

    def stands(self, other: "Line") -> bool | None:
        """Whether the other edition says the same; None if that is not judged."""
        if self.outcome or other.outcome:
            return self.outcome == other.outcome
        if self.low is None or other.low is None or self.high is None or other.high is None:
            return None
        return self.low <= other.high and other.low <= self.high


VARIANTS = tuple((RUNS, part) for part in design.VARIANTS)
MAIN, CONTROLS = (RUNS, design.MAIN_TABLE), (RUNS, "controls")


def _parts(*every: Investigation) -> tuple[Part, ...]:
    return tuple((one.name, part) for one in every for part in one.parts)


JUDGED = tuple(one for one in _parts(REMEDIES) if one[1] != "best")  # whose rows have J_best

GROUPS: Mapping[str, tuple[Part, ...]] = {  # with the published parts that each rests on
    "The paper's claims": (MAIN,),
    "The paper's claims on time": ((TIMINGS, ""),),
    "Our own claims": (MAIN, CONTROLS),
    "The finding in numbers": (MAIN, (SEARCHES, "")),
    "Variants": (MAIN, *VARIANTS),
    "Drawn layouts": (*_parts(POPULATION, DIFFICULTY), MAIN, *VARIANTS, (SEARCHES, "")),
    "Stopped runs made again": _parts(INTERVENTIONS),
    "Remedies": JUDGED,
    "SAC and TD3": (*_parts(SAC_AND_TD3), *JUDGED),
    "Changing worlds": _parts(WORLDS),
    "Other people's problems": _parts(OTHER_PROBLEMS),
}


def found() -> list[Line]:
    """The lines of what is published today."""
    known = study.load()
    return [
        *map(_verdict, known.verdicts),
        *_finding(known),
        *_variants(),
        *_drawn(),
        *_answered("Stopped runs made again", INTERVENTIONS, INTERVENTIONS.table()),
        *_made_again(),
        *_answered("Remedies", REMEDIES, REMEDIES.table()),
        *_advice(),
        *_answered("SAC and TD3", SAC_AND_TD3, SAC_AND_TD3.table()),
        *_answered("Changing worlds", WORLDS, WORLDS.table()),
        *_answered("Other people's problems", OTHER_PROBLEMS, OTHER_PROBLEMS.table()),
    ]


@cache
def first() -> tuple[Line, ...]:
    """The lines of the first edition."""
    read = json.loads((published.folder() / FILE).read_text("utf-8"))
    return tuple(Line(**_numbers(row)) for row in read["lines"])


def is_anew(part: Part) -> bool:
    """Whether the published rows of a part are of a later edition than the first."""
    then = published.epochs(published.about(part[0]), part[1])
    return bool(then) and then != FIRST


def parts_anew() -> Count:
    """How many of the parts of all groups are of a later edition."""
    every = {part for parts in GROUPS.values() for part in parts}
    return Count(sum(map(is_anew, every)), len(every))


def parts_table() -> pd.DataFrame:
    """Every published part: its edition, and when its rows were made."""
    rows = []
    for part in dict.fromkeys(part for parts in GROUPS.values() for part in parts):
        date = published.batch_of(published.about(part[0]), part[1]).get("date", "")
        rows.append((*part, "second" if is_anew(part) else "first", date))
    return pd.DataFrame(rows, columns=["file", "part", "edition", "date"]).set_index("file")


def compared(today: Iterable[Line]) -> pd.DataFrame:
    """The lines of both editions, a row each; a line that only one has stands beside an empty one.

    Returns:
        Columns group, name, first and today (of `Line`), and stands.
    """
    now = {(one.group, one.name): one for one in today}
    then = {(one.group, one.name): one for one in first()}
    rows = []
    for group, name in dict.fromkeys([*then, *now]):
        pair = [one.get((group, name), Line(group, name)) for one in (then, now)]
        rows.append((group, name, *pair, pair[0].stands(pair[1])))
    return pd.DataFrame(rows, columns=["group", "name", "first", "today", "stands"])


def summary(both: pd.DataFrame) -> pd.DataFrame:
    """A row a group: its parts made anew and all, its outcomes and numbers, and how many stand."""
    rows = []
    for group, parts in GROUPS.items():
        lines = both[both.group == group]
        outcomes = lines["first"].map(lambda one: bool(one.outcome)).astype(bool)
        judged = lines[~outcomes & lines.stands.notna()].stands
        said = lines[outcomes].stands
        anew = sum(map(is_anew, parts))
        counts = (anew, len(parts), int(said.sum()), len(said), int(judged.sum()), len(judged))
        rows.append((group, *counts))
    names = ["group", "anew", "parts", "standing", "outcomes", "overlapping", "numbers"]
    return pd.DataFrame(rows, columns=names).set_index("group")


def summary_table(counts: pd.DataFrame) -> pd.DataFrame:
    """The rows of `summary` as a page shows them."""
    pairs = {
        "parts made anew": ("anew", "parts"),
        "outcomes that stand": ("standing", "outcomes"),
        "intervals that overlap": ("overlapping", "numbers"),
    }
    columns = {
        name: [str(Count(*pair)) for pair in zip(counts[yes], counts[of], strict=True)]
        for name, (yes, of) in pairs.items()
    }
    return pd.DataFrame(columns, counts.index).rename_axis(None).replace("0 of 0", "")


def table(both: pd.DataFrame, group: str) -> str:
    """The lines of a group in HTML: of the first edition, and of what is published today."""
    rows = {
        f"{one.name}. {one.today.text or one.first.text}": {
            "expected": one.first.expected,
            "first edition": one.first.shown,
            "today": one.today.shown,
            "stands": {True: "yes", False: "no"}.get(one.stands, ""),
        }
        for one in both[both.group == group].itertuples()
    }
    return shown(pd.DataFrame.from_dict(rows, "index"), group)


# Lines of each source.


def _verdict(verdict: Verdict) -> Line:
    group = "Our own claims" if verdict.claim in OWN_CLAIMS else "The paper's claims"
    if verdict.claim in BY_TIME:
        group = "The paper's claims on time"
    value = verdict.ratio if verdict.share is None else verdict.share
    low, high = verdict.interval or (None, None)
    yes, of = verdict.counts.get("all", (0, 0))
    counts = f"{yes} of {of} {verdict.unit}" if of else ""
    statement = verdict.statement
    return Line(group, verdict.claim, statement, "", verdict.words, value, low, high, counts)


def _answered(
    group: str, investigation: Investigation, table: pd.DataFrame, known: Any = None
) -> list[Line]:
    """The answers of an investigation; `known` is what its questions are asked of."""
    answers = investigation.judge(investigation.evidence(table) if known is None else known)
    return [
        _answer(group, one.name, one.question, one.expected, answers[one.name])
        for one in investigation.questions
    ]


def _answer(group: str, name: str, text: str, expected: Outcome, answer: Answer) -> Line:
    counts = {**answer.counts, **answer.beside}
    said = ", ".join(f"{yes} of {of} {unit}" for unit, (yes, of) in counts.items())
    share = Estimate(*[None] * 3)  # type: ignore[arg-type]
    if len(answer.counts) == 1:
        ((yes, of),) = answer.counts.values()
        share = rate(yes, of) if of else share
    word = WORDS.get(expected, str(expected))
    interval = share.value, share.low, share.high
    return Line(group, name, text, word, answer.words, *interval, said)


def _count(group: str, name: str, yes: int, of: int, unit: str = "runs") -> Line:
    share = rate(yes, of)
    return Line(
        group, name, "", "", "", share.value, share.low, share.high, f"{yes} of {of} {unit}"
    )


def _estimate(group: str, name: str, estimate: Estimate) -> Line:
    return Line(group, name, "", "", "", estimate.value, estimate.low, estimate.high)


def _finding(known: study.Published) -> list[Line]:
    """The numbers of the introduction and of Chapter 5."""
    group, one = "The finding in numbers", finding(known)
    if one.empty:
        return []
    runs = {
        "ES and GES: runs with open gaps that solve their layout": one.arrived_open,
        "ES and GES: runs with a closed gap that solve it": one.arrived_closed,
        "RDES: runs that were stopped, noise per episode": one.stopped,
        "RDES: runs that were stopped, noise per step": one.stopped_per_step,
        "RDES: runs stopped within 20 episodes, noise per episode": (
            one.stopped_early, one.stopped[1],
        ),
        "RDES: runs stopped within 20 episodes, noise per step": (
            one.early_per_step, one.stopped_per_step[1],
        ),
        **{f"{name}: runs that did not end at the target": n for name, n in one.not_there.items()},
        **{f"{name}: runs that cost more than theta_init": n for name, n in one.above.items()},
    }  # fmt: skip
    layouts = {
        "theta_c by hand: layouts solved": one.by_hand,
        "theta_c by hand: layouts where it costs less than any run of ES and GES": one.better,
    }
    numbers = {
        "ES and GES: median reduction of the cost with open gaps": one.learned,
        "theta_c by hand: median reduction where it solves": one.saved_by_hand,
        "ES and GES: median reduction there": one.saved_there,
        "theta_c by hand: least increase elsewhere": one.lost_by_hand[0],
        "theta_c by hand: greatest increase elsewhere": one.lost_by_hand[1],
    }
    halves = {
        f"{claim}: {learner} {half.wrong}, noise per {half.decay}": (count, half.pairs)
        for claim in ("C1", "C2")
        for half in known.verdict(claim).halves
        for learner, count in zip(half.learners, half.counts, strict=True)
    }
    medians = known.verdict("W9").numbers.get("medians", {})
    numbers |= {f"C9: {name}, median reduction of the cost": one for name, one in medians.items()}
    for claim, names in MEDIANS.items():
        there = known.verdict(claim).numbers
        numbers |= {text: there[name] for name, text in names.items() if name in there}
    return [
        *(_count(group, name, *count) for name, count in (runs | halves).items()),
        *(_count(group, name, yes, of, "layouts") for name, (yes, of) in layouts.items()),
        *(Line(group, name, value=float(number)) for name, number in numbers.items()),
    ]


MEDIANS: Mapping[str, Mapping[str, str]] = {  # numbers of verdicts, in words
    "C1": {"DES_median": "C1: DES, last training cost over the frozen arm's",
           "RDES_median": "C1: RDES, last training cost over the frozen arm's"},
    "C5": {"path": "C5: distance of trajectories [m]", "cost": "C5: difference of costs",
           "theta": "C5: largest difference of a component of theta"},
    "C6": {"told": "C6: error with theta as an input", "alone": "C6: error without theta"},
    "C7": {"inside_large": "C7: states of RDES deep in an obstacle, training",
           "eval_inside_large": "C7: states of RDES deep in an obstacle, without noise"},
}  # fmt: skip


def _variants() -> list[Line]:
    """How many variants change a verdict of the paper's claims."""
    every = gather("published", variants=True)
    judged = robustness.variant_changes(every.runs, every.paths)
    changed = judged[judged.changes.astype(bool)]
    of, group = judged.variant.nunique(), "Variants"
    return [
        _count(group, "variants that change a verdict", changed.variant.nunique(), of, "variants"),
        _count(
            group,
            f"variants that change one with p < {SURE}",
            changed[changed.p < SURE].variant.nunique(),
            of,
            "variants",
        ),
    ]


def _drawn() -> list[Line]:
    """The claims and questions in drawn layouts."""
    known, group = population.load(), "Drawn layouts"
    shares = known.shares.set_index("claim")
    lines = _answered(group, POPULATION, POPULATION.table(), known)
    return [_share(one, shares.loc[one.name]) if one.name in shares.index else one for one in lines]


def _share(line: Line, share: pd.Series) -> Line:
    """A claim in drawn layouts, with its row of `population.shares`."""
    text = f"{line.name}: the share of the layouts in which it holds"
    return replace(line, text=text, value=share.share, low=share.low, high=share.high)


def _made_again() -> list[Line]:
    """The share of the stopped runs that live when they are made again."""
    ends = interventions.ends(INTERVENTIONS.table())
    return [
        _estimate("Stopped runs made again", f"share that lives: {arm}, {where}",
                  interventions.live(ends[ends.part == part], arm))
        for part, where in {"six": "layouts A to F", "drawn": "drawn layouts"}.items()
        for arm in interventions.ARMS
    ]  # fmt: skip


def _advice() -> list[Line]:
    """The advice on each entry, and its share of the possible gain."""
    lines = []
    for entry, rows in remedies.advice(REMEDIES.table()).groupby("entry", sort=False):
        lines.append(Line("Remedies", f"advice on {entry}", outcome=f"try {rows.word.iloc[0]}"))
        lines += [
            _estimate("Remedies", f"{entry}: share of the possible gain, {row.part[6:]}", row.gain)
            for row in rows.itertuples()
        ]
    return lines


def _numbers(row: Mapping[str, Any]) -> dict[str, Any]:
    return {**row, **{name: float(row[name]) for name in ("value", "low", "high") if name in row}}

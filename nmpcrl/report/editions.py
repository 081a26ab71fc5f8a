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
from nmpcrl.claims.verdict import Verdict
from nmpcrl.report.tables import shown
from nmpcrl.report.text import SURE
from nmpcrl.studies import interventions, population, remedies
from nmpcrl.studies.agents import SAC_AND_TD3
from nmpcrl.studies.difficulty import DIFFICULTY
from nmpcrl.studies.interventions import INTERVENTIONS
from nmpcrl.studies.investigation import WORDS, Answer, Investigation, Question
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


def _parts(*every: Investigation) -> tuple[Part, ...]:
    return tuple((one.name, part) for one in every for part in one.parts)


MAIN = (RUNS, design.MAIN_TABLE)
VARIANTS = tuple((RUNS, part) for part in design.VARIANTS)
ASKED: Mapping[str, Investigation] = {  # groups of answers
    "Stopped runs made again": INTERVENTIONS,
    "Remedies": REMEDIES,
    "SAC and TD3": SAC_AND_TD3,
    "Changing worlds": WORLDS,
    "Other people's problems": OTHER_PROBLEMS,
}
GROUPS: dict[str, tuple[Part, ...]] = {  # with the published parts that each rests on
    "The paper's claims": (MAIN,),
    "The paper's claims on time": ((TIMINGS, ""),),
    "Our own claims": (MAIN, (RUNS, "controls")),
    "The finding in numbers": (MAIN, (SEARCHES, "")),
    "Variants": (MAIN, *VARIANTS),
    "Drawn layouts": (*_parts(POPULATION, DIFFICULTY), MAIN, *VARIANTS, (SEARCHES, "")),
} | {group: _parts(one) for group, one in ASKED.items()}
GROUPS["Remedies"] = tuple(one for one in GROUPS["Remedies"] if one[1] != "best")  # have J_best
GROUPS["SAC and TD3"] += GROUPS["Remedies"]


def found() -> list[Line]:
    """The lines of what is published today."""
    known = study.load()
    return [
        *map(_verdict, known.verdicts),
        *_finding(known),
        *_variants(),
        *_drawn(),
        *_made_again(),
        *_advice(),
        *(
            _answer(group, question, answer)
            for group, one in ASKED.items()
            for question, answer in zip(
                one.questions, one.answers(one.table()).values(), strict=True
            )
        ),
    ]


@cache
def first() -> tuple[Line, ...]:
    """The lines of the first edition."""
    read = json.loads((published.folder() / FILE).read_text("utf-8"))["lines"]
    numbers = ("value", "low", "high")
    return tuple(Line(**row | {n: float(row[n]) for n in numbers if n in row}) for row in read)


def is_anew(part: Part) -> bool:
    """Whether the published rows of a part are of a later edition than the first."""
    then = published.epochs(published.about(part[0]), part[1])
    return bool(then) and then != FIRST


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
    known = both[both.stands.notna()]
    outcomes = known["first"].map(lambda one: bool(one.outcome)).astype(bool)
    counts = pd.DataFrame(
        {
            "anew": {group: sum(map(is_anew, parts)) for group, parts in GROUPS.items()},
            "parts": {group: len(parts) for group, parts in GROUPS.items()},
        }
    )
    names = {("standing", "outcomes"): outcomes, ("overlapping", "numbers"): ~outcomes}
    for (stand, all_of_them), chosen in names.items():
        by_group = known[chosen].stands.astype(int).groupby(known.group)
        counts[stand], counts[all_of_them] = by_group.sum(), by_group.size()
    return counts.fillna(0).astype(int).rename_axis("group")


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


def _line(group: str, name: str, number: Any, unit: str = "runs") -> Line:
    """A number: an estimate, a count (yes, of) with its share, or one without an interval."""
    counts = ""
    if isinstance(number, tuple):
        counts, number = "{} of {} {}".format(*number, unit), rate(*number)
    if not isinstance(number, Estimate):
        return Line(group, name, value=float(number))
    return Line(group, name, "", "", "", number.value, number.low, number.high, counts)


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


def _answer(group: str, asked: Question, answer: Answer) -> Line:
    counts = {**answer.counts, **answer.beside}
    said = ", ".join(f"{yes} of {of} {unit}" for unit, (yes, of) in counts.items())
    expected = WORDS.get(asked.expected, str(asked.expected))
    line = Line(group, asked.name, asked.question, expected, answer.words, counts=said)
    only = [*answer.counts.values()]
    if len(only) != 1 or not only[0][1]:
        return line
    share = rate(*only[0])
    return replace(line, value=share.value, low=share.low, high=share.high)


def _finding(known: study.Published) -> list[Line]:
    """The numbers of the introduction and of Chapter 5."""
    group, one = "The finding in numbers", finding(known)
    if one.empty:
        return []
    numbers = {
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
        "ES and GES: median reduction of the cost with open gaps": one.learned,
        "theta_c by hand: median reduction where it solves": one.saved_by_hand,
        "ES and GES: median reduction there": one.saved_there,
        "theta_c by hand: least increase elsewhere": one.lost_by_hand[0],
        "theta_c by hand: greatest increase elsewhere": one.lost_by_hand[1],
    }  # fmt: skip
    numbers |= {
        f"{claim}: {learner} {half.wrong}, noise per {half.decay}": (count, half.pairs)
        for claim in ("C1", "C2")
        for half in known.verdict(claim).halves
        for learner, count in zip(half.learners, half.counts, strict=True)
    }
    medians = known.verdict("W9").numbers.get("medians", {})
    numbers |= {f"C9: {name}, median reduction of the cost": one for name, one in medians.items()}
    for text, (claim, name) in MEDIANS.items():
        if name in (there := known.verdict(claim).numbers):
            numbers[text] = there[name]
    layouts = {
        "theta_c by hand: layouts solved": one.by_hand,
        "theta_c by hand: layouts where it costs less than any run of ES and GES": one.better,
    }
    return [
        *(_line(group, *each) for each in numbers.items()),
        *(_line(group, *each, "layouts") for each in layouts.items()),
    ]


MEDIANS = {  # numbers of verdicts, by what they are
    "C1: DES, last training cost over the frozen arm's": ("C1", "DES_median"),
    "C1: RDES, last training cost over the frozen arm's": ("C1", "RDES_median"),
    "C5: distance of trajectories [m]": ("C5", "path"),
    "C5: difference of costs": ("C5", "cost"),
    "C5: largest difference of a component of theta": ("C5", "theta"),
    "C6: error with theta as an input": ("C6", "told"),
    "C6: error without theta": ("C6", "alone"),
    "C7: states of RDES deep in an obstacle, training": ("C7", "inside_large"),
    "C7: states of RDES deep in an obstacle, without noise": ("C7", "eval_inside_large"),
}


def _variants() -> list[Line]:
    """How many variants change a verdict of the paper's claims."""
    every = gather("published", variants=True)
    judged = robustness.variant_changes(every.runs, every.paths)
    changed, of = judged[judged.changes.astype(bool)], judged.variant.nunique()
    counts = {
        "variants that change a verdict": changed.variant.nunique(),
        f"variants that change one with p < {SURE}": changed[changed.p < SURE].variant.nunique(),
    }
    return [_line("Variants", name, (n, of), "variants") for name, n in counts.items()]


def _drawn() -> list[Line]:
    """The claims and questions in drawn layouts; a claim has its row of `population.shares`."""
    known, group = population.load(), "Drawn layouts"
    shares, answers = known.shares.set_index("claim"), POPULATION.judge(known)
    lines = [_answer(group, one, answers[one.name]) for one in POPULATION.questions]
    for i, one in enumerate(lines):
        if one.name in shares.index:
            text = f"{one.name}: the share of the layouts in which it holds"
            value, low, high = shares.loc[one.name, ["share", "low", "high"]]
            lines[i] = replace(one, text=text, value=value, low=low, high=high)
    return lines


def _made_again() -> list[Line]:
    """The share of the stopped runs that live when they are made again."""
    ends = interventions.ends(INTERVENTIONS.table())
    return [
        _line("Stopped runs made again", f"share that lives: {arm}, {where}",
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
            _line("Remedies", f"{entry}: share of the possible gain, {row.part[6:]}", row.gain)
            for row in rows.itertuples()
        ]
    return lines

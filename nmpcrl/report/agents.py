"""SAC and TD3 as a page shows them: what is found, what it takes, and what is not published yet."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.claims.investigation import Answer
from nmpcrl.report.cited import Count, cited
from nmpcrl.report.remedies import entry_named, share_shown
from nmpcrl.report.tables import html_table
from nmpcrl.report.text import listed, number
from nmpcrl.studies import remedies
from nmpcrl.studies.agents import (
    AGENTS,
    PARTS,
    SAC_AND_TD3,
    SEARCH,
    SEARCHED,
    SETTINGS,
    Course,
    course,
    rows,
    searched,
)
from nmpcrl.studies.remedies import RemedyRow
from nmpcrl.study.drawn import JUDGE, TUNE

BUDGET = PARTS["judge"].episodes
SHORT = SEARCHED[0].split()[1]  # episodes of the search
MATCHES, SOLVES = f"matches in {BUDGET} episodes", f"solves in {BUDGET} episodes"
INIT = r"$\boldsymbol{\theta}_\text{init}$"
NOTHING: Mapping[str, str] = {  # what a part answers, as long as it is not published
    "judge": f"what {listed(AGENTS)} cost after {BUDGET} episodes",
    "one": f"how long they take to match {INIT} in layout A",
    "all": "what one agent for all layouts comes to",
}


def panels(
    table: pd.DataFrame, suite: pd.DataFrame
) -> tuple[dict[str, list[Course]], dict[str, float]]:
    """What a figure shows: by title the courses that are published, and what the search costs.

    Args:
        table: of `studies.agents`.
        suite: the published comparison of remedies.
    """
    judged, one = PARTS["judge"], PARTS["one"]
    short, named = (searched(suite, part) for part in SEARCHED)
    wanted: dict[str, tuple[str, Sequence[str], pd.Series]] = {
        f"{len(judged.places)} layouts, one by one": ("judge", (), short.reindex(judged.places)),
        f"layout A, {one.seeds} seeds": ("one", (), named.reindex(one.places)),
        f"one agent for {len(TUNE)}": ("all", [*TUNE], short.reindex([*TUNE])),
        f"and in {len(JUDGE)} unseen": ("all", [*JUDGE], short.reindex([*JUDGE])),
    }
    shown = {title: _courses(table, *what[:2]) for title, what in wanted.items()}
    shown = {title: each for title, each in shown.items() if each}
    search = {title: float(wanted[title][2].median()) for title in shown}
    return shown, {title: cost for title, cost in search.items() if np.isfinite(cost)}


def waiting(table: pd.DataFrame) -> str:
    """The sentence that says what is not published yet; "" where all is."""
    missing = [what for part, what in NOTHING.items() if len(_courses(table, part)) < len(AGENTS)]
    return f"The runs that answer {listed(missing)} are not published yet." if missing else ""


def finding(table: pd.DataFrame, suite: pd.DataFrame) -> str:
    """What each agent costs after the budget that others have, and the search; "" if unknown."""
    judged, by = _courses(table, "judge"), SAC_AND_TD3.judge((table, suite))
    if not judged:
        return ""
    costs = [f"{_median(one)} times as much ({one.agent})" for one in judged]
    less = [f"{_counted(by[f'{one.agent} or the best search'])} ({one.agent})" for one in judged]
    short = float(searched(suite, SEARCHED[0]).reindex(judged[0].shares.columns).median())
    shown = cited(f"{short:.2f}", short, f"cost over theta_init's, {SEARCH}: published")
    said = [
        f"**{_head(judged, by)}**: in the median {listed(costs)}.",
        f"`{SEARCH}`, a search with {SHORT} episodes, is at {shown}. Agents end below the search in"
        f" {listed(less)} layouts.",
    ]
    if len(judged) == len(AGENTS):
        said.append(f"{' costs less than '.join(AGENTS)} in {_counted(by['SAC or TD3'])}.")
    matched, solved = (
        sum(_count(by[f"{one.agent} {asked}"]) for one in judged) for asked in (MATCHES, SOLVES)
    )
    if matched > solved:
        said.append("Who costs less need not arrive: *solved* asks for that, too.")
    return " ".join(said)


def row_table(table: pd.DataFrame, suite: pd.DataFrame) -> str:
    """One row an agent and one of the search, in HTML, in the layouts in which agents are judged.

    Args:
        table: of `studies.agents`.
        suite: the published comparison of remedies.
    """
    places = PARTS["judge"].places
    there = (suite.part == SEARCHED[0]) & (suite.entry == SEARCH) & suite.place.isin(places)
    search = remedies.rows(suite[there])
    header = ("Entry", "Share of the possible gain", "Solved", "Episodes", "CPU time")
    caption = f"Agents from nothing, and a search from hand-set weights, in {len(places)} layouts."
    cells = map(_cells, (*rows(table, suite), *search))
    return html_table(caption, header, cells, headed=True)


def in_short(table: pd.DataFrame, suite: pd.DataFrame) -> str:
    """The same in a sentence."""
    judged = _courses(table, "judge")
    return f"{_head(judged, SAC_AND_TD3.judge((table, suite)))}." if judged else waiting(table)


def longer_table(table: pd.DataFrame, suite: pd.DataFrame) -> str:
    """What it takes to match theta_init, in HTML: one row an agent and where it is judged.

    Args:
        table: of `studies.agents`.
        suite: the published comparison of remedies.
    """
    by, one, seen, new = SAC_AND_TD3.judge((table, suite)), PARTS["one"], len(TUNE), len(JUDGE)
    asked: dict[str, tuple[str, Sequence[str], str]] = {  # where: part, layouts, in a question
        f"for layout A, {one.seeds} seeds": ("one", (), "in one layout"),
        f"for {seen} layouts, in these": ("all", [*TUNE], f"over the {seen}"),
        f"for {seen} layouts, in {new} others": ("all", [*JUDGE], f"on the {new}"),
    }
    found = []
    for where, (part, among, on) in asked.items():
        for each in _courses(table, part, among):
            search = by.get(f"{each.agent} or the best search {on}")
            found.append((
                f"{each.agent} {where}",
                f"{each.episodes[-1]:,}",
                _counted(by[f"{each.agent} matches {on}"]),
                _when(each),
                _counted(search) if search else "not asked",
            ))  # fmt: skip
    header = ("Agent", "Episodes", "Matches theta_init", "Its median", f"Below `{SEARCH}`")
    caption = f"Agents with more episodes, beside `{SEARCH}` with {SHORT} a layout."
    return html_table(caption, header, found, headed=True)


def tuned() -> str:
    """How the agents were tuned."""
    tune, most = PARTS["tune"], max(map(len, SETTINGS.values()))
    return (
        f"Each was tuned with {number(most)} settings, as a remedy is, but in"
        f" {number(len(tune.places))} layouts with {tune.episodes} episodes; the best was judged,"
        f" with {number(PARTS['judge'].seeds)} seed a layout."
    )


def _courses(table: pd.DataFrame, part: str, among: Sequence[str] = ()) -> list[Course]:
    """Those that are published."""
    return [one for agent in AGENTS if len((one := course(table, part, agent, among)).last)]


def _head(judged: Sequence[Course], by: Mapping[str, Answer]) -> str:
    """In how many layouts the agents do not match, without a full stop."""
    first, *others = (f"{one.agent}{{}} in {_more(by[f'{one.agent} {MATCHES}'])}" for one in judged)
    said = [first.format(f" costs more than {INIT}"), *(one.format("") for one in others)]
    return f"After {BUDGET} episodes from nothing, {listed(said)} layouts"


def _more(answer: Answer) -> str:
    """How many say no."""
    ((yes, of),) = answer.counts.values()
    more = Count(of - yes, of)
    return cited(str(more), more, f"{answer.question}, not: published")


def _median(one: Course) -> str:
    """What it costs at the end, with the interval."""
    found = Estimate(float(one.median[-1]), *map(float, one.interval[:, -1]))
    return cited(f"{found:.2f}", found, f"cost over theta_init's, {one.agent}: published")


def _when(one: Course) -> str:
    """From when on the median matches."""
    first, always = one.matched
    if np.isinf(first):
        return "never matches"
    if np.isinf(always):
        return f"first matches after {first:,.0f}, and not at the end"
    begins = "" if first == always else f"first after {first:,.0f}, and "
    return f"matches {begins}always from {always:,.0f} on"


def _count(answer: Answer) -> int:
    """How many say yes."""
    return sum(yes for yes, _ in answer.counts.values())


def _counted(answer: Answer) -> str:
    """ "2 of 6"."""
    (count,) = answer.counts.values()
    return cited(str(Count(*count)), Count(*count), f"{answer.question}: published")


def _cells(row: RemedyRow) -> tuple[str, ...]:
    what = f"{row.name}, {row.part}, where agents are judged: published"
    solved = Count(round(row.solved.value * row.layouts), row.layouts)
    return (
        entry_named(row.name),
        cited(share_shown(row.gain), row.gain, f"share of the possible gain, {what}"),
        cited(str(solved), solved, f"layouts solved, {what}"),
        str(row.rollouts),
        cited(f"{row.seconds:.1f} s", row.seconds, f"processor time, {what}"),
    )

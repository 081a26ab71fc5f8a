"""SAC and TD3 as a page shows them: what they cost, beside the best search."""

import pandas as pd

from nmpcrl.analysis.statistics import Estimate
from nmpcrl.report.cited import Cited, Count
from nmpcrl.studies.agents import AGENTS, SAC_AND_TD3, SEARCH, SEARCHED, course, rows_of, searched


def costs(table: pd.DataFrame, suite: pd.DataFrame) -> dict[str, Cited]:
    """The median cost over theta_init's of each agent after its budget, and of the search.

    Args:
        table: of `studies.agents`.
        suite: the published comparison of remedies.
    """
    of, found = "cost over theta_init's, {}: published", {}
    for agent in AGENTS:
        one = course(table, "judge", agent)
        median = Estimate(float(one.median[-1]), *map(float, one.interval[:, -1]))
        found[agent] = Cited(median, of.format(agent))
    search = searched(suite, SEARCHED[0]).reindex(one.shares.columns).median()
    return found | {SEARCH: Cited(float(search), of.format(SEARCH))}


def counts(table: pd.DataFrame, suite: pd.DataFrame) -> dict[str, Cited]:
    """How often each question on the agents is answered by yes, by its name."""
    return {
        name: Cited(Count(*next(iter(answer.counts.values()))), f"{answer.question}: published")
        for name, answer in SAC_AND_TD3.judge((table, suite)).items()
        if answer.counts
    }


def seconds(table: pd.DataFrame) -> dict[str, float]:
    """The mean processor time of each agent in a layout, with its budget."""
    return {agent: float(rows_of(table, "judge", agent).seconds.mean()) for agent in AGENTS}

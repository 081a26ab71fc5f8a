"""What a page says of SAC and TD3 holds for whatever is published of them, and says what is not."""

import numpy as np
import pandas as pd
import pytest
from bs4 import BeautifulSoup

from nmpcrl.report.agents import finding, in_short, longer_table, panels, row_table, waiting
from nmpcrl.studies.agents import AGENTS, CHECKPOINTS, PARTS, SAC_AND_TD3
from nmpcrl.studies.agents_run import judged_in
from nmpcrl.studies.remedies import REMEDIES
from nmpcrl.study.drawn import JUDGE

COLUMNS = SAC_AND_TD3.table().columns

NOTHING = pd.DataFrame(columns=[*COLUMNS])
SHARES = {"SAC": 1.2, "TD3": 0.97}  # of theta_init's cost, at the end


def made(*parts, agents=AGENTS, there="a", meanwhile=()):
    """Runs of some parts, which cost twice as much as theta_init until the end.

    Args:
        meanwhile: episodes after which they cost 0.9 times as much.
    """
    found = []
    for part, agent in ((part, agent) for part in parts for agent in agents):
        points = CHECKPOINTS[part]
        for place, k in PARTS[part].order(agent):
            count = len(judged_in(place))
            costs = np.full((len(points), count), 200.0)
            costs[-1] = 100 * SHARES[agent]
            costs[[points.index(episodes) for episodes in meanwhile]] = 90
            arrived = [*["-" * count] * (len(points) - 1), there * count]
            row = (part, agent, place, k, [100.0] * count, costs.tolist(), arrived, points[-1])
            found.append((*row, 130 * points[-1], 60.0))
    return pd.DataFrame(found, columns=[*COLUMNS])


@pytest.fixture
def suite():
    """The search, at 0.95 of theta_init's cost, where half of what is possible is gained."""
    there = [("judge 50", layout) for layout in JUDGE] + [("named 50", "A")]
    rows = [
        {"part": part, "entry": "Bayes", "arm": "Bayes", "place": layout, "initial": 100.0,
         "best": 90.0, "cost": 95.0, "arrived": True, "episodes": 50, "over": False,
         "seconds": 2.0}
        for part, layout in there
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=REMEDIES.table().columns)


def plain(text):
    return " ".join(BeautifulSoup(text, "html.parser").get_text().split())


def cells(table):
    """The texts of a table's rows."""
    rows = BeautifulSoup(table, "html.parser").select("tbody tr")
    return [[cell.get_text() for cell in row.select("th, td")] for row in rows]


def test_of_nothing_only_what_is_missing_is_said(suite):
    assert finding(NOTHING, suite) == ""
    assert in_short(NOTHING, suite) == waiting(NOTHING)
    assert cells(longer_table(NOTHING, suite)) == []
    assert waiting(NOTHING).count("what") == len(PARTS) - 2
    assert panels(NOTHING, suite) == ({}, {})


def test_the_finding_says_of_each_agent_what_the_rule_does(suite):
    said = plain(finding(made("judge"), suite))
    assert said.startswith(
        r"**After 300 episodes from nothing, SAC costs more than $\boldsymbol{\theta}_\text{init}$"
        r" in 6 of 6 and TD3 in 0 of 6 layouts**: in the median 1.20 [1.20, 1.20] times as much"
    )
    assert "is at 0.95. Agents end below the search in 0 of 6 (SAC) and 0 of 6 (TD3)" in said
    assert "SAC costs less than TD3 in 0 of 6." in said
    assert "need not arrive" not in said
    assert "need not arrive" in finding(made("judge", there="-"), suite)


def test_an_agent_that_is_published_alone_is_shown_and_the_other_one_waited_for(suite):
    alone = made("judge", "one", "all", agents=["TD3"])
    assert "nothing, TD3 costs more than" in in_short(alone, suite)
    assert "SAC" not in finding(alone, suite)
    assert waiting(alone) == waiting(NOTHING)
    assert [len(each) for each in panels(alone, suite)[0].values()] == [1, 1, 1, 1]


def test_what_it_takes_has_a_row_an_agent_and_where_it_is_judged(suite):
    always = "matches always from 600 on"
    assert cells(longer_table(made("judge", "one"), suite)) == [
        ["SAC for layout A, 4 seeds", "600", "0 of 4", "never matches", "0 of 4"],
        ["TD3 for layout A, 4 seeds", "600", "4 of 4", always, "0 of 4"],
    ]
    *_, seen, sac, td3 = cells(longer_table(made("judge", "one", "all"), suite))
    always = "matches always from 1,600 on"
    assert seen == [
        "TD3 for 60 layouts, in these", "1,600", "60 of 60", always, "not asked"
    ]  # fmt: skip
    assert sac[0] == "SAC for 60 layouts, in 120 others"
    assert td3[1:] == ["1,600", "120 of 120", always, "0 of 120"]


def test_what_is_not_published_is_waited_for_until_it_is():
    missing = "what one agent for all layouts comes to are not published yet"
    assert missing in waiting(made("judge", "one"))
    assert waiting(made("judge", "one", "all")) == ""


def test_a_median_that_matches_and_no_longer_does_is_said_so(suite):
    sac, td3 = cells(longer_table(made("one", meanwhile=[100]), suite))
    assert sac[3] == "first matches after 100, and not at the end"
    assert td3[3] == "matches first after 100, and always from 600 on"


def test_a_figure_has_a_panel_for_what_is_published_and_the_search_where_it_is_known(suite):
    shown, search = panels(made("judge", "all"), suite)
    assert [*shown] == ["6 layouts, one by one", "one agent for 60", "and in 120 unseen"]
    assert search == {"6 layouts, one by one": 0.95, "and in 120 unseen": 0.95}


def test_the_rows_are_those_of_the_suite_in_the_layouts_of_the_agents(suite):
    rows = cells(row_table(made("judge"), suite))
    assert [one[0] for one in rows] == ["SAC", "TD3", "Bayes"]
    assert [one[1].split()[0] for one in rows] == ["−2.00", "0.30", "0.50"]
    assert [one[2:] for one in rows] == [
        ["0 of 6", "300", "60.0 s"], ["6 of 6", "300", "60.0 s"], ["6 of 6", "50", "2.0 s"]
    ]  # fmt: skip

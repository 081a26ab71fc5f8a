"""The numbers of SAC and TD3 follow from their runs."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.report import agents
from nmpcrl.studies.agents import AGENTS, CHECKPOINTS, PARTS, SAC_AND_TD3
from nmpcrl.studies.agents_run import judged_in
from nmpcrl.studies.remedies import REMEDIES
from nmpcrl.study.drawn import JUDGE

COLUMNS = SAC_AND_TD3.table().columns

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


def test_the_numbers_of_an_agent_are_those_of_its_course_and_of_the_questions(suite):
    table = made(*CHECKPOINTS)
    costs, counts = agents.costs(table, suite), agents.counts(table, suite)
    assert [f"{costs[name].value:.2f}" for name in AGENTS] == [
        "1.20 [1.20, 1.20]", "0.97 [0.97, 0.97]"
    ]  # fmt: skip
    assert costs["Bayes"].value == pytest.approx(0.95)
    shown = [str(counts[f"{name} matches in 300 episodes"].value) for name in AGENTS]
    assert shown == ["0 of 6", "6 of 6"]
    assert str(counts["TD3 or the best search"].value) == "0 of 6"
    assert agents.seconds(table) == {"SAC": 60.0, "TD3": 60.0}

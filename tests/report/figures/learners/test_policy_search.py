"""Where the robot goes with the best theta: who arrives is counted."""

import re

import numpy as np

from nmpcrl.report.figures.learners import policy_search
from nmpcrl.study import paper

THERE = np.linspace(paper.START, paper.TARGET, 30)  # a rollout that arrives ...
HALFWAY = THERE[:15].repeat(2, axis=0)  # ... and one that does not


def test_the_trajectories_count_who_arrives_and_cross_out_who_does_not():
    ways = dict.fromkeys(policy_search.WAYS, THERE)
    failed = np.where(np.arange(30)[:, None] < 10, THERE, np.nan)
    rollouts = {"A": ways, "B": ways | {"learned": HALFWAY}, "C": ways | {"by hand": failed}}
    figure = policy_search.trajectories(rollouts)
    assert re.findall(r"\d", figure.finding) == ["2", "3", "2", "3"]
    maps = [axes for axes in figure.axes if axes.get_visible()]
    assert [sum(line.get_marker() == "X" for line in axes.get_lines()) for axes in maps] == [
        0,
        1,
        1,
    ]

"""The search for the best theta: its title sums up what it saves, and who arrives is counted."""

import numpy as np

from nmpcrl.analysis.search import SearchResult
from nmpcrl.report.figures.learners import policy_search
from nmpcrl.study import paper

THERE = np.linspace(paper.START, paper.TARGET, 30)  # a rollout that arrives ...
HALFWAY = THERE[:15].repeat(2, axis=0)  # ... and one that does not


def test_the_searches_are_named_without_overlap_and_summed_up():
    found = {
        name: SearchResult(paper.THETA_INIT, 100, (1, 50), (100.0, end))
        for name, end in (("A", 90.0), ("B", 95.0), ("C", 95.1))
    }
    figure = policy_search.searches(found)
    assert figure.get_suptitle() == "The search reduces the cost by 5% to 10%"
    heights = {text.get_text().strip(): text.xy[1] for text in figure.axes[0].texts}
    assert set(heights) == set(found)
    gaps = np.diff(sorted(heights.values()))
    assert gaps.min() >= 0.005


def test_the_trajectories_count_who_arrives_and_cross_out_who_does_not():
    ways = dict.fromkeys(policy_search.WAYS, THERE)
    failed = np.where(np.arange(30)[:, None] < 10, THERE, np.nan)
    rollouts = {"A": ways, "B": ways | {"learned": HALFWAY}, "C": ways | {"by hand": failed}}
    figure = policy_search.trajectories(rollouts)
    assert figure.get_suptitle().startswith("Arrived, of 3 layouts: 2 after learning, 2 with")
    assert figure.get_suptitle().endswith("3 at best")
    maps = [axes for axes in figure.axes if axes.get_visible()]
    assert [sum(line.get_marker() == "X" for line in axes.get_lines()) for axes in maps] == [
        0,
        1,
        1,
    ]

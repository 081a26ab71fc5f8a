"""The curve of an agent is what it costs at each checkpoint, at the last as the suite judges it."""

import importlib.util

import pytest

from nmpcrl.analysis.agent_curves import curve
from nmpcrl.analysis.agents import ENTRIES
from nmpcrl.analysis.suite import Robot, entry, judge
from nmpcrl.study import paper
from nmpcrl.study.drawn import TUNE

pytestmark = pytest.mark.skipif(
    not importlib.util.find_spec("stable_baselines3"), reason="needs the extra nmpcrl[agents]"
)
QUICK = "TD3[gradient=0.1,width=8]"
A = {"A": paper.LAYOUTS["A"]}


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """One episode of random actions."""
    monkeypatch.setattr("nmpcrl.analysis.agents.RANDOM", 1)


@pytest.mark.slow
def test_the_last_checkpoint_is_what_the_suite_says_of_the_entry():
    found = curve(QUICK, A, A, [1, 2], seed=3)
    judged = judge(entry(QUICK, ENTRIES), "A", 3, 2)
    assert found.costs[-1] == [judged.cost]
    assert found.costs[0] != found.costs[-1]
    assert found.initial == [judged.initial]
    assert (found.episodes, found.steps) == (2, 260)
    assert found.arrived == ["-", "-"]
    assert found.seconds > 0


def test_one_agent_is_judged_in_each_layout_by_what_it_costs_there():
    layouts = {name: TUNE[name] for name in ("T01", "T02")}
    found = curve(QUICK, layouts, {**layouts, **A}, [2], seed=0)
    (costs,), initial = found.costs, found.initial
    assert len({*costs}) == len({*initial}) == 3
    assert initial[2] == Robot(A["A"], 1, 0).cost(paper.THETA_INIT)
    assert found.arrived == ["---"]

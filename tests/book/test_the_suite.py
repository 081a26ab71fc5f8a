"""The page on the suite: its entry runs, and what it says of a robot is so."""

import re
from pathlib import Path

import pytest

from nmpcrl.analysis.suite import Robot, gain, judge, solved
from nmpcrl.study.drawn import JUDGE, TUNE

PAGE = (Path(__file__).resolve().parents[2] / "book/the_suite.md").read_text()


@pytest.fixture
def factory():
    """What the page shows."""
    (code,) = re.findall(r"^```python\n(.*?)^```$", PAGE, flags=re.M | re.S)
    space = {}
    exec(code, space)
    return space["factory"]


def test_its_entry_keeps_to_the_budget_and_saves_cost(factory):
    found = judge(factory, "T01", 0, 4)
    assert (found.episodes, found.over) == (4, False)
    assert solved(found)
    assert gain(found) > 0


def test_a_robot_has_all_that_the_table_names():
    named = set(re.findall(r"`robot\.(\w+)", PAGE))
    robot = Robot("T01", 2, 0)
    assert len(named) > 9
    assert all(hasattr(robot, name) for name in named)


def test_what_it_says_of_the_layouts_is_so():
    assert f"has {len(TUNE)} to tune on, `TUNE`, and {len(JUDGE)} to judge on, `JUDGE`" in PAGE


def test_its_results_are_those_of_the_chapter_and_none_is_typed():
    assert "<!-- output: what_to_try_first.ipynb advice-table -->" in PAGE
    assert "<!-- output: changing_world.ipynb suite-table -->" in PAGE
    rows = [line for line in PAGE.splitlines() if line.startswith("|")]
    assert not [row for row in rows if re.search(r"\d+ ?%", row)]
    assert all("robot." in row or set(row) <= set("|- ") or "call" in row for row in rows)

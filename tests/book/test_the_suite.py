"""Chapter 7 on entering a method: the one it shows runs, and what it says of a robot is so."""

import re
from pathlib import Path

import nbformat

from nmpcrl.analysis.suite import Robot, gain, judge, solved

BOOK = Path(__file__).resolve().parents[2] / "book"
(PAGE,) = (
    cell.source
    for cell in nbformat.read(BOOK / "07_what_to_try_first.ipynb", 4).cells
    if cell.id == "enter"
)


def test_the_entry_of_the_page_saves_cost_and_a_robot_has_all_that_the_page_names():
    (code,) = re.findall(r"^```python\n(.*?)^```$", PAGE, flags=re.M | re.S)
    exec(code, space := {})
    found = judge(space["factory"], "T01", 0, 4)
    assert (found.episodes, found.over) == (4, False)
    assert solved(found)
    assert gain(found) > 0
    named = set(re.findall(r"`robot\.(\w+)", PAGE))
    assert len(named) > 9
    assert all(hasattr(Robot("T01", 2, 0), name) for name in named)

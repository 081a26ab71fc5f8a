"""`nmpcrl suite` prints one row, or disqualifies."""

import pytest

from nmpcrl.analysis.suite import ENTRIES

pytestmark = pytest.mark.usefixtures("trains_here")
GREEDY = """
from nmpcrl.study import paper

def factory(robot):
    for _ in range(robot.budget + 1):
        robot.cost(paper.THETA_INIT)
"""


def test_a_row_is_printed_and_too_many_episodes_disqualify(command, tmp_path, monkeypatch):
    short = ("--budget", "1", "--seeds", "1", "--layouts", "1")
    (tmp_path / "greedy_entry.py").write_text(GREEDY)
    monkeypatch.chdir(tmp_path)
    head, row = command("suite", "--policy", "frozen", *short).stdout.splitlines()
    assert head.split() == ["entry", "layouts", "solved", "gain", "episodes", "CPU", "time"]
    assert row.split()[:3] == ["frozen", "1", "100%"]
    head, row = command("suite", "--policy", "frozen", *short, "--moving").stdout.splitlines()
    assert head.endswith("never inside")
    assert row.endswith(" 100% [21%, 100%]")
    ended = command("suite", "--policy", "greedy_entry:factory", *short)
    assert ended.exit_code == 1
    assert "disqualified: it began more than 1 episodes in J001" in ended.stderr
    assert command("suite", "--list").stdout.split() == [*ENTRIES]

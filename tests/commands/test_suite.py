"""`nmpcrl suite` prints one row, or one sentence."""

import pytest

from nmpcrl.analysis.suite import ENTRIES

pytestmark = pytest.mark.usefixtures("trains_here")
FROZEN = ("--policy", "frozen", "--budget", "1", "--layouts")


def test_a_row_is_printed_and_says_among_moving_obstacles_how_often_none_is_entered(command):
    head, row = command("suite", *FROZEN, "2").stdout.splitlines()
    assert head.split() == ["entry", "layouts", "solved", "gain", "episodes", "CPU", "time"]
    assert row.split()[:3] == ["frozen", "2", "100%"]
    assert "0.0% [0.0%, 0.0%]" in row
    head, row = command("suite", *FROZEN, "1", "--moving").stdout.splitlines()
    assert head.split()[1] == "scenarios"
    assert head.endswith("never inside")
    assert row.endswith(" 100% [21%, 100%]")
    assert command("suite", "--list").stdout.split() == [*ENTRIES]


def test_an_entry_that_exceeds_the_budget_is_disqualified(command, tmp_path, monkeypatch):
    (tmp_path / "greedy_entry.py").write_text(
        "from nmpcrl.study import paper\n"
        "def factory(robot):\n"
        "    for _ in range(robot.budget + 1):\n"
        "        robot.cost(paper.THETA_INIT)\n"
    )
    monkeypatch.chdir(tmp_path)
    words = ("--budget", "1", "--layouts", "1", "--seeds", "1")
    ended = command("suite", "--policy", "greedy_entry:factory", *words)
    said = "greedy_entry:factory is disqualified: it began more than 1 episodes in J001"
    assert ended.stderr.endswith(f"Error: {said}\n")
    assert "disqualified" in ended.stdout

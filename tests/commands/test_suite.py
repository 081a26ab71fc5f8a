"""`nmpcrl suite` prints one row, or one sentence."""

import pytest

from nmpcrl.analysis.entries import ENTRIES

pytestmark = pytest.mark.usefixtures("trains_here")


def said(ended):
    (line,) = [line for line in ended.stderr.splitlines() if line.startswith("Error: ")]
    return line


def test_a_row_is_printed(command):
    ended = command("suite", "--policy", "frozen", "--budget", "1", "--layouts", "2")
    assert ended.exit_code == 0, ended.output
    head, row = ended.stdout.splitlines()
    assert head.split() == ["entry", "layouts", "solved", "gain", "episodes", "CPU", "time"]
    assert row.split()[:3] == ["frozen", "2", "100%"]
    assert "0.0% [0.0%, 0.0%]" in row


def test_among_obstacles_that_move_a_row_says_how_often_the_robot_is_never_inside(command):
    ended = command("suite", "--policy", "frozen", "--budget", "1", "--layouts", "1", "--moving")
    assert ended.exit_code == 0, ended.output
    head, row = ended.stdout.splitlines()
    assert head.split()[:2] == ["entry", "scenarios"]
    assert head.endswith("never inside")
    assert row.split()[:3] == ["frozen", "1", "100%"]
    assert row.endswith("0 s  100% [21%, 100%]")
    ended = command("suite", "--policy", "frozen", "--layouts", "41", "--moving")
    assert "layouts = 41 must be a whole number from 1 to 40" in said(ended)


def test_what_ships_is_listed(command):
    assert command("suite", "--list").stdout.split() == [*ENTRIES]


def test_a_policy_must_be_named(command):
    assert "--policy says what is judged" in said(command("suite"))


def test_no_entry_ends_in_a_sentence(command):
    ended = command("suite", "--policy", "nonsense")
    assert ended.exit_code == 1
    assert "must be MODULE:FACTORY, or one that ships" in said(ended)


def test_who_goes_beyond_the_budget_is_disqualified(command, tmp_path, monkeypatch):
    (tmp_path / "greedy_entry.py").write_text(
        "from nmpcrl.study import paper\n"
        "def factory(robot):\n"
        "    for _ in range(robot.budget + 1):\n"
        "        robot.cost(paper.THETA_INIT)\n"
    )
    monkeypatch.chdir(tmp_path)
    words = ("--budget", "1", "--layouts", "1", "--seeds", "1")
    ended = command("suite", "--policy", "greedy_entry:factory", *words)
    assert ended.exit_code == 1
    assert said(ended) == (
        "Error: greedy_entry:factory is disqualified: it began more than 1 episodes in J001"
    )
    assert "disqualified" in ended.stdout

"""`nmpcrl world` as a user calls it."""

import pytest

from nmpcrl.claims import world_published, world_runs
from nmpcrl.claims.world_questions import PARTS


@pytest.fixture(autouse=True)
def here(trains_here):
    """Everything in this process."""


def test_a_dry_run_counts_the_runs_and_says_what_they_take(command):
    said = command("world", "--dry-run")
    assert said.exit_code == 0, said.output
    assert "moving: 0 of 1,440 runs are stored; the others take about" in said.stdout
    assert "carry: 0 of 241 runs" in said.stdout
    assert "all that is missing: about" in said.stdout


def test_what_there_is_not_is_refused_with_what_there_is(command):
    refused = command("world", "--part", "all")
    assert refused.exit_code == 1
    assert "there is no part 'all'; there are moving, model, once" in refused.stderr


def test_what_is_not_published_is_not_judged(command):
    refused = command("world", "--judge")
    assert refused.exit_code == 1
    assert "nmpcrl world --publish" in refused.stderr


def test_a_part_is_run_published_and_judged(command, monkeypatch):
    ran = world_runs.Ran(cost=0.95, seconds=1.0)
    monkeypatch.setattr(world_runs, "run", lambda one: ran)
    monkeypatch.setattr(world_runs, "compile_ahead", lambda missing: None)
    said = command("world", "--part", "gradient", "--publish", "--workers", "1")
    assert said.exit_code == 0, said.output
    assert "noise and the gradient: confirmed (20 of 20 layouts)" in said.stdout
    assert "  expected: confirmed in part" in said.stdout
    assert "collisions: not decidable here (0 of 0 scenarios)" in said.stdout
    assert len(world_published.load().table) == 20 * len(PARTS["gradient"].arms)
    again = command("world", "--part", "gradient", "--publish", "--workers", "1")
    assert "nothing of what was run in worlds that change is whole and new" in again.stderr

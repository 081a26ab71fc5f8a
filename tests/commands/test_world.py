"""`nmpcrl world` as a user calls it."""

import pytest

from nmpcrl.claims import world_published, world_runs
from nmpcrl.claims.world_questions import PARTS

pytestmark = pytest.mark.usefixtures("trains_here")


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

"""`nmpcrl agents` as a user calls it."""

import sys

import pytest

from nmpcrl.analysis.agent_curves import Curve
from nmpcrl.claims import agent_published, agent_runs

pytestmark = pytest.mark.usefixtures("trains_here")


def test_without_the_extra_one_sentence_says_what_is_missing(command, monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    refused = command("agents", "--part", "tune", "--workers", "1")
    assert refused.exit_code == 1
    assert "needs stable-baselines3: `pip install nmpcrl[agents]` brings it" in refused.stderr
    assert "Traceback" not in refused.stderr


def test_parts_are_run_published_and_judged(command, monkeypatch):
    made = Curve([100.0], [[90.0]] * 7, ["a"] * 7, 300, 39_000, 1.0)
    monkeypatch.setattr(agent_runs, "run", lambda one: made)
    monkeypatch.setattr(agent_runs, "require", lambda: None)
    parts = ("--part", "tune", "--part", "judge", "--workers", "1")
    said = command("agents", *parts, "--publish")
    assert said.exit_code == 0, said.output
    assert "SAC matches in 300 episodes: confirmed (6 of 6 layouts)" in said.stdout
    assert "  expected: confirmed in part" in said.stdout
    assert "SAC matches in one layout: not decidable here (0 of 0 seeds)" in said.stdout
    assert len(agent_published.load().table) == 24 + 12

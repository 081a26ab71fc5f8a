"""The command `nmpcrl` as a user calls it, on a folder of runs of this test's own."""

import pytest
from click.testing import CliRunner

from nmpcrl.commands import main


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    monkeypatch.setenv("NMPCRL_PUBLISHED", str(tmp_path / "published"))
    return lambda *words: CliRunner().invoke(main, words)

"""What git says of questions that were fixed before the runs, for the tests of such a file."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def no_history(reason: str) -> None:
    """Skip a test of the history; where that must be tested, fail."""
    if os.environ.get("NMPCRL_REQUIRE_HISTORY") or os.environ.get("CI"):
        pytest.fail(f"no history: {reason}, and NMPCRL_REQUIRE_HISTORY or CI is set")
    pytest.skip(f"no history: {reason}")


def git(*arguments: str) -> str:
    asked = ["git", "-C", str(ROOT), *arguments]
    shallow = ["git", "-C", str(ROOT), "rev-parse", "--is-shallow-repository"]
    done, whole = (subprocess.run(one, capture_output=True, text=True) for one in (asked, shallow))
    if done.returncode or whole.stdout.strip() != "false":
        no_history(done.stderr or "this is a shallow clone")
    return done.stdout.strip()

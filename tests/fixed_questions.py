"""What git says of questions that were fixed before the runs, for the tests of such a file."""

import os
import subprocess
from pathlib import Path

import pytest

from nmpcrl.study.provenance import code

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


def added(path: str) -> str:
    """The commit that added a file."""
    found = git("log", "--format=%H", "--diff-filter=A", "--", path)
    if not found:
        no_history(f"{path} is not committed yet")
    return found.splitlines()[-1]


def assert_unmoved(file: Path) -> None:
    """The code of a file is that of the commit which added it."""
    path = file.relative_to(ROOT).as_posix()
    assert code(git("show", f"{added(path)}:{path}")) == code(file.read_text("utf-8"))


def assert_older(file: Path, runs: str, part: str = "") -> None:
    """The commit that added a file comes before that of the runs that answer it.

    Args:
        file: with the questions.
        runs: the path of what is published.
        part: a word that came into it with these runs; by default they came with the file.
    """
    path = file.relative_to(ROOT).as_posix()
    since = git("log", "--format=%H", f"-S{part}", "--", runs).splitlines() if part else []
    published = since[-1] if part else added(runs)
    assert added(path) in git("rev-list", f"{published}^").split()

"""What git says of questions that were fixed before the runs, for the tests of such a file."""

import subprocess
from pathlib import Path

import pytest

from nmpcrl.study.provenance import code

ROOT = Path(__file__).resolve().parents[1]


def git(*arguments: str) -> str:
    asked = ["git", "-C", str(ROOT), *arguments]
    shallow = ["git", "-C", str(ROOT), "rev-parse", "--is-shallow-repository"]
    done, whole = (subprocess.run(one, capture_output=True, text=True) for one in (asked, shallow))
    if done.returncode or whole.stdout.strip() != "false":
        pytest.skip(f"the history is not here: {done.stderr}")
    return done.stdout.strip()


def added(path: str) -> str:
    """The commit that added a file."""
    found = git("log", "--format=%H", "--diff-filter=A", "--", path)
    if not found:
        pytest.skip(f"{path} is not committed yet")
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

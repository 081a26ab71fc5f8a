"""What CONTRIBUTING names is there, and its table says where the lock is made anew."""

import re
import shlex
from pathlib import Path

import pytest

from nmpcrl.commands import main
from nmpcrl.study.lock import sources

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text()
ROWS = re.findall(r"^\| an? ([\w ]+) \| (.*?) \| ?(.*?) ?\|$", TEXT, flags=re.M)


def test_files_packages_commands_and_targets_that_are_named_are_there():
    for name in re.findall(r"`([\w.]+/[\w./]+\.\w+)`", TEXT):
        assert re.search(r"/[A-Z_]{4,}[a-z]*\.", name) or (ROOT / name).is_file(), name
    packages = {path.parent.name for path in ROOT.glob("nmpcrl/*/__init__.py")}
    assert set(re.findall(r"^\| `(\w+)` \|", TEXT, flags=re.M)) == packages
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), flags=re.M))
    assert set(re.findall(r"\bmake ([a-z-]+)(?=[ `]|$)", TEXT, flags=re.M)) <= targets
    for command in re.findall(r"`nmpcrl ([^`]+)`", TEXT):
        name, *arguments = shlex.split(command)
        main.commands[name].make_context(name, arguments)


@pytest.mark.parametrize(("thing", "files", "lock"), ROWS, ids=[row[0] for row in ROWS])
def test_an_addition_needs_a_new_lock_where_its_row_says_so(thing, files, lock):
    """NAME in a row stands for any name: such files are there already."""
    patterns = [re.sub(r"[A-Z][A-Z_]+", "*", one) for one in re.findall(r"`([^`]+)`", files)]
    found = [[*ROOT.glob(pattern)] for pattern in patterns]
    assert all(found), thing
    locked = {f"nmpcrl/{name}" for name in sources()}
    named = {path.relative_to(ROOT).as_posix() for paths in found for path in paths}
    assert bool(named & locked) == (lock == "anew")

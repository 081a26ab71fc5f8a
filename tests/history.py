"""What Git says of an investigation, and modules as they were when it was registered."""

import io
import os
import subprocess
import sys
import tarfile
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp
from types import ModuleType

import pytest

from nmpcrl.studies.agents import SAC_AND_TD3
from nmpcrl.studies.difficulty import DIFFICULTY
from nmpcrl.studies.interventions import INTERVENTIONS
from nmpcrl.studies.other_problems import OTHER_PROBLEMS
from nmpcrl.studies.population import POPULATION
from nmpcrl.studies.remedies import REMEDIES
from nmpcrl.studies.worlds import WORLDS

ROOT = Path(__file__).resolve().parents[1]
INVESTIGATIONS = (
    SAC_AND_TD3, DIFFICULTY, INTERVENTIONS, OTHER_PROBLEMS, POPULATION, REMEDIES, WORLDS,
)  # fmt: skip


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


@cache
def library(commit: str) -> Path:
    """A folder with the library of a commit."""
    git("cat-file", "-e", f"{commit}^{{commit}}")  # skips, or fails, without the history
    asked = ["git", "-C", str(ROOT), "archive", commit, "nmpcrl"]
    archive = subprocess.run(asked, check=True, capture_output=True).stdout
    folder = Path(mkdtemp(prefix=f"nmpcrl-{commit}-"))
    with tarfile.open(fileobj=io.BytesIO(archive)) as file:
        file.extractall(folder, filter="data")
    return folder


@cache
def module(commit: str, name: str) -> ModuleType:
    """A module of a commit, which imports the library of the same commit."""
    path, today = str(library(commit)), _imported()
    for one in today:
        del sys.modules[one]
    sys.path.insert(0, path)
    try:
        return import_module(name)
    finally:
        sys.path.remove(path)
        for one in _imported():
            del sys.modules[one]
        sys.modules.update(today)


def _imported() -> dict[str, ModuleType]:
    return {k: one for k, one in sys.modules.items() if k.partition(".")[0] == "nmpcrl"}

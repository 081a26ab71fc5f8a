"""Wrong numbers that tests must notice: `python tests/mutants.py [claims studies/shifts.py ...]`.

A mutant is one line of the library with a mistake that would put a wrong number before a reader. In
a copy of the project each is made in turn, and the tests that are named for its file must fail.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
import traceback
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
FAST = "not (slow or weekly or browser or network or built)"
SLOW_TO_IMPORT = "casadi cma matplotlib.pyplot numba pandas scipy.stats torch"

LISTED = tomllib.loads((ROOT / "tests/mutants.toml").read_text("utf-8"))


class Mutant(NamedTuple):
    """One line with a mistake."""

    file: str
    old: str
    new: str
    tests: str


def mutants(*places: str) -> list[Mutant]:
    """Those of some packages or files, or all."""
    return [
        Mutant(file, old, new, LISTED["tests"].get(file, file.replace("/", "/test_", 1)))
        for file, old, new in LISTED["mutants"]
        if file.startswith(places or "")
    ]


def fails(project: Path, tests: str) -> bool:
    """Whether one of the fast tests in some files fails, in a process that imports nothing anew."""
    child = os.fork()
    if not child:
        code = 99
        try:
            os.chdir(project)
            os.environ["PYTHONPATH"] = sys.path[0] = str(project)
            with Path("said.txt").open("w") as said:
                os.dup2(said.fileno(), 1), os.dup2(said.fileno(), 2)
            paths = [f"tests/{one}" for one in tests.split()]
            code = import_module("pytest").main(["-xq", "-pno:cacheprovider", "-m", FAST, *paths])
        except BaseException:
            traceback.print_exc()  # into the file that the error below shows
        finally:
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code not in (0, 1, 2):  # passed, failed, or could not even import the library
        raise RuntimeError(f"pytest ends with {code}:\n{(project / 'said.txt').read_text()}")
    return code > 0


def caught(project: Path, one: Mutant) -> bool:
    """Whether the tests of a mutant fail; the project is left as it was."""
    path = project / "nmpcrl" / one.file
    text = path.read_text("utf-8")
    try:
        path.write_text(text.replace(one.old, one.new), "utf-8")
        return fails(project, one.tests)
    finally:
        path.write_text(text, "utf-8")


def copied(project: Path) -> Path:
    """A copy of the project, without what Git ignores."""
    asked = ["git", "ls-files", "-co", "--exclude-standard"]
    listed = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in listed.splitlines():
        if (ROOT / name).is_file():
            (project / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, project / name)
    return project


def main(*places: str) -> int:
    """Print a line a mutant; the number of those that survive."""
    for name in SLOW_TO_IMPORT.split():
        import_module(name)
    chosen, survived = mutants(*places), 0
    with tempfile.TemporaryDirectory() as folder:
        project = copied(Path(folder))
        for tests in {one.tests: "" for one in chosen}:
            if fails(project, tests):
                raise SystemExit(f"without a mutant:\n{(project / 'said.txt').read_text()}")
        for one in chosen:
            fell = caught(project, one)
            survived += not fell
            print("caught  " if fell else "SURVIVED", one.file, one.old.strip(), flush=True)
    print(f"{len(chosen) - survived} of {len(chosen)} mutants are caught")
    return survived


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

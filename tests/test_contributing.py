"""What CONTRIBUTING, the workflows and `.ci/run` name is there, and packages are pinned once."""

import re
import shlex
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from nmpcrl.commands import main
from nmpcrl.study.files import folder
from nmpcrl.study.lock import sources

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text()
MAKEFILE = (ROOT / "Makefile").read_text()
TARGETS = {*re.findall(r"^([\w-]+):", MAKEFILE, flags=re.M)}
WORKFLOWS = {path.stem: yaml.safe_load(path.read_text())["jobs"]
             for path in sorted((ROOT / ".github/workflows").glob("*.yml"))}  # fmt: skip
DRIVER = "".join(path.read_text() for path in (ROOT / "book/driver/build").glob("*.py"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
ROWS = re.findall(r"^\| an? ([\w ]+) \| (.*?) \| ?(.*?) ?\|$", TEXT, flags=re.M)


def test_files_packages_commands_and_targets_that_are_named_are_there():
    for name in re.findall(r"`([\w.]+/[\w./]+\.\w+)`", TEXT):
        assert re.search(r"/[A-Z_]{4,}[a-z]*\.", name) or (ROOT / name).is_file(), name
    packages = {path.parent.name for path in ROOT.glob("nmpcrl/*/__init__.py")}
    assert set(re.findall(r"^\| `(\w+)` \|", TEXT, flags=re.M)) == packages
    assert set(re.findall(r"\bmake ([a-z-]+)(?=[ `]|$)", TEXT, flags=re.M)) <= TARGETS
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


@pytest.mark.parametrize("jobs", WORKFLOWS.values(), ids=WORKFLOWS)
def test_a_workflow_calls_what_is_there_and_keeps_what_is_written(jobs, monkeypatch):
    monkeypatch.delenv("NMPCRL_RUNS", raising=False)
    for job in jobs.values():
        steps = job["steps"]
        run = [step["run"] for step in steps if "run" in step]
        for line in run:
            program, name, *arguments = shlex.split(line)
            if program == "make":
                assert name in TARGETS
            elif program == ".venv/bin/nmpcrl":
                main.commands[name].make_context(name, arguments)
            else:
                assert (program, name) == (".venv/bin/pip", "wheel")
        for step in steps:  # no tag, which others can move
            assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", step.get("uses", f"a@{'0' * 40}"))
        kept = [step["with"]["path"] for step in steps if "upload" in step.get("uses", "")]
        for place in " ".join(kept).split():
            first, _, name = place.partition("/")
            assert first == "_build" or place == str(folder() / "summaries")
            assert first != "_build" or name == "wheel" or f'place / "{name}' in DRIVER
        if any(line.startswith("make test") for line in run):
            assert steps[0]["with"] == {"fetch-depth": 0}  # tests ask the history
        if {"make test-site", "make test-all"} & {*run}:
            assert job["env"]["NMPCRL_REQUIRE_BROWSER"]


def test_each_push_runs_the_same_here_and_there():
    asked = re.findall(r"^make [\w-]+", (ROOT / ".ci/run").read_text(), flags=re.M)
    build = WORKFLOWS["book"]["build"]["steps"]
    assert asked == [step["run"] for step in build if step.get("run")]


def test_what_is_imported_is_pinned_once_and_all_places_name_the_same_pythons():
    lines = (ROOT / "environment.txt").read_text().splitlines()
    pins = [Requirement(line) for line in lines if line and not line.startswith("#")]
    names = [canonicalize_name(one.name) for one in pins]
    assert all(re.fullmatch(r"==[\w.]+", str(one.specifier)) and not one.url for one in pins)
    assert len(names) == len(set(names))
    project = PROJECT["project"]
    extras = project["optional-dependencies"].values()
    needed = {*project["dependencies"], *(name for extra in extras for name in extra)}
    needed = {name for name in needed if not name.startswith("nmpcrl[")}  # another extra
    assert {canonicalize_name(Requirement(one).name) for one in needed} <= {*names}
    requires = SpecifierSet(PROJECT["project"]["requires-python"])
    pythons = [python for python in (f"3.{minor}" for minor in range(50)) if python in requires]
    assert re.search(r"^PYTHONS := (.*)$", MAKEFILE, flags=re.M)[1].split() == pythons
    assert WORKFLOWS["book"]["pythons"]["strategy"]["matrix"]["python"] == pythons
    assert PROJECT["tool"]["mypy"]["python_version"] == pythons[0]

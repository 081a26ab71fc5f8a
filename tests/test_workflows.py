"""The workflows call what is there, and keep what the build writes."""

import re
import shlex
from pathlib import Path

import pytest
import yaml

from nmpcrl.commands import main
from nmpcrl.study.files import folder

ROOT = Path(__file__).resolve().parents[1]
PATHS = sorted((ROOT / ".github/workflows").glob("*.yml"))
TARGETS = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), flags=re.M)
DRIVER = "".join(path.read_text() for path in (ROOT / "book/driver/build").glob("*.py"))

each_workflow = pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)


def jobs(path: Path) -> list[dict]:
    return list(yaml.safe_load(path.read_text())["jobs"].values())


def steps(path: Path) -> list[dict]:
    return [step for job in jobs(path) for step in job["steps"]]


@each_workflow
def test_every_command_is_a_target_of_make_or_a_command_of_the_package(path):
    lines = [step["run"] for step in steps(path) if "run" in step]
    assert lines
    for line in lines:
        program, name, *arguments = shlex.split(line)
        if program == "make":
            assert name in TARGETS or name == ".venv/ready"
        elif program == ".venv/bin/nmpcrl":
            main.commands[name].make_context(name, arguments)
        else:
            assert (program, name) == (".venv/bin/pip", "wheel")


@each_workflow
def test_artifacts_are_kept_from_where_they_are_written(path, monkeypatch):
    monkeypatch.delenv("NMPCRL_RUNS", raising=False)
    kept = [step["with"] for step in steps(path) if "upload" in step.get("uses", "")]
    assert kept
    for place in " ".join(one["path"] for one in kept).split():
        first, _, name = place.partition("/")
        assert first == "_build" or place == str(folder() / "summaries")
        if first == "_build" and name != "wheel":
            assert f'place / "{name}' in DRIVER
    names = [one["name"] for one in kept if "name" in one]
    assert len(names) == len(set(names))


@each_workflow
def test_actions_of_others_are_named_by_a_hash_that_nobody_can_move(path):
    for step in steps(path):
        assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", step.get("uses", f"a@{'0' * 40}"))


@each_workflow
def test_a_job_that_tests_has_the_whole_history_and_one_that_needs_a_browser_says_so(path):
    for job in jobs(path):
        runs = [step.get("run", "") for step in job["steps"]]
        if any(re.match(r"make test(-slow|-weekly)?$", one) for one in runs):
            assert job["steps"][0]["with"] == {"fetch-depth": 0}
        if {"make test-site", "make test-weekly", "make test-lab"} & {*runs}:
            assert job["env"]["NMPCRL_REQUIRE_BROWSER"]


def test_each_push_builds_checks_and_tests_and_names_only_targets():
    lines = re.findall(r"^make ([^#\n]+)", (ROOT / ".ci/run").read_text(), flags=re.M)
    asked = {word for line in lines for word in line.split() if re.match(r"[a-z]", word)}
    assert {"book", "check", "test", "test-slow", "test-site"} <= asked <= {*TARGETS}


def test_every_test_target_is_run_by_a_workflow():
    run = {step.get("run") for path in PATHS for step in steps(path)}
    assert {f"make {name}" for name in TARGETS if name.startswith("test")} <= run

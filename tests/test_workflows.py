"""The workflows and `.ci/run` call what is there, and keep what the build writes."""

import re
import shlex
from pathlib import Path

import pytest
import yaml

from nmpcrl.commands import main
from nmpcrl.study.files import folder

ROOT = Path(__file__).resolve().parents[1]
PATHS = sorted((ROOT / ".github/workflows").glob("*.yml"))
TARGETS = {*re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), flags=re.M)}
DRIVER = "".join(path.read_text() for path in (ROOT / "book/driver/build").glob("*.py"))


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_a_workflow_calls_what_is_there_and_keeps_what_is_written(path, monkeypatch):
    monkeypatch.delenv("NMPCRL_RUNS", raising=False)
    for job in yaml.safe_load(path.read_text())["jobs"].values():
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
    build = yaml.safe_load((ROOT / ".github/workflows/book.yml").read_text())["jobs"]["build"]
    assert asked == [step["run"] for step in build["steps"] if step.get("run")]

"""`nmpcrl investigate` with the book's investigations and with a reader's own file."""

import json
import re
import subprocess
import textwrap
from pathlib import Path

import pytest

from nmpcrl.claims.investigation import NoInvestigation, of_file

pytestmark = pytest.mark.usefixtures("trains_here")

OWN = """
    from nmpcrl.claims.investigation import Investigation, Part, Question, lower
    from nmpcrl.claims.verdict import REPRODUCED

    def run(setting, place, episodes, seed):
        return {"cost": setting * seed}

    STUDY = Investigation(
        name="mine",
        parts={"all": Part(run, {"one": 1.0, "two": 2.0}, [f"L{i}" for i in range(12)], 5)},
        questions=[Question("first", "Is one below two?", REPRODUCED, lower("all", "one", "two"))],
        seed=lambda place, k: 1 + int(place[1:]) + k,
    )
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    path = tmp_path / "mine" / "my_study.py"
    path.parent.mkdir()
    path.write_text(textwrap.dedent(OWN))
    return path


def test_a_reader_s_own_investigation_is_one_file_and_one_verb(own, command):
    said = command("investigate", str(own), "--dry-run")
    assert "all: 0 of 24 rows are stored" in said.stdout
    said = command("investigate", str(own), "--publish", "--workers", "2")
    assert said.exit_code == 0, said.output
    assert "first: confirmed (12 of 12 layouts)" in said.stdout
    assert (own.parent / "published" / "mine.csv").exists()
    assert of_file(own).registered == ""


def test_the_file_of_the_page_on_your_paper_is_run_interrupted_published_and_judged(
    tmp_path, monkeypatch, command
):
    monkeypatch.setenv("NMPCRL_RUNS", str(tmp_path / "runs"))
    page = Path(__file__).parents[2] / "book" / "your_paper.ipynb"
    texts = ("".join(cell["source"]) for cell in json.loads(page.read_text())["cells"])
    (block,) = (re.findall(r"```python\n(.*?)```", text, re.S) for text in texts if "CHAIN" in text)
    path = tmp_path / "mine" / "chain.py"
    path.parent.mkdir()
    path.write_text(block[0])
    made = command("investigate", str(path), "--workers", "1")
    assert "P1: confirmed (12 of 12 runs)" in made.stdout
    log = tmp_path / "runs" / "chain.jsonl"
    log.write_text(log.read_text()[:-40])
    assert "all: 59 of 60 rows are stored" in command("investigate", str(path), "--dry-run").stdout
    unpublished = command("investigate", str(path), "--judge").stderr
    assert "nothing is published in" in unpublished
    assert "git checkout" not in unpublished  # the project's data are others
    said = command("investigate", str(path), "--publish", "--workers", "1")
    assert said.exit_code == 0
    assert "not registered: commit" in said.stdout
    again = command("investigate", str(path), "--publish", "--workers", "1")
    assert "no arm of chain is complete and new" in again.stderr
    log.unlink()
    assert command("investigate", str(path), "--judge").stdout == made.stdout


def test_a_committed_file_is_registered_by_its_commit(own):
    def git(*arguments):
        who = ("-c", "user.name=n", "-c", "user.email=e@example.org")
        asked = ["git", "-C", str(own.parent), *who, *arguments]
        return subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()

    git("init", "-q")
    git("add", own.name)
    git("commit", "-qm", "Ask")
    assert of_file(own).registered == git("rev-parse", "HEAD")
    own.write_text(own.read_text() + "\n# changed\n")
    assert of_file(own).registered == ""


@pytest.mark.parametrize(
    ("content", "said"),
    [(None, "no Python file"), ("1/0", "fails: ZeroDivisionError"), ("x = 1", "defines 0")],
)
def test_a_file_that_defines_no_investigation_is_refused(tmp_path, content, said):
    path = tmp_path / "wrong.py"
    if content:
        path.write_text(content)
    with pytest.raises(NoInvestigation, match=said):
        of_file(path)

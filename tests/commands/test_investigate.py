"""`nmpcrl investigate` with a reader's own file, and files that are none."""

import shutil
import subprocess

import pytest
from builders import own_investigation

from nmpcrl.studies.investigation import of_file
from nmpcrl.study import published
from nmpcrl.study.refusal import Refusal

pytestmark = pytest.mark.usefixtures("trains_here")


@pytest.fixture
def own(runs):
    """The file in a folder of its own."""
    path = runs.parent / "mine" / "chain.py"
    path.parent.mkdir()
    path.write_text(own_investigation())
    return path


def test_a_file_is_run_interrupted_published_and_judged(own, runs, command):
    assert "all: 0 of 60 rows are stored" in command("investigate", str(own), "--dry-run").stdout
    made = command("investigate", str(own), "--workers", "2")
    assert "P1: confirmed (12 of 12 runs)" in made.stdout
    log = runs / "chain.jsonl"
    log.write_text(log.read_text()[:-40])
    assert "all: 59 of 60 rows are stored" in command("investigate", str(own), "--dry-run").stdout
    unpublished = command("investigate", str(own), "--judge").stderr
    assert "nothing is published in" in unpublished
    assert "git checkout" not in unpublished  # the project's data are others
    said = command("investigate", str(own), "--publish", "--workers", "1")
    assert said.exit_code == 0
    assert (own.parent / "published" / "chain.csv").exists()
    assert "not registered: commit" in said.stdout
    again = command("investigate", str(own), "--publish", "--workers", "1")
    assert "no arm of chain is complete and new" in again.stderr
    log.unlink()
    assert command("investigate", str(own), "--judge").stdout == made.stdout


def test_a_committed_file_is_registered_by_its_commit(own, command):
    def git(*arguments):
        who = ("-c", "user.name=n", "-c", "user.email=e@example.org")
        asked = ["git", "-C", str(own.parent), *who, *arguments]
        return subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()

    git("init", "-q")
    git("add", own.name)
    git("commit", "-qm", "Ask")
    assert of_file(own).registered == git("rev-parse", "HEAD")
    said = command("investigate", str(own), "--publish", "--workers", "1").stdout
    commit = published.about(of_file(own).name, own.parent / "published")["registered"]
    assert commit == git("rev-parse", "HEAD")
    assert "not registered" not in said + command("investigate", str(own), "--judge").stdout
    own.write_text(own.read_text() + "\n# a comment changes no number\n")
    assert of_file(own).registered == commit
    own.write_text(own.read_text().replace("Does the semi", "When does the semi"))
    assert of_file(own).registered == ""
    said = command("investigate", str(own), "--judge").stdout
    assert "not registered: the table is older than" in said
    git("commit", "-qam", "Ask otherwise")
    shutil.rmtree(own.parent / "published")
    published._manifest.cache_clear()
    assert "published" in command("investigate", str(own), "--publish", "--workers", "1").stdout
    entry = published.about(of_file(own).name, own.parent / "published")
    assert entry["registered"] == git("rev-parse", "HEAD")
    assert [one["rows"] for one in entry["batches"]] == [{"all": 60}]
    assert "not registered" not in command("investigate", str(own), "--judge").stdout
    own.write_text(own.read_text().replace("0.97, 0.05, 600", "0.97, 0.05, 601"))
    git("commit", "-qam", "Change the numbers")
    said = command("investigate", str(own), "--publish", "--workers", "1").stderr
    assert "give the investigation another name" in said


@pytest.mark.parametrize(
    ("content", "said"),
    [(None, "no Python file"), ("1/0", "fails: ZeroDivisionError"), ("x = 1", "defines 0")],
)
def test_a_file_that_defines_no_investigation_is_refused(tmp_path, content, said):
    path = tmp_path / "wrong.py"
    if content:
        path.write_text(content)
    with pytest.raises(Refusal, match=said):
        of_file(path)

"""When the thresholds were fixed: what git says, and without git what is published."""

import shutil
import subprocess
from pathlib import Path

import pytest

from nmpcrl.claims import prespecified, published
from nmpcrl.claims.prespecified import (
    NUMBERS,
    RUNS,
    SINCE,
    Commit,
    Fixed,
    fixed,
    from_facts,
    from_git,
)

ROOT = Path(__file__).resolve().parents[2]
TODAY = "".join(f"{name} = {value!r}\n" for name, value in NUMBERS.items())
OTHER = TODAY.replace("DIVERGED = 1.5", "DIVERGED = 1.4")


def git(place: Path, *arguments: str) -> str:
    return subprocess.run(
        ["git", "-C", str(place), *arguments], capture_output=True, text=True, check=True
    ).stdout.strip()


class Project:
    """A repository with one file of thresholds."""

    def __init__(self, place: Path) -> None:
        self.place = place
        (place / "nmpcrl").mkdir(parents=True)
        git(place, "init", "-q")
        git(place, "config", "user.name", "nobody")
        git(place, "config", "user.email", "nobody@localhost")

    def commit(self, text: str, name: str = "nmpcrl/claims.py") -> str:
        path = self.place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        git(self.place, "add", "--all")
        git(self.place, "commit", "-qm", name)
        return git(self.place, "rev-parse", "HEAD")


@pytest.fixture
def project(tmp_path):
    return Project(tmp_path / "project")


def test_it_is_the_first_commit_since_which_every_number_is_todays(project):
    project.commit(OTHER)
    expected = project.commit(TODAY)
    project.commit(f"# said otherwise\n{TODAY}OTHER = 3\n")
    runs = project.commit("cost\n", RUNS)
    project.commit("cost\n1\n", RUNS)
    found = from_git(project.place)
    assert found
    assert (found.thresholds.hash, found.published.hash) == (expected, runs)


def test_moving_the_numbers_to_other_files_fixes_nothing_anew(project):
    expected = project.commit(TODAY)
    project.commit("cost\n", RUNS)
    first, rest = TODAY.split("\n", 1)
    (project.place / "nmpcrl/rule.py").write_text(rest)
    project.commit(f"{first}  # moved\n")
    assert from_git(project.place).thresholds.hash == expected


def test_numbers_that_were_moved_and_moved_back_are_fixed_from_then_on(project):
    project.commit(TODAY)
    project.commit(OTHER)
    expected = project.commit(TODAY)
    project.commit("cost\n", RUNS)
    assert from_git(project.place).thresholds.hash == expected


def test_another_thing_of_the_same_name_is_no_threshold(project):
    expected = project.commit(TODAY)
    project.commit("HALF = re.compile('half')\n", "nmpcrl/store.py")
    project.commit("cost\n", RUNS)
    assert from_git(project.place).thresholds.hash == expected


def test_thresholds_that_were_fixed_after_the_runs_were_published_are_not_called_fixed(project):
    project.commit(OTHER)
    project.commit("cost\n", RUNS)
    project.commit(TODAY)
    assert from_git(project.place) is None


def test_numbers_that_are_not_todays_are_not_called_fixed(project):
    project.commit(OTHER)
    project.commit("cost\n", RUNS)
    assert from_git(project.place) is None


def test_a_history_that_is_cut_off_says_nothing(project, tmp_path):
    project.commit(TODAY)
    project.commit("cost\n", RUNS)
    place = tmp_path / "shallow"
    git(tmp_path, "clone", "-q", "--depth=1", project.place.as_uri(), str(place))
    assert from_git(place) is None


def test_a_copy_inside_another_repository_is_not_taken_for_it(project):
    project.commit(TODAY)
    project.commit("cost\n", RUNS)
    inside = project.place / "nmpcrl"
    assert from_git(inside) is None


@pytest.mark.parametrize("reason", ["no repository", "no git"])
def test_without_a_repository_or_git_the_published_facts_are_read(tmp_path, monkeypatch, reason):
    if reason == "no git":
        monkeypatch.setenv("PATH", str(tmp_path))
    known = Fixed(Commit("a" * 40, "2026-01-01 10:00"), Commit("b" * 40, "2026-01-02 10:00"))
    assert fixed({"fixed": known.facts}, tmp_path) == known
    assert fixed({}, tmp_path) is None


def test_published_facts_about_other_numbers_are_not_read(monkeypatch):
    known = Fixed(Commit("a" * 40, "2026-01-01 10:00"), Commit("b" * 40, "2026-01-02 10:00"))
    facts = known.facts
    assert from_facts(facts) == known
    monkeypatch.setitem(prespecified.NUMBERS, "DIVERGED", 1.4)
    assert from_facts(facts) is None


def test_the_published_facts_are_what_this_repository_says():
    found = from_git(ROOT)
    if found is None:
        assert shutil.which("git") is None or not (ROOT / ".git").exists() or shallow()
        pytest.skip("the history is not here")
    assert published.load().about["fixed"] == found.facts


def shallow() -> bool:
    return git(ROOT, "rev-parse", "--is-shallow-repository") == "true"


@pytest.mark.parametrize("one", SINCE, ids=lambda one: one.commit)
def test_what_was_decided_later_is_a_commit_of_that_date(one):
    try:
        known = prespecified._commit(prespecified.ROOT, one.commit)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("there is no history here")
    assert known.hash.startswith(one.commit)
    assert known.date == one.date


def test_decisions_are_listed_in_their_order():
    assert [one.date for one in SINCE] == sorted(one.date for one in SINCE)

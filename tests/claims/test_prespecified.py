"""The commits that fixed the thresholds and published the runs, compared with git."""

import ast
import re
import subprocess

import fixed_questions
import pytest
from fixed_questions import ROOT, no_history

from nmpcrl.claims import prespecified, published
from nmpcrl.claims.prespecified import NUMBERS, Commit, Fixed, decided_since, fixed
from nmpcrl.study import published as store

ASSIGNED = f"^({'|'.join(NUMBERS)}) = "


def git(*arguments: str) -> str:
    """The output of git in UTC; 1, for nothing found, is no failure."""
    asked = ["git", "-C", str(ROOT), *arguments]
    done = subprocess.run(asked, capture_output=True, text=True, env={"TZ": "UTC", "LC_ALL": "C"})
    if done.returncode > 1:
        no_history(done.stderr)
    return done.stdout.strip()


@pytest.fixture
def history():
    if not (ROOT / ".git").exists() or git("rev-parse", "--is-shallow-repository") == "true":
        no_history("this is a shallow clone, or none")


@pytest.mark.usefixtures("history")
@pytest.mark.parametrize("required", ["CI", "NMPCRL_REQUIRE_HISTORY", "ANYTHING_ELSE"])
def test_a_shallow_clone_skips_or_fails_these_tests(tmp_path, monkeypatch, required):
    for name in ("CI", "NMPCRL_REQUIRE_HISTORY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(required, "true")
    subprocess.run(["git", "clone", "-q", "--depth=1", ROOT.as_uri(), tmp_path], check=True)
    monkeypatch.setattr(fixed_questions, "ROOT", tmp_path)
    loud = pytest.skip.Exception if required == "ANYTHING_ELSE" else pytest.fail.Exception
    with pytest.raises(loud, match="this is a shallow clone"):
        fixed_questions.git("log")


def commit(name: str) -> Commit:
    shown = ("--format=%H %cd", "--date=format-local:%Y-%m-%d %H:%M")
    found, _, date = git("show", "-s", *shown, name).partition(" ")
    return Commit(found, date)


def numbers_in(state: str) -> dict:
    """The numbers that were assigned at the left margin in a state of the code.

    Investigations have names and commits of their own.
    """
    found, rooms = {}, ("nmpcrl", ":!nmpcrl/studies")
    for line in git("grep", "-h", "-E", ASSIGNED, state, "--", *rooms).splitlines():
        name, _, value = line.partition(" = ")
        if re.match(r"[\d(.]", value):  # and not another thing of the same name
            found[name] = ast.literal_eval(value.partition("#")[0].strip())
    return found


@pytest.mark.usefixtures("history")
def test_the_thresholds_are_those_of_the_named_commit_and_older_than_the_runs():
    found = fixed(published.load().about)
    changes = git("log", "--topo-order", "--format=%H", "-E", "-G", ASSIGNED, "--", "*.py").split()
    first = changes.index(found.thresholds.hash)
    assert all(numbers_in(state) == NUMBERS for state in changes[: first + 1])
    assert numbers_in(f"{found.thresholds.hash}^") != NUMBERS
    added = git("log", "--format=%H", "--diff-filter=A", "--", "book/published/runs.csv").split()
    assert found.published.hash == added[-1] == store.about("runs")["first"]["all"]
    assert store.about("runs")["registered"] == found.thresholds.hash
    assert found.thresholds.hash in git("rev-list", found.published.hash).split()
    for one in (found.thresholds, found.published):
        assert commit(one.hash) == one


@pytest.mark.usefixtures("history")
def test_each_later_decision_is_a_commit_of_that_date():
    later = decided_since()
    assert later.date.is_monotonic_increasing
    for one in later.itertuples():
        known = commit(one.commit)
        assert known.hash.startswith(one.commit)
        assert known.date == one.date


def test_other_numbers_have_no_commit(monkeypatch):
    about = published.load().about
    assert isinstance(fixed(about), Fixed)
    assert fixed({}) is None
    monkeypatch.setitem(prespecified.NUMBERS, "DIVERGED", 1.4)
    assert fixed(about) is None

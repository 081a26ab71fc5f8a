"""The commits that fixed the thresholds and published the runs, compared with git."""

import ast
import re
from datetime import UTC, datetime

from history import git

from nmpcrl.claims import published
from nmpcrl.claims.thresholds import NUMBERS, decided_since, fixed
from nmpcrl.study import published as store

ASSIGNED = f"^({'|'.join(NUMBERS)}) = "


def date(commit: str) -> str:
    seconds = int(git("show", "-s", "--format=%ct", commit))
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M")


def numbers_in(state: str) -> dict:
    """The numbers assigned at the left margin in a state of the code, investigations excluded."""
    found, rooms = {}, ("nmpcrl", ":!nmpcrl/studies")
    for line in git("grep", "-h", "-E", ASSIGNED, state, "--", *rooms).splitlines():
        name, _, value = line.partition(" = ")
        if re.match(r"[\d(.]", value):  # and not another thing of the same name
            found[name] = ast.literal_eval(value.partition("#")[0].strip())
    return found


def test_the_thresholds_are_those_of_the_named_commit_and_older_than_the_runs():
    thresholds, runs = fixed(published.load().about).values()
    changes = git("log", "--topo-order", "--format=%H", "-E", "-G", ASSIGNED, "--", "*.py").split()
    first = changes.index(thresholds["hash"])
    assert all(numbers_in(state) == NUMBERS for state in changes[: first + 1])
    assert numbers_in(f"{thresholds['hash']}^") != NUMBERS
    added = git("log", "--format=%H", "--diff-filter=A", "--", "book/published/runs.csv").split()
    assert runs["hash"] == added[-1] == store.about("runs")["first"]["all"]
    assert store.about("runs")["registered"] == thresholds["hash"]
    assert thresholds["hash"] in git("rev-list", runs["hash"]).split()
    for one in (thresholds, runs):
        assert date(one["hash"]) == one["date"]


def test_each_later_decision_is_a_commit_of_that_date_and_other_numbers_have_none(monkeypatch):
    later = decided_since()
    assert later.date.is_monotonic_increasing
    assert later.date.tolist() == [*map(date, later.commit)]
    about = published.load().about
    assert fixed({}) == {}
    monkeypatch.setitem(NUMBERS, "DIVERGED", 1.4)
    assert fixed(about) == {}

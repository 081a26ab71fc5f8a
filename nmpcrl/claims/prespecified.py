"""When the thresholds and the rule were fixed, as anybody can check: a commit, and its date.

Where there is a repository, git is asked. The thresholds were fixed in the first commit since which
every committed state of the code has had each of `NUMBERS`, by name and value, as it is today; what
surrounds them may have moved. What was found then is kept with the published data, for copies
without a repository, or with only its last commits.
"""

import ast
import os
import re
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import nmpcrl
from nmpcrl.analysis import metrics
from nmpcrl.claims import rule, thresholds

ROOT = Path(nmpcrl.__file__).parents[1]
HOMES = {  # where the thresholds stand, and the numbers of the rule for shares
    thresholds: (
        "DIVERGED",
        "UNSTABLE",
        "HALF",
        "SAME_TIME",
        "SAME_PATH",
        "SAME_COST",
        "MORE_ACCURATE",
        "BETTER",
        "NEAR_HALF",
        "NEAR_SAME_TIME",
    ),
    rule: ("MAJORITY", "NEARLY_ALL", "NEARLY_NONE"),
    metrics: ("TOUCH",),
}
NUMBERS = {name: getattr(home, name) for home, names in HOMES.items() for name in names}
RUNS = "book/published/runs.csv"


@dataclass(frozen=True)
class Commit:
    """One state of the code, and when it was committed."""

    hash: str
    date: str  # "2026-11-21 13:21", UTC


@dataclass(frozen=True)
class Decision:
    """A definition that came after the thresholds, which stayed as they were."""

    commit: str
    date: str  # as in `Commit`
    when: str  # what had been seen by then
    what: str  # is decided otherwise, in a sentence
    moved: str  # what became otherwise by it, in a sentence


SINCE = (  # in the order in which they were made
    Decision(
        "b82880deae",
        "2026-11-21 13:40",
        "before the runs were published",
        "The final cost of a run that had to be stopped is infinite, in every claim.",
        "C9 holds in 135 of 240 runs and not in 139; no outcome changed.",
    ),
    Decision(
        "9cc97081fa",
        "2026-11-21 21:50",
        "after the verdicts had been seen",
        "The time of a step is the processor's, compared in pairs of steps, with an interval; it"
        " had been a ratio of two medians.",
        "No outcome changed.",
    ),
    Decision(
        "ad7adf081b",
        "2026-11-22 03:59",
        "after the verdicts had been seen",
        "Both halves of C1 and C2 are counted by themselves, in each reading and layout: what"
        " clearly differs there was found by looking.",
        "This is no part of a verdict.",
    ),
    Decision(
        "417746ef7c",
        "2026-11-22 11:48",
        "after the verdicts had been seen",
        "A verdict depends on the decay where its outcome differs between the readings, and where"
        " two learners clearly differ as claimed in one and the other way round in the other.",
        "C1 depends on the decay, and not C6 alone; no outcome changed.",
    ),
    Decision(
        "04d72040bf",
        "2026-11-23 20:25",
        "after the verdicts had been seen, in one commit with those of the new questions",
        "Each claim is judged as the paper makes it: C7 is asked of RDES alone, of which the paper"
        " says it, and C8 of both theorems that are cited; the same of all four learners are W7 and"
        " W9.",
        "C7 is asked of 120 runs and not of 480; no outcome changed.",
    ),
    Decision(
        "04d72040bf",
        "2026-11-23 20:25",
        "after the verdicts had been seen, in one commit with the new times",
        "A ratio of times is that of the sums over the same steps, so that the times of a table"
        " divide to it; it had been a median of ratios.",
        "C3 had been 0.63 and C4 1.00, on another machine as well; no outcome changed.",
    ),
)


@dataclass(frozen=True)
class Fixed:
    """The commit in which the thresholds were fixed, and the one in which runs were published."""

    thresholds: Commit
    published: Commit  # the first runs; the thresholds' commit is an ancestor of it

    @property
    def facts(self) -> dict[str, Any]:
        """As `about.json` keeps it, with the numbers that were fixed."""
        commits = {"thresholds": vars(self.thresholds), "published": vars(self.published)}
        return commits | {"numbers": _plain(NUMBERS)}


def fixed(about: Mapping[str, Any], root: Path = ROOT) -> Fixed | None:
    """When the thresholds were fixed: from git, else from what is published, else unknown.

    Args:
        about: of `published.load()`.
        root: of the project.
    """
    return from_git(root) or from_facts(about.get("fixed"))


def from_facts(facts: Mapping[str, Any] | None) -> Fixed | None:
    """What was published of it; nothing if the numbers were others than today's."""
    if not facts or facts["numbers"] != _plain(NUMBERS):
        return None
    return Fixed(Commit(**facts["thresholds"]), Commit(**facts["published"]))


def from_git(root: Path = ROOT) -> Fixed | None:
    """What the history says; nothing without all of it, or where runs were published before."""
    try:
        if Path(_git(root, "rev-parse", "--show-toplevel").strip()) != root.resolve():
            return None  # somebody else's repository, in which this copy lies
        if _git(root, "rev-parse", "--is-shallow-repository").strip() != "false":
            return None
        thresholds, published = _last_change(root), _first(root, RUNS)
        if not thresholds or not published or not _before(root, thresholds, published):
            return None
        return Fixed(_commit(root, thresholds), _commit(root, published))
    except (OSError, subprocess.CalledProcessError):
        return None


def _last_change(root: Path) -> str:
    """The hash of the first commit since which the numbers are today's; "" if they are not."""
    pattern, found = f"^({'|'.join(NUMBERS)}) = ", ""
    changed = _git(root, "log", "--topo-order", "--format=%H", "-E", "-G", pattern, "--", "*.py")
    for commit in changed.split():
        if dict(_numbers(root, commit, pattern)) != NUMBERS:
            break
        found = commit
    return found


def _numbers(root: Path, commit: str, pattern: str) -> Iterator[tuple[str, Any]]:
    """Those that were assigned at the left margin in this state of the code."""
    for line in _git(root, "grep", "-h", "-E", pattern, commit, "--", "nmpcrl").splitlines():
        name, _, value = line.partition(" = ")
        try:
            yield name, ast.literal_eval(value)
        except (ValueError, SyntaxError):
            continue  # another thing of the same name


def _first(root: Path, file: str) -> str:
    """The hash of the commit that brought a file; "" if none did."""
    added = _git(root, "log", "--format=%H", "--diff-filter=A", "--", file).split()
    return added[-1] if added else ""


def _before(root: Path, first: str, second: str) -> bool:
    """Whether the first commit is an ancestor of the second."""
    return bool(re.search(rf"^{first}$", _git(root, "rev-list", second), flags=re.M))


def _commit(root: Path, commit: str) -> Commit:
    shown = ("--format=%H %cd", "--date=format-local:%Y-%m-%d %H:%M")
    name, _, date = _git(root, "show", "-s", *shown, commit).strip().partition(" ")
    return Commit(name, date)


def _git(root: Path, *arguments: str) -> str:
    command = ["git", "-C", str(root), *arguments]
    environment = {**os.environ, "TZ": "UTC", "LC_ALL": "C"}
    return subprocess.run(
        command, capture_output=True, text=True, check=True, env=environment
    ).stdout


def _plain(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """As JSON has it."""
    return {name: list(one) if isinstance(one, tuple) else one for name, one in numbers.items()}

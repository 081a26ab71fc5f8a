"""What is asked of the population: complete, and not moved since it was fixed."""

import subprocess
from pathlib import Path

import pytest

from nmpcrl.analysis import trap
from nmpcrl.claims import population_questions
from nmpcrl.claims.own_claims import OWN_CLAIMS
from nmpcrl.claims.paper_claims import BY_RUNS
from nmpcrl.claims.population_questions import EXPECTED, QUESTIONS
from nmpcrl.claims.wider_claims import WIDER_CLAIMS
from nmpcrl.study.experiment import MAIN
from nmpcrl.study.provenance import code

FILE = Path(population_questions.__file__)
ROOT = FILE.parents[2]


def git(*arguments: str) -> str:
    asked = ["git", "-C", str(ROOT), *arguments]
    done = subprocess.run(asked, capture_output=True, text=True)
    if done.returncode or git_is_shallow():
        pytest.skip(f"the history is not here: {done.stderr}")
    return done.stdout.strip()


def git_is_shallow() -> bool:
    asked = ["git", "-C", str(ROOT), "rev-parse", "--is-shallow-repository"]
    return subprocess.run(asked, capture_output=True, text=True).stdout.strip() != "false"


def test_the_questions_are_those_of_the_commit_that_added_them():
    path = FILE.relative_to(ROOT).as_posix()
    added = git("log", "--format=%H", "--diff-filter=A", "--", path)
    if not added:
        pytest.skip("it is not committed yet")
    assert code(git("show", f"{added.splitlines()[-1]}:{path}")) == code(FILE.read_text("utf-8"))


def test_the_questions_are_older_than_the_runs_that_are_published():
    runs = git("log", "--format=%H", "--diff-filter=A", "--", "book/published/population.csv")
    if not runs:
        pytest.skip("no run is published yet")
    path = FILE.relative_to(ROOT).as_posix()
    added = git("log", "--format=%H", "--diff-filter=A", "--", path).splitlines()[-1]
    assert added in git("rev-list", f"{runs.splitlines()[-1]}^").split()


def test_every_claim_that_runs_of_the_main_table_decide_has_an_expected_share():
    claims = {**BY_RUNS, **WIDER_CLAIMS, **OWN_CLAIMS}
    decided = {name for name, claim in claims.items() if {*claim.learners} <= {*MAIN}}
    alone = {f"{learner} improves" for learner in MAIN if learner != "frozen"}
    assert {*EXPECTED} == decided | alone


def test_an_expected_share_is_one():
    assert all(0 <= one.low < one.high <= 1 for one in EXPECTED.values())
    assert 0.3 in EXPECTED["C1"]
    assert 0.5 not in EXPECTED["C1"]


def test_a_question_says_how_it_is_decided():
    for one in QUESTIONS.values():
        assert one.question.endswith("?")
        assert all((one.asked_of, one.measured, one.border))
        assert one.pilot == "" or one.pilot.endswith(".")


def test_a_robot_stands_over_as_many_steps_as_were_agreed():
    assert trap.STOOD == population_questions.STOOD

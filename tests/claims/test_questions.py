"""What is asked before runs are made: not moved since, and each question says how it is decided."""

from pathlib import Path

import pytest
from fixed_questions import assert_older, assert_unmoved

from nmpcrl.claims import population_questions

# a file; its questions; how many there are, and how many have a pilot; what is published of them
FIXED = [
    (population_questions, "QUESTIONS", (10, 7), ("population.csv",)),
]
each_file = pytest.mark.parametrize(("file", "name", "counts", "runs"), FIXED)


@each_file
def test_the_questions_are_those_of_the_commit_that_added_them(file, name, counts, runs):
    assert_unmoved(Path(file.__file__))


@each_file
def test_the_questions_are_older_than_the_runs_that_are_published(file, name, counts, runs):
    published, *part = runs
    assert_older(Path(file.__file__), f"book/published/{published}", *part)


@each_file
def test_a_question_says_how_it_is_decided(file, name, counts, runs):
    questions = getattr(file, name).values()
    assert (len(questions), sum(one.pilot != "" for one in questions)) == counts
    for one in questions:
        assert one.question.endswith("?")
        assert all((one.asked_of, one.measured, one.border))
        assert one.pilot == "" or one.pilot.endswith(".")

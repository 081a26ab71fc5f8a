"""The questions: every one is about departures that exist, and says what depends on it."""

import re

import pytest

from nmpcrl.report.open_questions import QUESTIONS, asked, question_list
from nmpcrl.study.departures import DEPARTURES


def item(letter: str, text: str) -> str:
    """The line of the question about a departure."""
    (line,) = [line for line in text.splitlines() if f"#departure-{letter})" in line]
    return line


def test_every_question_is_about_departures_that_exist_and_none_is_asked_twice():
    letters = [letter for question in QUESTIONS for letter in question.departures]
    assert set(letters) <= set(DEPARTURES)
    assert len(letters) == len(set(letters))
    assert all(question.ask.endswith("?") for question in QUESTIONS)


def test_they_are_numbered_and_linked():
    lines = question_list({}, ()).splitlines()
    assert [int(line.split(".")[0]) for line in lines] == list(range(1, len(QUESTIONS) + 1))
    for line, question in zip(lines, QUESTIONS, strict=True):
        assert re.findall(r"#departure-([A-Z])\)", line) == list(question.departures)


@pytest.mark.parametrize(
    ("decides", "varied", "said"),
    [
        ({"H": ("C6", "C1")}, {"H"}, "The answer decides C1 and C6 here."),
        ({"G": ("C1",), "H": ("C1",)}, {"H", "G"}, "The answer decides C1 here."),
        ({}, {"G"}, "No verdict depends on it"),
        ({}, set(), "It was not varied"),
    ],
)
def test_each_says_what_its_departures_decide_together(decides, varied, said):
    assert said in item("H", question_list(decides, varied))


def test_departures_ask_only_what_a_verdict_depends_on_and_says_which():
    lines = asked({"C": ("C2", "C1"), "L": ("C5",)}).splitlines()
    assert lines[0].startswith(f"1. {QUESTIONS[1].ask} (It bears on ")
    assert lines[1].endswith("(It bears on C5.)")
    assert len(lines) == 2

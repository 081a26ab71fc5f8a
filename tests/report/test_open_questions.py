"""The questions: every one is about departures that exist, and says what depends on it."""

from nmpcrl.report.open_questions import QUESTIONS, asked
from nmpcrl.study.departures import DEPARTURES


def test_every_question_is_about_departures_that_exist_and_none_is_asked_twice():
    letters = [letter for question in QUESTIONS for letter in question.departures]
    assert set(letters) <= set(DEPARTURES)
    assert len(letters) == len(set(letters))
    assert all(question.ask.endswith("?") for question in QUESTIONS)


def test_departures_ask_only_what_a_verdict_depends_on_and_says_which():
    lines = asked({"C": ("C2", "C1"), "L": ("C5",)}).splitlines()
    assert lines[0].startswith(f"1. {QUESTIONS[1].ask} (It bears on ")
    assert lines[1].endswith("(It bears on C5.)")
    assert len(lines) == 2

"""Numbers and choices: what is right, and what is said of a wrong answer."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from nmpcrl.course import Unsolved, choice, number
from nmpcrl.course.outcome import MIME

WHY = {"a": "No: a.", "b": "b it is.", "c": "No: c."}


@pytest.mark.parametrize("check", [lambda x: number(x, 1.5), lambda x: choice(x, "b", WHY)])
def test_dots_are_no_answer(check):
    with pytest.raises(Unsolved, match="Not answered yet"):
        check(...)


@given(st.floats(-1e6, 1e6), st.floats(-0.9, 0.9))
def test_a_number_is_right_within_its_tolerance(expected, share):
    assume(abs(expected) > 1e-3)
    assert number(expected * (1 + 0.01 * share), expected, tolerance=0.01).said.startswith("Right")
    with pytest.raises(Unsolved):
        number(expected * (1.02 + abs(share)), expected, tolerance=0.01)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (3.0, "Twice as much."),
        (-1.5, "sign"),
        (1500.0, "too large by a power of ten"),
        (0.15, "too small by a power of ten"),
        (1.9, "too large"),
        (1.2, "too small"),
        (float("nan"), "finite"),
        ("much", "'much' is not a number"),
        ([1, 2], "not a number"),
    ],
)
def test_a_wrong_number_is_met_with_a_sentence_that_helps(answer, said):
    with pytest.raises(Unsolved, match=said):
        number(answer, 1.5, mistakes={3.0: "Twice as much."})


def test_a_right_number_tells_the_page_what_it_needs():
    outcome = number(1.5, 1.5, unit="m", tolerance=0.01, mistakes={3.0: "Twice as much."})
    assert outcome._repr_mimebundle_()[MIME] == {
        "kind": "number",
        "said": "Right: 1.5 m.",
        "mistakes": [[3.0, "Twice as much."]],
        "expected": 1.5,
        "within": 0.015,
        "unit": "m",
    }


@pytest.mark.parametrize(
    ("letter", "said"),
    [("a", "No: a."), ("d", "none of a, b and c"), (None, "none of a, b and c")],
)
def test_a_letter_is_right_or_met_with_why_it_is_wrong(letter, said):
    assert choice(" B ", "b", WHY).said == "Right: b it is."
    with pytest.raises(Unsolved, match=said):
        choice(letter, "b", WHY)

"""Numbers, choices and formulas: what is right, and what is said of what is not."""

from contextlib import suppress

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from nmpcrl.course import Outcome, Unsolved, choice, exercise, formula, number, outcome
from nmpcrl.course.formulas import FormulaError, evaluated
from nmpcrl.course.outcome import MIME, UNANSWERED

WHY = {"a": "No: a.", "b": "b it is.", "c": "No: c."}
UP = "It is the other way round."


def doubled(x: float, y: float) -> float:
    return 2 * x - y


def typed(answer) -> Outcome:
    ranges = {"x": (1, 2), "y": (3, 4)}
    return formula(answer, doubled, ranges, mistakes={UP: lambda x, y: 2 * y - x})


CHECKS = [lambda one: number(one, 1.5), lambda one: choice(one, "b", WHY), typed]


@pytest.mark.parametrize("check", CHECKS)
def test_dots_are_no_answer(check):
    with pytest.raises(Unsolved, match="Not answered yet"):
        check(...)


@pytest.mark.parametrize(("answer", "said"), [(..., UNANSWERED), (2, "2 is not right")])
def test_a_chapter_says_what_is_wrong_and_goes_on_and_a_students_notebook_fails(
    answer, said, monkeypatch
):
    @exercise
    def check(answer) -> Outcome:
        return number(answer, 1.5)

    monkeypatch.setattr(outcome, "STRICT", False)
    assert check(answer).said.startswith(said)
    assert (check(answer).page, check(answer).right) == (None, False)
    monkeypatch.setattr(outcome, "STRICT", True)
    with pytest.raises(Unsolved, match=said):
        check(answer)
    assert (check(1.5).said, check(1.5).right) == ("Right: 1.5.", True)


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
        ("1.5 %", "too small by a power of ten"),
        (1.9, "too large"),
        (1.2, "too small"),
        (float("nan"), "finite"),
        ("much", "'much' is no number"),
        ([1, 2], "no number"),
    ],
)
def test_a_wrong_number_is_met_with_a_sentence_that_helps(answer, said):
    with pytest.raises(Unsolved, match=said):
        number(answer, 1.5, mistakes={3.0: "Twice as much."})


def test_zero_is_expected_within_an_absolute_tolerance():
    assert number(0.001, 0.0).said == "Right: 0."
    with pytest.raises(Unsolved):
        number(0.1, 0.0)


def test_a_right_number_tells_the_page_what_it_needs():
    outcome = number(1.5, 1.5, unit="m", tolerance=0.01, mistakes={3.0: "Twice as much."})
    assert outcome.said == "Right: 1.5 m."
    assert outcome._repr_mimebundle_()[MIME] == {
        "kind": "number",
        "said": "Right: 1.5 m.",
        "mistakes": [[3.0, "Twice as much."]],
        "expected": 1.5,
        "within": 0.015,
        "unit": "m",
    }


@pytest.mark.parametrize("letter", ["b", "B", " b "])
def test_the_right_letter_is_right(letter):
    assert choice(letter, "b", WHY).said == "Right: b it is."


@pytest.mark.parametrize(("letter", "said"), [("a", "No: a."), ("d", "none of a, b and c")])
def test_a_wrong_letter_is_met_with_why_it_is_wrong(letter, said):
    with pytest.raises(Unsolved, match=said):
        choice(letter, "b", WHY)


@pytest.mark.parametrize(
    "text", ["2*x - y", "x + x - y", "-(y - 2 * x)", "(4*x^2 - y^2)/(2*x + y)"]
)
def test_a_formula_is_right_however_it_is_written(text):
    assert typed(text).said == "Right."


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("2*y - x", UP),
        ("x", "for x = .*, y = .* it gives"),
        ("2*z", "z is not among its variables"),
        ("2 *", "cannot be read"),
        ("x / (y - y)", "no value"),
        ("exit()", "numbers, variables"),
        ("x.real", "numbers, variables"),
        ("9" * 300, "more than 200"),
        ("9^9^9^9", "no value"),
        (2.0, "between quotes"),
    ],
)
def test_a_wrong_formula_is_met_with_a_sentence_that_helps(text, said):
    with pytest.raises(Unsolved, match=said):
        typed(text)


@given(st.text(alphabet="xy0123456789.+-*/^(), esqrt_", max_size=30))
def test_whatever_is_typed_has_a_value_or_is_refused(text):
    with suppress(FormulaError):
        assert isinstance(evaluated(text, {"x": 1.0, "y": 2.0}), float)


def test_the_page_is_given_values_of_a_formula_and_not_the_formula():
    page = typed("2*x - y").page
    assert page == typed("2*x - y").page  # the same in every build
    values = [doubled(**case) for case in page["cases"]]
    assert page["values"] == values
    assert page["mistakes"][0][1] == UP


class Everything(str):
    """A text that is equal to all others."""

    __hash__ = str.__hash__

    def __eq__(self, other: object) -> bool:
        return True


@pytest.mark.parametrize("answer", [["c"], {"c": 1}, Everything("c"), None, 3])
def test_a_choice_is_a_text_and_nothing_that_is_equal_to_all(answer):
    with pytest.raises(Unsolved, match="is none of a, b and c"):
        choice(answer, "c", {"a": "no", "b": "no", "c": "yes"})

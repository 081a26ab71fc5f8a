"""What a parameter may be: said in words, checked, and refused in one sentence."""

import re

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from nmpcrl.study.parameters import (
    LONGEST,
    Number,
    Numbers,
    OneOf,
    ParameterError,
    Several,
    Truth,
    Whole,
    shown,
)

KINDS = {
    "word": OneOf(("A", "B")),
    "whole": Whole(1, 300),
    "number": Number.above_zero(1e6),
    "range": Number.within(-1, 1),
    "truth": Truth(),
    "numbers": Numbers(2),
    "list": Several(Whole(0, 9), "it"),
}
ANYTHING = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.sampled_from([10**400, -(10**4000), 2**63, 1e308, 5e-324]),
        st.floats(),
        st.complex_numbers(),
        st.text(max_size=5),
        st.binary(max_size=5),
        st.dates(),
        st.decimals(),
        st.sampled_from([np.int8(3), np.uint64(2**63), np.float32(0.5), np.nan, np.True_]),
        st.sampled_from([np.array(3), np.ones((3, 3)), np.array(["a"]), np.array([None, 1])]),
        st.sampled_from([object(), int, iter(()), len]),
    ),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=2), inner),
    max_leaves=6,
)


@pytest.mark.parametrize("kind", KINDS)
@settings(derandomize=True, deadline=None, max_examples=200)
@given(value=ANYTHING)
def test_whatever_is_given_is_taken_or_refused_in_one_short_sentence(kind, value):
    allowed = KINDS[kind]
    try:
        taken = allowed.check("it", value)
    except ParameterError as error:
        said = str(error)
        if kind != "list":
            assert said == f"it = {shown(value)} must be {allowed.text}"
        assert said.startswith("it = ")
        assert "\n" not in said
        assert len(said) < 2 * LONGEST + 100
    else:
        assert type(taken) in (str, int, float, bool, tuple)
        assert allowed.check("it", taken) == taken


@pytest.mark.parametrize(
    ("kind", "given", "taken"),
    [
        ("word", np.str_("A"), "A"),
        ("whole", np.int64(3), 3),
        ("whole", np.uint8(3), 3),
        ("number", np.float32(0.5), 0.5),
        ("number", np.int16(2), 2.0),
        ("number", 3, 3.0),
        ("truth", np.False_, False),
        ("numbers", np.ones(2), (1.0, 1.0)),
        ("numbers", [1, np.float64(2)], (1.0, 2.0)),
        ("numbers", range(2), (0.0, 1.0)),
        ("list", np.arange(3), (0, 1, 2)),
        ("list", range(3), (0, 1, 2)),
    ],
)
def test_numbers_of_numpy_become_pythons_own(kind, given, taken):
    found = KINDS[kind].check("it", given)
    assert found == taken
    assert type(found) is type(taken)


@pytest.mark.parametrize(
    ("kind", "text", "choices"),
    [
        ("word", "one of A, B", ("A", "B")),
        ("whole", "a whole number from 1 to 300", None),
        ("number", "a number in (0, 1e+06]", None),
        ("range", "a number in [-1, 1]", None),
        ("truth", "true or false", None),
        ("numbers", "2 numbers of size at most 1e+06", None),
        ("list", "a list in which each it is a whole number from 0 to 9", None),
    ],
)
def test_what_is_allowed_is_said_in_words(kind, text, choices):
    assert KINDS[kind].text == text
    assert KINDS[kind].choices == choices


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        ("numbers", ["1", "2"]),
        ("numbers", "12"),
        ("numbers", {1: 2, 3: 4}),
        ("numbers", [True, False]),
        ("numbers", [[1], [2]]),
        ("numbers", [10**400, 0]),
        ("number", "0.5"),
        ("number", 10**400),
        ("number", np.nan),
        ("number", np.True_),
        ("whole", "3"),
        ("whole", 3.0),
        ("whole", np.float64(3)),
        ("whole", np.True_),
        ("whole", 2**20000),
        ("truth", 1),
        ("truth", "true"),
        ("word", ["A"]),
        ("word", None),
    ],
    ids=shown,
)
def test_texts_truths_and_lists_are_no_numbers(kind, given):
    with pytest.raises(ParameterError, match=r"^it = .* must be "):
        KINDS[kind].check("it", given)


@pytest.mark.parametrize(
    ("given", "write"),
    [("1e-7", "1.0e-7"), ("-2E5", "-2.0e+5"), (".5e3", "0.5e+3"), ("1.5e5", "1.5e+5")],
)
def test_a_number_that_yaml_takes_for_text_is_written_as_one(given, write):
    assert isinstance(yaml.safe_load(given), str)
    assert yaml.safe_load(write) == float(given)
    for kind, value in (
        (Number.within(-1e6, 1e6), given), (Numbers(1), [given]),
        (Several(Number.within(-1e6, 1e6), "it"), [given]),
    ):  # fmt: skip
        with pytest.raises(ParameterError, match=re.escape(f"'{given}' arrived as text; ")) as at:
            kind.check("it", value)
        assert str(at.value).endswith(f"write {write}")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (3, "seeds = 3 must be a list, such as [3]"),
        ("A", "seeds = 'A' must be a list, such as ['A']"),
        ("[3]", "seeds = '[3]' arrived as text, not as a list; write -y '{seeds: [3]}'"),
        ([], "seeds = [] must name at least one seed"),
        ([3, 4, 3], "seeds = [3, 4, 3] must be a list that names 3 once"),
        ([3, "4"], "seed = '4' must be a whole number from 0 to 100"),
        ([[3]], "seed = [3] must be a whole number from 0 to 100"),
        ([1, True], "seed = True must be a whole number from 0 to 100"),
        ({3: 4}, "seeds = {3: 4} must be a list"),
        (range(10**5), "seeds = range(0, 100000) must name 10000 seeds at most, not 100000"),
    ],
    ids=shown,
)
def test_a_list_that_is_none_is_refused_in_one_sentence(given, said):
    with pytest.raises(ParameterError) as caught:
        Several(Whole(0, 100), "seed").check("seeds", given)
    assert str(caught.value) == said


@pytest.mark.parametrize(
    "value",
    [list(range(10**6)), "x" * 10**6, 2**20000, np.ones((50, 50)), {i: i for i in range(1000)}],
    ids=lambda value: type(value).__name__,
)
def test_a_value_is_shown_on_one_short_line(value):
    assert len(shown(value)) <= LONGEST
    assert "\n" not in shown(value)


def test_a_notebook_shows_the_sentence_and_no_traceback():
    assert ParameterError("it = 3 must be 4")._render_traceback_() == [
        "ParameterError: it = 3 must be 4"
    ]

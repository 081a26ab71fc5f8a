"""Values of parameters: converted to Python's own types, or refused in one short sentence."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nmpcrl.study import ParameterError, geometry, paper, parameters
from nmpcrl.study.geometry import MOST_OBSTACLES, centres_of, short_name

ALLOWED = {
    "word": parameters.one_of(("A", "B")),
    "whole": parameters.whole(1, 300),
    "positive": parameters.positive(1e6),
    "range": parameters.number(-1e6, 1e6),
    "truth": parameters.TRUTH,
    "numbers": parameters.numbers([parameters.number(-1e6, 1e6)] * 2, "2 numbers"),
    "seeds": parameters.several(parameters.whole(0, 100), "seed"),
    "layout": geometry.layout(paper.LAYOUTS),
    "pose": geometry.pose(paper.LOWER, paper.UPPER),
}
ANYTHING = st.recursive(
    st.one_of(
        st.none() | st.booleans() | st.integers() | st.floats() | st.complex_numbers(),
        st.text(max_size=5) | st.binary(max_size=5) | st.decimals(),
        st.sampled_from([10**400, -(10**4000), 2**63, 1e308, 5e-324]),
        st.sampled_from([np.int8(3), np.uint64(2**63), np.float32(0.5), np.nan, np.True_]),
        st.sampled_from([np.array(3), np.ones((3, 3)), np.array(["a"]), np.array([None, 1])]),
        st.sampled_from([object(), int, iter(()), len]),
    ),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=2), inner),
    max_leaves=6,
)


def refusal(kind, value) -> str:
    with pytest.raises(ParameterError) as caught:
        ALLOWED[kind].check("it", value)
    return str(caught.value)


@pytest.mark.parametrize("kind", ALLOWED)
@settings(derandomize=True, deadline=None, max_examples=200)
@given(value=ANYTHING)
def test_any_value_is_converted_or_refused_in_one_short_sentence(kind, value):
    allowed = ALLOWED[kind]
    try:
        taken = allowed.check("it", value)
    except ParameterError:
        said = refusal(kind, value)
        assert said.startswith("it = " if kind != "seeds" else ("it = ", "seed = "))
        assert allowed.text in said or kind == "seeds"
        assert "\n" not in said
        assert len(said) < 2 * parameters.LONGEST + 100
    else:
        assert type(taken) in (str, int, float, bool, tuple)
        assert allowed.check("it", taken) == taken


@pytest.mark.parametrize(
    ("kind", "given", "taken"),
    [
        ("word", np.str_("A"), "A"),
        ("whole", np.uint8(3), 3),
        ("positive", np.float32(0.5), 0.5),
        ("positive", 3, 3.0),
        ("truth", np.False_, False),
        ("numbers", np.ones(2), (1.0, 1.0)),
        ("numbers", range(2), (0.0, 1.0)),
        ("seeds", np.arange(3), (0, 1, 2)),
        ("layout", "0.5 2.2,3.0 0.5", "0.5,2.2 3,0.5"),
        ("layout", [[-0.0, 1]], "0,1"),
        ("layout", paper.LAYOUTS["C"], "C"),
        ("pose", [-3, 9, -math.tau], (-3.0, 9.0, -math.tau)),
        ("pose", [-0.0, 0, 0], (0.0, 0.0, 0.0)),  # -0.0 would be another key
    ],
)
def test_a_value_becomes_one_of_pythons_own_types(kind, given, taken):
    assert repr(ALLOWED[kind].check("it", given)) == repr(taken)


NUMBERS = {"1e-7": "1.0e-7", "-2E5": "-2.0e+5", ".5e3": "5.0e+2", "1.25e5": "1.25e+5"}


@pytest.mark.parametrize(
    ("kind", "given", "said"),
    [
        *(("range", n, f"it = '{n}' arrived as text; write {w}") for n, w in NUMBERS.items()),
        ("numbers", ["1e3", 1], "it = ['1e3', 1] arrived as text; write 1.0e+3"),
        ("seeds", 3, "it = 3 must be a list, such as [3]"),
        ("seeds", "[3]", "it = '[3]' arrived as text; write -y '{seeds: [3]}'"),
        ("seeds", [3, "4"], "seed = '4' must be a whole number from 0 to 100"),
        ("seeds", [1, True], "seed = True must be a whole number from 0 to 100"),
    ],
)
def test_a_refusal_of_a_text_or_a_list_says_what_to_write(kind, given, said):
    assert refusal(kind, given) == said


def test_a_value_is_shown_on_one_short_line_and_a_notebook_shows_no_traceback():
    for value in (range(10**9), [3] * 10**6, "x" * 10**6, np.ones((50, 50))):
        assert "\n" not in parameters.shown(value)
        assert len(parameters.shown(value)) <= parameters.LONGEST
    assert ParameterError("it = 3")._render_traceback_() == ["ParameterError: it = 3"]


COORDINATES = st.floats(-100, 100)
CENTRES = st.lists(st.tuples(COORDINATES, COORDINATES), min_size=1, max_size=MOST_OBSTACLES)


@given(CENTRES, st.sampled_from([",", " ", "  ", ", "]))
def test_a_layout_is_one_word_that_gives_its_centres_back_to_the_last_bit(centres, between):
    word = ALLOWED["layout"].check("layout", centres)
    assert list(centres_of(word, paper.LAYOUTS)) == centres
    for same in (word, np.array(centres), word.replace(" ", between)):
        assert ALLOWED["layout"].check("layout", same) == word
    assert short_name(word) != short_name(word + " 1,1")
    assert (len(short_name(word)), short_name("A")) == (len("drawn-123456"), "A")

"""Values as data: what passes between a notebook and the grader, and what does not."""

import json
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.course.plain import NotPlain, decoded, encoded

ONES = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
VALUES = st.recursive(
    ONES,
    lambda inner: st.lists(inner) | st.lists(inner).map(tuple) | st.dictionaries(ONES, inner),
    max_leaves=20,
)


def passed(value):
    return decoded(json.loads(json.dumps(encoded(value))))


@given(VALUES)
def test_plain_values_arrive_as_they_were(value):
    arrived = passed(value)
    assert type(arrived) is type(value)
    assert arrived == value


@pytest.mark.parametrize("dtype", ["bool", "int8", ">i4", "uint64", "float32", "float64"])
@pytest.mark.parametrize("shape", [(), (3,), (2, 0), (2, 3)])
def test_arrays_arrive_bit_by_bit(dtype, shape):
    array = np.random.default_rng(0).integers(0, 2, shape).astype(dtype)
    arrived = passed(array)
    assert isinstance(arrived, np.ndarray) == bool(shape)
    assert arrived.dtype == array.dtype.newbyteorder("=")
    assert np.array_equal(arrived, array)


def test_tables_and_numbers_of_other_libraries_arrive_as_such():
    table = pd.DataFrame({"layout": ["A", "B"], "cost": [1.5, 2.5]})
    assert passed(table).equals(table)
    assert np.array_equal(passed(table.cost), [1.5, 2.5])
    assert passed(Fraction(1, 4)) == 0.25
    assert passed(np.array(["a", "b"])) == ["a", "b"]
    assert passed(...) is ...


class Lies(np.ndarray):
    """An array that says of itself what it likes."""

    def __array_ufunc__(self, *args, **names):
        return True


def test_what_arrives_has_the_exact_type():
    assert type(passed(np.ones(3).view(Lies))) is np.ndarray
    assert type(passed(np.ma.masked_array([1.0]))) is np.ndarray


@pytest.mark.parametrize("value", [object(), (1 for _ in [1]), {1}, b"1", 1j, len, [print]])
def test_whatever_is_not_plain_is_refused(value):
    with pytest.raises(TypeError, match="an answer cannot hold"):
        encoded(value)


def test_a_function_is_a_number_with_which_it_is_called():
    functions = []
    data = encoded([len, max], functions)
    assert functions == [len, max]
    assert decoded(data, functions.__getitem__) == [len, max]
    with pytest.raises(NotPlain):
        decoded(data)


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        ["one"],
        ["one", [1]],
        ["list", 3],
        ["dict", [[["list", []], ["one", 1]]]],
        ["dict", [1]],
        ["array", "<f8", [10**9], ""],
        ["array", "|O", [1], "AAAAAAAAAAA="],
        ["array", "<f8", ["x"], "AAAAAAAAAAA="],
        ["array", ["<f8"], [1], "AAAAAAAAAAA="],
        ["table", ["one", 1]],
        ["function", "0"],
        ["function", -1],
        ["pickle", "cos\nsystem\n(S'true'\ntR."],
    ],
)
def test_data_that_hold_no_value_are_refused(data):
    with pytest.raises(NotPlain):
        decoded(data, [len].__getitem__)

"""A ratio of times decides only where its interval lies on one side of every border."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nmpcrl.bench.paired import Ratio
from nmpcrl.claims.timing import IDLE, WAITED, decide
from nmpcrl.claims.verdict import NOT, PARTLY, REPRODUCED, UNDECIDABLE

CLAIMED, NEAR = (0.9, 1.1), (0.8, 1.25)


def outcome(low: float, high: float, waited: float = 0.0) -> str:
    return decide(Ratio((low + high) / 2, low, high, waited), CLAIMED, NEAR)[0]


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.9, 1.1, REPRODUCED),
        (0.89, 1.0, UNDECIDABLE),
        (1.0, 1.11, UNDECIDABLE),
        (0.8, 0.89, PARTLY),
        (1.11, 1.249, PARTLY),
        (0.79, 0.85, UNDECIDABLE),
        (1.2, 1.25, UNDECIDABLE),
        (0.85, 1.2, UNDECIDABLE),  # near on both sides, and as claimed between them
        (0.5, 0.79, NOT),
        (1.25, 2.0, NOT),
        (0.5, 2.0, UNDECIDABLE),
    ],
)
def test_an_interval_on_one_side_of_every_border_decides(low, high, expected):
    assert outcome(low, high) == expected


@given(
    ends=st.tuples(st.floats(0.5, 1.6), st.floats(0.5, 1.6)).map(sorted),
    at=st.floats(0, 1),
)
def test_what_an_interval_decides_every_number_in_it_says(ends, at):
    low, high = ends
    value = min(max(low + at * (high - low), low), high)
    decided = outcome(low, high)
    assert decided == UNDECIDABLE or decided == outcome(value, value)


def test_a_busy_machine_decides_nothing_and_says_so():
    for ratio in (Ratio(1, 0.99, 1.01, WAITED + 0.01), Ratio(1, 0.7, 1.4, IDLE + 0.01)):
        decided, why = decide(ratio, CLAIMED, NEAR)
        assert decided == UNDECIDABLE
        assert "the machine was too busy" in why
    assert decide(Ratio(1, 0.99, 1.01, WAITED), CLAIMED, NEAR) == (REPRODUCED, "")


def test_a_quiet_machine_is_not_blamed_for_a_ratio_at_a_border():
    decided, why = decide(Ratio(1.1, 1.08, 1.12, 0.0), CLAIMED, NEAR)
    assert decided == UNDECIDABLE
    assert "reaches across a border" in why


def test_without_an_interval_nothing_is_decided():
    decided, why = decide(Ratio(1, np.nan, np.nan, 0.0), CLAIMED, NEAR)
    assert decided == UNDECIDABLE
    assert "too few steps" in why

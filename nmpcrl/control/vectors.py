"""Checks and copies of the numbers of a description."""

from typing import Any

import numpy as np

from nmpcrl import Vector


def read_only(numbers: Any) -> Vector:
    """A read-only copy, independent of the array that it was made of."""
    copy = np.array(numbers, float)
    copy.setflags(write=False)
    return copy


def positive_integer(name: str, number: Any) -> int:
    """A whole number, 1 or more; ValueError for any other."""
    if isinstance(number, bool) or not isinstance(number, int | np.integer) or number < 1:
        raise ValueError(f"{name} = {number!r} must be a whole number, 1 or more")
    return int(number)

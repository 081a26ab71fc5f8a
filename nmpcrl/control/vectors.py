"""Numbers that a description keeps for itself."""

from typing import Any

import numpy as np

from nmpcrl import Vector


def kept(numbers: Any) -> Vector:
    """A copy that nobody can change, whatever becomes of the array that it was made of."""
    copy = np.array(numbers, float)
    copy.setflags(write=False)
    return copy


def whole(name: str, number: Any) -> int:
    """A whole number, 1 or more.

    Raises:
        ValueError: it is none.
    """
    if isinstance(number, bool) or not isinstance(number, int | np.integer) or number < 1:
        raise ValueError(f"{name} = {number!r} must be a whole number, 1 or more")
    return int(number)

"""Checked, read-only copies of a user's numbers."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nmpcrl import Vector


def read_only(numbers: Any) -> Vector:
    """A read-only copy."""
    copy = np.array(numbers, float)
    copy.setflags(write=False)
    return copy


def step_size(name: str, number: Any) -> None:
    """Refuse what is no finite number, 0 or more, such as the text that YAML makes of 1e-7."""
    if isinstance(number, str) or not 0 <= number < np.inf:
        raise ValueError(f"{name} = {number!r} must be a finite number, 0 or more")


def integer(name: str, number: Any, least: int = 1) -> int:
    """A whole number, `least` or more; ValueError for any other."""
    if isinstance(number, bool) or not isinstance(number, int | np.integer) or number < least:
        raise ValueError(f"{name} = {number!r} must be a whole number, {least} or more")
    return int(number)


def floats(name: str, value: Any) -> NDArray[np.float64]:
    """A copy of numbers as an array; ValueError where there are none."""
    try:
        return np.array(value, float)
    except (TypeError, ValueError):
        advice = ": write problem.vector(...)" if isinstance(value, Mapping) else ""
        raise ValueError(
            f"{name} = {value!r} must be a number or an array of numbers{advice}"
        ) from None


def spread(
    name: str, value: Any, shape: tuple[int, ...], each: str, *, positive: bool = False
) -> Vector:
    """A read-only array of a shape, of a number or one for `each` of something.

    ValueError for another shape, for nan, and for numbers that are not `positive` and finite.
    """
    array = floats(name, value)
    kind = "positive numbers" if positive else "numbers"
    allowed = (array > 0) & (array < np.inf) if positive else ~np.isnan(array)
    if array.shape not in ((), (1,), shape) or not allowed.all():
        count = int(np.prod(shape))
        raise ValueError(f"{name} = {array} must hold {count} {kind}, one {each}")
    return read_only(np.broadcast_to(array, shape))


def box(of: str, lower: Any, upper: Any, count: int, each: str) -> tuple[Vector, Vector]:
    """Both sides of a box, `spread`; ValueError unless `lower` lies below `upper`."""
    low, high = (
        spread(f"{of}{side}", value, (count,), each)
        for side, value in (("lower", lower), ("upper", upper))
    )
    if not (low < high).all():
        raise ValueError(f"{of}lower = {low} must lie below {of}upper = {high}")
    return low, high

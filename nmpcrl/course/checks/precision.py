"""The tolerance of a number that a question asks for to some digits: half a unit of the last."""

from math import floor, log10

CLOSE = 1 + 1e-9  # the half itself is right, whichever way it is rounded


def to_digits(value: float, digits: int, least: float = 0.005) -> float:
    """Of `value` to so many digits, relative to it, and at least `least`."""
    return to_places(value, digits - 1 - floor(log10(abs(value))), least)


def to_places(value: float, places: int, least: float = 0.005) -> float:
    """Of `value` to so many digits after the point, relative to it, and at least `least`."""
    return max(least, 0.5 * 10.0**-places / abs(value) * CLOSE)

"""Checks of parameters, with the allowed values in words."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from math import inf, nextafter
from numbers import Integral, Real
from typing import Any

import numpy as np

from nmpcrl.study.refusal import ParameterError as ParameterError

LARGEST_SEED = 2**31 - 1  # that the generators of all libraries take
MOST_VALUES = 10_000  # of a list
LONGEST = 100  # characters of a value in a message


class Unfit(ValueError):
    """An unfit value; the message ends the sentence "NAME = VALUE ..."."""


@dataclass(frozen=True)
class Allowed:
    """The values that a parameter may have."""

    text: str  #: the values in words, as they follow "must be"
    read: Callable[[Any], Any]  #: converts a value; ValueError and the like refuse it
    choices: tuple[str, ...] = ()  #: all values, if they are words
    ends: tuple[float, float] | None = None  #: the least and the largest, if they are numbers

    def check(self, name: str, value: Any) -> Any:
        """Convert the value of a parameter to a type of Python's own, or raise ParameterError."""
        try:
            return self.read(value)
        except ParameterError:  # about one value of a list
            raise
        except Unfit as error:
            raise ParameterError(f"{name} = {shown(value)} {error}") from None
        except (TypeError, ValueError, OverflowError):
            raise refused(name, value, self.text) from None


def one_of(words: Collection[str]) -> Allowed:
    """One of some words."""

    def read(value: Any) -> str:
        need(isinstance(value, str) and value in words)
        return str(value)

    return Allowed(f"one of {', '.join(words)}", read, tuple(words))


def whole(least: int, most: int) -> Allowed:
    """A whole number from `least` to `most`."""

    def read(value: Any) -> int:
        need(isinstance(value, Integral) and not isinstance(value, bool))
        need(least <= value <= most)
        return int(value)

    return Allowed(f"a whole number from {least} to {most}", read, ends=(least, most))


def number(least: float, most: float, text: str = "") -> Allowed:
    """A number in [least, most]."""

    def read(value: Any) -> float:
        if isinstance(value, str) and "e" in value.lower():  # YAML 1.1 reads 1e-7 as text
            written = np.format_float_scientific(float(value), trim="0", exp_digits=1)
            raise Unfit(f"arrived as text; write {written}")
        need(isinstance(value, Real) and not isinstance(value, bool))
        need(least <= value <= most)  # which nan is not
        return float(value) + 0.0  # -0.0 would be another key

    return Allowed(text or f"a number in [{least:g}, {most:g}]", read, ends=(least, most))


def positive(most: float) -> Allowed:
    """A number in (0, most]."""
    return number(nextafter(0, inf), most, f"a number in (0, {most:g}]")


def numbers(each: Sequence[Allowed], text: str) -> Allowed:
    """A list of numbers, one for each of `each`."""

    def read(value: Any) -> tuple[float, ...]:
        need(is_list(value) and len(value) == len(each))
        return tuple(allowed.read(one) for allowed, one in zip(each, value, strict=True))

    return Allowed(text, read)


def several(each: Allowed, name: str) -> Allowed:
    """A list of different values of the parameter `name`; the list is called by its plural."""

    def read(value: Any) -> tuple[Any, ...]:
        if isinstance(value, str) and value.strip().startswith("["):
            raise Unfit(f"arrived as text; write -y '{{{name}s: {shortened(value)}}}'")
        if not is_list(value):
            raise Unfit(f"must be a list, such as [{shown(value)}]")
        need(1 <= len(value) <= MOST_VALUES)
        values = tuple(each.check(name, one) for one in value)
        need(len(set(values)) == len(values))
        return values

    return Allowed(f"a list of 1 to {MOST_VALUES} different {name}s", read)


def _truth(value: Any) -> bool:
    need(isinstance(value, bool | np.bool_))
    return bool(value)


TRUTH = Allowed("true or false", _truth)


def need(holds: bool) -> None:
    """Raise a ValueError if a condition does not hold."""
    if not holds:
        raise ValueError


def is_list(value: Any) -> bool:
    """Whether a value is a list, a tuple, a range or a vector."""
    vector = isinstance(value, np.ndarray) and value.ndim == 1
    return vector or isinstance(value, list | tuple | range)


def refused(name: str, value: Any, text: str) -> ParameterError:
    """The error for a value that must be as `text` says."""
    return ParameterError(f"{name} = {shown(value)} must be {text}")


def shown(value: Any) -> str:
    """A value as one short line of a message."""
    return shortened(repr(value))


def shortened(text: str) -> str:
    """A text on one line, cut where it is long."""
    text = " ".join(text.split())
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]} ..."

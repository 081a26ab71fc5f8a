"""Checks of parameters, with the allowed values in words."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from math import inf, nextafter
from numbers import Integral, Real
from reprlib import Repr
from typing import Any

import numpy as np

from nmpcrl.study.refusal import ParameterError as ParameterError
from nmpcrl.study.refusal import Refusal as Refusal

LARGEST_SEED = 2**31 - 1  # that the generators of all libraries take
MOST_VALUES = 10_000  # of a list
POWER = re.compile(r"([+-]?\d*)(\.\d*)?[eE]([+-]?)(\d+)", re.ASCII)
LONGEST = 100  # characters of a value in a message


class Unfit(ValueError):
    """An unfit value; the message ends the sentence "NAME = VALUE ..."."""


@dataclass(frozen=True)
class Allowed:
    """The values that a parameter may have."""

    text: str  # the values in words, as they follow "must be"
    read: Callable[[Any], Any]  # converts a value; a ValueError or TypeError refuses it
    choices: tuple[str, ...] | None = None  # all values, if they are words
    ends: tuple[float, float] | None = None  # the least and the largest, if they are numbers

    def check(self, name: str, value: Any) -> Any:
        """Convert a value to a type of Python's own, such as an int for NumPy's.

        Raises:
            ParameterError: the parameter `name` may not have this value.
        """
        try:
            return self.read(value)
        except ParameterError:  # about one value of a list
            raise
        except Unfit as error:
            raise ParameterError(f"{name} = {shown(value)} {error}") from None
        except (TypeError, ValueError):
            raise refused(name, value, self.text) from None


def one_of(words: Collection[str]) -> Allowed:
    """One of some words."""

    def read(value: Any) -> str:
        _need(isinstance(value, str) and value in words)
        return str(value)

    return Allowed(f"one of {', '.join(words)}", read, tuple(words))


def whole(least: int, most: int) -> Allowed:
    """A whole number from `least` to `most`."""

    def read(value: Any) -> int:
        _need(isinstance(value, Integral) and not isinstance(value, bool))
        _need(least <= value <= most)
        return int(value)

    return Allowed(f"a whole number from {least} to {most}", read, ends=(least, most))


def number(least: float, most: float, text: str = "") -> Allowed:
    """A number in [least, most]."""

    def read(value: Any) -> float:
        found = POWER.fullmatch(value.strip()) if isinstance(value, str) else None
        if found:  # YAML 1.1 wants a point, and a sign of the power
            digits, part, sign, power = found.groups(default="")
            written = f"{digits or 0}.{part.strip('.') or 0}e{sign or '+'}{power}"
            raise Unfit(f"arrived as text; write {written}")
        _need(isinstance(value, Real) and not isinstance(value, bool))
        _need(least <= value <= most)  # which nan is not
        return float(value)

    return Allowed(text or f"a number in [{least:g}, {most:g}]", read, ends=(least, most))


def positive(most: float) -> Allowed:
    """A number in (0, most]."""
    return number(nextafter(0, inf), most, f"a number in (0, {most:g}]")


def numbers(each: Sequence[Allowed], text: str) -> Allowed:
    """A list of numbers, one for each of `each`."""

    def read(value: Any) -> tuple[float, ...]:
        _need(is_list(value) and len(value) == len(each))
        return tuple(allowed.read(one) for allowed, one in zip(each, value, strict=True))

    return Allowed(text, read)


def several(each: Allowed, name: str) -> Allowed:
    """A list of different values of the parameter `name`; the list is called by its plural."""

    def read(value: Any) -> tuple[Any, ...]:
        if isinstance(value, str) and value.strip().startswith("["):
            line = shortened(value.strip())
            raise Unfit(f"arrived as text, not as a list; write -y '{{{name}s: {line}}}'")
        if not is_list(value):
            single = isinstance(value, str | int | float)
            raise Unfit(f"must be a list{f', such as [{shown(value)}]' if single else ''}")
        if not len(value):
            raise Unfit(f"must name at least one {name}")
        if len(value) > MOST_VALUES:
            raise Unfit(f"must name {MOST_VALUES} {name}s at most, not {len(value)}")
        values = tuple(each.check(name, one) for one in value)
        twice = {one for one, count in Counter(values).items() if count > 1}
        if twice:
            raise Unfit(f"must be a list that names {shown(min(twice))} once")
        return values

    return Allowed(f"a list in which each {name} is {each.text}", read)


def _truth(value: Any) -> bool:
    _need(isinstance(value, bool | np.bool_))
    return bool(value)


TRUTH = Allowed("true or false", _truth)


def _need(holds: bool) -> None:
    """Raise a ValueError if a condition does not hold."""
    if not holds:
        raise ValueError


def is_list(value: Any) -> bool:
    """Whether a value is a list, a tuple, a range or a vector."""
    rows = isinstance(value, np.ndarray) and value.ndim == 1
    return rows or isinstance(value, list | tuple | range)


def refused(name: str, value: Any, text: str) -> ParameterError:
    """The error for a value that must be as `text` says."""
    return ParameterError(f"{name} = {shown(value)} must be {text}")


class _Short(Repr):
    """`repr` on one line, however large the value is."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlist = self.maxtuple = self.maxarray = self.maxdict = self.maxset = 10
        self.maxstring = self.maxother = LONGEST

    def repr_int(self, x: int, level: int) -> str:
        """An integer; Python refuses to print the largest."""
        return repr(x) if abs(x) < 10**40 else f"an integer of {x.bit_length()} bits"


def shown(value: Any) -> str:
    """A value as one line of a message."""
    return shortened(_Short().repr(value))


def shortened(text: str) -> str:
    """A text on one line, cut where it is long."""
    text = " ".join(text.split())
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]} ..."

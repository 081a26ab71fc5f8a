"""What a parameter may be: each kind says so in words, and refuses all else in one sentence."""

import re
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from math import inf, nextafter
from numbers import Integral, Real
from reprlib import Repr
from typing import Any, Protocol

import numpy as np

from nmpcrl.control.nmpc import ABSURD
from nmpcrl.study.storage.refusal import ParameterError as ParameterError
from nmpcrl.study.storage.refusal import Refusal as Refusal

LARGEST_SEED = 2**31 - 1  # what every generator takes, whichever library's
MOST_VALUES = 10_000  # of an axis
POWER = re.compile(r"([+-]?\d*)(\.\d*)?[eE]([+-]?)(\d+)", re.ASCII)
LONGEST = 100  # characters of a value in a message


class Allowed(Protocol):
    """What a parameter may be."""

    @property
    def text(self) -> str:
        """In words, as they stand after "must be"."""

    @property
    def choices(self) -> tuple[str, ...] | None:
        """All that it may be, if these are words."""

    def check(self, name: str, value: Any) -> Any:
        """The value in its own type: an int for NumPy's, a tuple for a list.

        Raises:
            ParameterError: the parameter `name` may not be this.
        """


@dataclass(frozen=True)
class OneOf:
    """One of some words."""

    words: Collection[str]

    @property
    def choices(self) -> tuple[str, ...]:
        """See `Allowed`."""
        return tuple(self.words)

    @property
    def text(self) -> str:
        """See `Allowed`."""
        return f"one of {', '.join(self.words)}"

    def check(self, name: str, value: Any) -> str:
        """See `Allowed`."""
        if not isinstance(value, str) or value not in self.words:
            raise refused(name, value, self.text)
        return str(value)


@dataclass(frozen=True)
class Whole:
    """A whole number from `least` to `most`."""

    least: int
    most: int
    choices: None = None

    @property
    def text(self) -> str:
        """See `Allowed`."""
        return f"a whole number from {self.least} to {self.most}"

    def check(self, name: str, value: Any) -> int:
        """See `Allowed`."""
        whole = isinstance(value, Integral) and not isinstance(value, bool)
        if not whole or not self.least <= value <= self.most:
            raise refused(name, value, self.text)
        return int(value)


@dataclass(frozen=True)
class Number:
    """A number from `least` to `most`."""

    least: float
    most: float
    text: str
    choices: None = None

    @classmethod
    def within(cls, least: float, most: float) -> "Number":
        """A number in [least, most]."""
        return cls(least, most, f"a number in [{least:g}, {most:g}]")

    @classmethod
    def above_zero(cls, most: float) -> "Number":
        """A number in (0, most]."""
        return cls(nextafter(0, inf), most, f"a number in (0, {most:g}]")

    def check(self, name: str, value: Any) -> float:
        """See `Allowed`."""
        refuse_text(name, value)
        real = isinstance(value, Real) and not isinstance(value, bool)
        if not real or not self.least <= value <= self.most:  # which nan is not
            raise refused(name, value, self.text)
        return float(value)


SENSIBLE = Number.within(-ABSURD, ABSURD)


@dataclass(frozen=True)
class Truth:
    """True or false."""

    text: str = "true or false"
    choices: None = None

    def check(self, name: str, value: Any) -> bool:
        """See `Allowed`."""
        if not isinstance(value, bool | np.bool_):
            raise refused(name, value, self.text)
        return bool(value)


@dataclass(frozen=True)
class Numbers:
    """So many numbers that a solver can be given."""

    size: int
    choices: None = None

    @property
    def text(self) -> str:
        """See `Allowed`."""
        return f"{self.size} numbers of size at most {ABSURD:g}"

    def check(self, name: str, value: Any) -> tuple[float, ...]:
        """See `Allowed`."""
        if not is_list(value) or len(value) != self.size:
            raise refused(name, value, self.text)
        for one in value:
            refuse_text(name, one)
        try:
            return tuple(SENSIBLE.check(name, one) for one in value)
        except ParameterError:
            raise refused(name, value, self.text) from None


@dataclass(frozen=True)
class Several:
    """A list of what `each` may be, without repetition: the values of an axis."""

    each: Allowed
    name: str  # of one value; the parameter's is its plural
    choices: None = None

    @property
    def text(self) -> str:
        """See `Allowed`."""
        return f"a list in which each {self.name} is {self.each.text}"

    def check(self, name: str, value: Any) -> tuple[Any, ...]:
        """See `Allowed`."""
        if isinstance(value, str) and value.strip().startswith("["):
            raise ParameterError(
                f"{name} = {shown(value)} arrived as text, not as a list;"
                f" write -y '{{{name}: {shortened(value.strip())}}}'"
            )
        if not is_list(value):
            single = isinstance(value, str | int | float)
            raise refused(name, value, f"a list{f', such as [{shown(value)}]' if single else ''}")
        if not 0 < len(value) <= MOST_VALUES:
            many = f"{MOST_VALUES} {name} at most, not {len(value)}"
            must = many if len(value) else f"at least one {self.name}"
            raise ParameterError(f"{name} = {shown(value)} must name {must}")
        values = tuple(self.each.check(self.name, one) for one in value)
        twice = {one for one, count in Counter(values).items() if count > 1}
        if twice:
            raise refused(name, value, f"a list that names {shown(min(twice))} once")
        return values


def is_list(value: Any) -> bool:
    """Whether it holds values in a row."""
    rows = isinstance(value, np.ndarray) and value.ndim == 1
    return rows or isinstance(value, list | tuple | range)


def refuse_text(name: str, value: Any) -> None:
    """Refuse a number that YAML 1.1 takes for text, for want of a point or of its power's sign.

    Raises:
        ParameterError: it is one.
    """
    found = POWER.fullmatch(value.strip()) if isinstance(value, str) else None
    if found:
        whole, part, sign, power = found.groups(default="")
        number = f"{whole or 0}.{part.strip('.') or 0}e{sign or '+'}{power}"
        raise ParameterError(f"{name} = {shown(value)} arrived as text; write {number}")


def refused(name: str, value: Any, text: str) -> ParameterError:
    """The refusal of a value: what it `must be` is the `text`."""
    return ParameterError(f"{name} = {shown(value)} must be {text}")


class _Short(Repr):
    """As `repr`, on one line, however large the value is."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlist = self.maxtuple = self.maxarray = self.maxdict = self.maxset = 10
        self.maxstring = self.maxother = LONGEST

    def repr_int(self, x: int, level: int) -> str:
        """Python refuses to print the largest."""
        return repr(x) if abs(x) < 10**40 else f"an integer of {x.bit_length()} bits"


def shown(value: Any) -> str:
    """A value as one line of a message."""
    return shortened(_Short().repr(value))


def shortened(text: str) -> str:
    """A text on one line, cut where it is long."""
    text = " ".join(text.split())
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]} ..."

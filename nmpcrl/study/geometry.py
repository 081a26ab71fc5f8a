"""Where obstacles and robot may stand: what a layout is, and what a start or a target may be."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from math import tau
from typing import Any

import numpy as np

from nmpcrl.study.parameters import Number, ParameterError, is_list, refused

MOST_OBSTACLES = 16  # of a layout: what the controller in the browser has room for
FARTHEST = 100.0  # of a centre from the origin, along an axis [m]
NEAR = Number.within(-FARTHEST, FARTHEST)
MOST_HEADING = tau  # of a start or a target, to either side [rad]

Centres = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Layout:
    """The name of a layout, or the centres of its obstacles [m].

    A layout is kept as one word: its name if it has one, otherwise its centres as text,
    `0.5,2.2 3,0.5`. So the same centres are the same layout however they were given, and every
    table, file and command line can hold one. The order of the obstacles counts.
    """

    named: Mapping[str, Centres]

    @property
    def choices(self) -> tuple[str, ...]:
        """The names, which a shell completes."""
        return tuple(self.named)

    @property
    def text(self) -> str:
        """See `Allowed`."""
        return (
            f"one of {', '.join(self.named)}, or 1 to {MOST_OBSTACLES} centres x,y"
            f" within {FARTHEST:g} m of 0"
        )

    def check(self, name: str, value: Any) -> str:
        """See `Allowed`."""
        if isinstance(value, str) and value in self.named:
            return str(value)
        return self._word(self._checked(name, value))

    def centres(self, layout: Any) -> Centres:
        """Where the obstacles of a layout stand, whichever way it is given.

        Raises:
            ParameterError: it is no layout.
        """
        if isinstance(layout, str) and layout in self.named:
            return self.named[layout]
        return self._checked("layout", layout)

    def _checked(self, name: str, value: Any) -> Centres:
        """Centres, of which there are neither none nor too many, and none out of range."""
        try:
            rows = _pairs(value) if isinstance(value, str) else value
            rows = [[NEAR.check(name, one) + 0.0 for one in row] for row in _listed(rows)]
        except (ParameterError, TypeError, ValueError):
            raise refused(name, value, self.text) from None
        if not 1 <= len(rows) <= MOST_OBSTACLES or any(len(row) != 2 for row in rows):
            raise refused(name, value, self.text)
        return tuple((x, y) for x, y in rows)

    def _word(self, centres: Centres) -> str:
        names = (name for name, known in self.named.items() if known == centres)
        return next(names, " ".join(f"{_short(x)},{_short(y)}" for x, y in centres))


@dataclass(frozen=True)
class Pose:
    """A position of the robot in a box, and its heading."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]
    choices: None = None

    @property
    def text(self) -> str:
        """See `Allowed`."""
        x, y, heading = (each.text.removeprefix("a number ") for each in self._each)
        return f"3 numbers: x {x}, y {y} and a heading {heading}"

    @cached_property
    def _each(self) -> list[Number]:
        turn = max(self.lower[2], -MOST_HEADING), min(self.upper[2], MOST_HEADING)
        walls = zip(self.lower[:2], self.upper[:2], strict=True)
        return [*(Number.within(*wall) for wall in walls), Number.within(*turn)]

    def check(self, name: str, value: Any) -> tuple[float, ...]:
        """See `Allowed`."""
        if not is_list(value) or len(value) != len(self.lower):
            raise refused(name, value, self.text)
        try:
            pairs = zip(self._each, value, strict=True)
            return tuple(each.check(name, one) + 0.0 for each, one in pairs)  # no -0.0
        except ParameterError:
            raise refused(name, value, self.text) from None


def short_name(layout: str | Centres) -> str:
    """The name of an experiment's layout, short enough for a table or a file."""
    word = str(layout)
    return f"drawn-{sha256(word.encode()).hexdigest()[:6]}" if "," in word else word


def are_centres(value: Any) -> bool:
    """Whether it has the form of one layout's centres, and not of several layouts."""
    rows = value.tolist() if isinstance(value, np.ndarray) else value
    if not is_list(rows) or not len(rows):
        return False
    return all(is_list(row) and not any(is_list(x) for x in row) for row in rows)


def _listed(value: Any) -> list[Any]:
    """The rows of a list of lists."""
    rows = value.tolist() if isinstance(value, np.ndarray) else value
    if not is_list(rows) or not all(map(is_list, rows)):
        raise TypeError
    return list(rows)


def _pairs(text: str) -> list[list[float]]:
    """The numbers of a text between commas or blanks, two and two."""
    numbers = [float(word) for word in text.replace(",", " ").split()]
    return [numbers[i : i + 2] for i in range(0, len(numbers), 2)]


def _short(number: float) -> str:
    """All digits of a number, and no more: 3 for 3.0."""
    return repr(number).removesuffix(".0")

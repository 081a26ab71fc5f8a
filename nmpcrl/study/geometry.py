"""Layouts of obstacles and poses of the robot, as values of parameters."""

from collections.abc import Mapping
from hashlib import sha256
from math import tau
from typing import Any

import numpy as np

from nmpcrl.study.parameters import Allowed, is_list, number, numbers

MOST_OBSTACLES = 16  # of a layout: the controller in the browser has no room for more
FARTHEST = 100.0  # of a centre from the origin, along an axis [m]
NEAR = number(-FARTHEST, FARTHEST)
MOST_HEADING = tau  # of a start or a target, to either side [rad]
CENTRES = f"1 to {MOST_OBSTACLES} centres x,y within {FARTHEST:g} m of 0"

Centres = tuple[tuple[float, float], ...]


def layout(named: Mapping[str, Centres]) -> Allowed:
    """The name of a layout, or the centres of its obstacles [m].

    A layout is stored as one word, its name or its centres as `0.5,2.2 3,0.5`, so that equal
    centres are equal layouts, and fit in a table. The order of the obstacles counts.
    """

    def read(value: Any) -> str:
        if isinstance(value, str) and value in named:
            return str(value)
        centres = _centres(value)
        names = (name for name, known in named.items() if known == centres)
        return next(names, " ".join(f"{_digits(x)},{_digits(y)}" for x, y in centres))

    return Allowed(f"one of {', '.join(named)}, or {CENTRES}", read, tuple(named))


def centres_of(given: Any, named: Mapping[str, Centres]) -> Centres:
    """The centres of the obstacles [m] of a layout in any form.

    Raises:
        ParameterError: it is no layout.
    """
    word = layout(named).check("layout", given)
    return named[word] if word in named else _centres(word)


def pose(lower: tuple[float, ...], upper: tuple[float, ...]) -> Allowed:
    """A position of the robot in a box, and its heading."""
    least = (*lower[:2], max(lower[2], -MOST_HEADING))
    each = [number(*ends) for ends in zip(least, (*upper[:2], MOST_HEADING), strict=True)]
    x, y, heading = (one.text.removeprefix("a number ") for one in each)
    plain = numbers(each, f"3 numbers: x {x}, y {y} and a heading {heading}")
    return Allowed(plain.text, lambda value: tuple(one + 0.0 for one in plain.read(value)))


def short_name(layout: str | Centres) -> str:
    """The name of an experiment's layout, short enough for a table or a file."""
    word = str(layout)
    return f"drawn-{sha256(word.encode()).hexdigest()[:6]}" if "," in word else word


def are_centres(value: Any) -> bool:
    """Whether a value has the form of one layout's centres, and not of several layouts."""
    rows = value.tolist() if isinstance(value, np.ndarray) else value
    if not is_list(rows) or not len(rows):
        return False
    return all(is_list(row) and not any(is_list(x) for x in row) for row in rows)


def _centres(value: Any) -> Centres:
    """The centres in a list of pairs, or in a text of numbers between commas or blanks."""
    if isinstance(value, str):
        flat = [float(word) for word in value.replace(",", " ").split()]
        value = [flat[i : i + 2] for i in range(0, len(flat), 2)]
    rows = value.tolist() if isinstance(value, np.ndarray) else value
    if not is_list(rows) or not 1 <= len(rows) <= MOST_OBSTACLES:
        raise ValueError
    if not all(is_list(row) and len(row) == 2 for row in rows):
        raise ValueError
    return tuple((NEAR.read(x) + 0.0, NEAR.read(y) + 0.0) for x, y in rows)  # no -0.0


def _digits(value: float) -> str:
    """All digits of a number, and no more: 3 for 3.0."""
    return repr(value).removesuffix(".0")

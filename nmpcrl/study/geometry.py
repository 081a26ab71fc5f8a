"""Layouts of obstacles and poses of the robot, as values of parameters."""

from collections.abc import Mapping
from hashlib import sha256
from math import tau
from typing import Any

import numpy as np

from nmpcrl.study.parameters import Allowed, need, number, numbers

MOST_OBSTACLES = 16  # of a layout: a page has no room for more
FARTHEST = 100.0  # of a centre from the origin, along an axis [m]

Centres = tuple[tuple[float, float], ...]


def layout(named: Mapping[str, Centres], names: str = "") -> Allowed:
    """The name of a layout, or the centres of its obstacles [m].

    A layout is stored as one word, its name or its centres as `0.5,2.2 3,0.5`, so that equal
    centres are equal layouts, and fit in a table. The order of the obstacles counts. `names` are
    all names in words, where a list of them is too long.
    """

    def read(value: Any) -> str:
        if isinstance(value, str) and value in named:
            return str(value)
        centres = _centres(value)
        digits = (",".join(repr(x).removesuffix(".0") for x in centre) for centre in centres)
        return next((name for name, one in named.items() if one == centres), " ".join(digits))

    centres = f"1 to {MOST_OBSTACLES} centres x,y within {FARTHEST:g} m of 0"
    return Allowed(f"one of {names or ', '.join(named)}, or {centres}", read, tuple(named))


def centres_of(given: Any, named: Mapping[str, Centres], names: str = "") -> Centres:
    """The centres of the obstacles [m] of a layout in any form; ParameterError for no layout."""
    word = layout(named, names).check("layout", given)
    return named[word] if word in named else _centres(word)


def pose(lower: tuple[float, ...], upper: tuple[float, ...]) -> Allowed:
    """A position of the robot in a box, and its heading, at most a turn to either side."""
    each = [*map(number, lower[:2], upper[:2]), number(-tau, tau)]
    x, y, heading = (one.text.removeprefix("a number ") for one in each)
    return numbers(each, f"3 numbers: x {x}, y {y} and a heading {heading}")


def short_name(layout: str | Centres) -> str:
    """The name of an experiment's layout, short enough for a table or a file."""
    word = str(layout)
    return f"drawn-{sha256(word.encode()).hexdigest()[:6]}" if "," in word else word


def _centres(value: Any) -> Centres:
    """The centres in a list of pairs, or in a text of numbers between commas or blanks."""
    if isinstance(value, str):
        words = value.replace(",", " ").split()
        value = np.reshape([float(word) for word in words], (-1, 2))
    found = np.asarray(value, float) + 0.0  # no -0.0
    need(found.ndim == 2 and found.shape[1] == 2 and 1 <= len(found) <= MOST_OBSTACLES)
    need(np.abs(found).max() <= FARTHEST)
    return tuple((x, y) for x, y in found.tolist())

"""Values as data: nothing else passes between the process of a notebook and the grader's.

What is read is a number, a text, a list, a tuple, a dictionary, an array or a table, of exactly
these types and whoever wrote it. A function is a number with which it can be called.
"""

from base64 import b64decode, b64encode
from collections.abc import Callable
from typing import Any

import numpy as np

Data = list[Any]  # what JSON holds: a tag, and what belongs to it
Functions = list[Callable[..., Any]]

NUMERIC = frozenset(f"<{kind}{size}" for kind in "iu" for size in (2, 4, 8))
NUMERIC |= {"|b1", "|i1", "|u1", "<f2", "<f4", "<f8"}


class NotPlain(ValueError):
    """Data hold no value."""


def encoded(value: Any, functions: Functions | None = None) -> Data:
    """A value as data.

    Args:
        value: of which the functions are added to those that the other side may call.
        functions: these; without them there may be none.

    Raises:
        TypeError: it is something else.
    """
    kind = type(value)
    if value is ...:
        return ["dots"]
    if value is None or kind in (bool, int, float, str):
        return ["one", value]
    if kind in (list, tuple):
        return [kind.__name__, [encoded(one, functions) for one in value]]
    if kind is dict:
        return ["dict", [[encoded(part, functions) for part in pair] for pair in value.items()]]
    if kind.__name__ == "DataFrame":
        return ["table", encoded(value.to_dict("list"), functions)]
    if callable(value) and functions is not None:
        functions.append(value)
        return ["function", len(functions) - 1]
    if hasattr(value, "__array__"):
        return _array(np.asarray(value), functions)
    if hasattr(value, "__float__"):  # a fraction, say
        return ["one", float(value)]
    raise TypeError(
        f"an answer cannot hold a value of the type {kind.__name__[:100]}, but numbers, texts, "
        "arrays, lists, tuples and dictionaries"
    )


def _array(array: Any, functions: Functions | None) -> Data:
    little = array.dtype.newbyteorder("<").str
    if little not in NUMERIC:
        return encoded(array.tolist(), functions)
    data = b64encode(array.astype(little).tobytes()).decode()
    return ["array", little, list(array.shape), data]


def decoded(data: Any, function: Callable[[int], Callable[..., Any]] | None = None) -> Any:
    """The value of such data.

    Args:
        data: of whatever shape.
        function: makes what calls the function of a number; without it there are none.

    Raises:
        NotPlain: it is no such data.
    """
    try:
        return _decoded(data, function)
    except (TypeError, ValueError, OverflowError, RecursionError, MemoryError):
        raise NotPlain("What was given is no value that can be read.") from None


def _decoded(data: Any, function: Callable[[int], Callable[..., Any]] | None) -> Any:
    match data:
        case ["dots"]:
            return ...
        case ["one", value] if value is None or type(value) in (bool, int, float, str):
            return value
        case ["list" | "tuple" as kind, [*parts]]:
            values = [_decoded(one, function) for one in parts]
            return values if kind == "list" else tuple(values)
        case ["dict", [*pairs]]:
            return {_decoded(key, None): _decoded(value, function) for key, value in pairs}
        case ["table", columns]:
            from pandas import DataFrame  # which not every notebook needs

            return DataFrame(_decoded(columns, None))
        case ["array", dtype, [*shape], text] if dtype in NUMERIC:
            array = np.frombuffer(b64decode(text), dtype).reshape([int(size) for size in shape])
            return array.copy() if shape else array.copy()[()]
        case ["function", int(number)] if function and number >= 0:
            return function(number)
    raise ValueError(data)

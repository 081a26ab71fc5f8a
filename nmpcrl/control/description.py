"""What describes a problem: all that is pickled of it, and all that its key is made of."""

import hashlib
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np


class Described:
    """Something that is pickled and copied by its fields, without what was worked out from them."""

    def __getstate__(self) -> dict[str, Any]:
        kind = type(self)
        return {
            name: value
            for name, value in vars(self).items()
            if not isinstance(getattr(kind, name, None), cached_property)
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """The fields; an array is as unchangeable as it was made."""
        for value in state.values():
            for one in value if isinstance(value, tuple) else (value,):
                if isinstance(one, np.ndarray):
                    one.setflags(write=False)
        vars(self).update(state)


class Recorded:
    """A function of the user as the expression that it wrote down."""

    def __init__(self, function: ca.Function) -> None:
        self.function = function

    def __call__(self, *arguments: ca.SX) -> Any:
        return self.function(*arguments)


def key(*parts: Any) -> str:
    """A hash, in hexadecimal, of what these say: the same in every process and on every machine."""
    return hashlib.sha256(_said(parts).encode()).hexdigest()


def _said(part: Any) -> str:
    """A part as text: numbers by all their digits, an expression by its instructions."""
    if part is None or isinstance(part, str):
        return repr(part)
    if isinstance(part, ca.Function):
        return _instructions(part)
    if isinstance(part, Mapping):
        part = tuple(part.items())
    if isinstance(part, tuple):
        return f"({', '.join(map(_said, part))})"
    array = np.asarray(part, float)
    return f"{array.shape}{array.tolist()}"


def _instructions(function: ca.Function) -> str:
    """What an SX function does, a line a step; all that CasADi knows where it calls others."""
    if ca.OP_CALL in map(function.instruction_id, range(function.n_instructions())):
        text: str = function.serialize()
        return text
    steps = [
        (
            function.instruction_id(k),
            function.instruction_input(k),
            function.instruction_output(k),
            function.instruction_constant(k),
        )
        for k in range(function.n_instructions())
    ]
    sizes = [function.size_in(k) for k in range(function.n_in())]
    return "\n".join(map(str, (sizes, *steps)))

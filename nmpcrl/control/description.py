"""What describes a problem: all that is pickled of it, and all that its key is made of."""

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl.control.content import content, instructions, is_ours


class Described(ABC):
    """Something that is pickled and copied by its fields, without what was worked out from them."""

    def __getstate__(self) -> dict[str, Any]:
        kind = type(self)
        return {
            name: value
            for name, value in vars(self).items()
            if not isinstance(getattr(kind, name, None), cached_property)
        }

    @property
    def key(self) -> str:
        """A hash of all that it does, the same in every process.

        Of a class of the user's, or an object with a method of its own, that is the code, too, with
        all that it reads of its module.

        Raises:
            NoContent: such a class or object holds what may be different each time.
        """
        kind, state = type(self), self.__getstate__()
        replaced = any(callable(getattr(kind, name, None)) for name in state)
        added = () if is_ours(kind) and not replaced else (repr(content([kind, state])),)
        return key(*self._described(), *added)

    @abstractmethod
    def _described(self) -> tuple[Any, ...]:
        """What it is, in numbers, text and expressions."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        """The fields; an array is as unchangeable as it was made."""
        for value in state.values():
            for one in value if isinstance(value, tuple) else (value,):
                if isinstance(one, np.ndarray):
                    one.setflags(write=False)
        vars(self).update(state)


class TracedFunction:
    """A function of the user as its CasADi expression, so that it can be pickled."""

    def __init__(self, function: ca.Function) -> None:
        self.function = function

    def __call__(self, *arguments: ca.SX) -> Any:
        return self.function(*arguments)

    @property
    def key(self) -> str:
        """A hash of the expression."""
        return key(self.function)


def key(*parts: Any) -> str:
    """A hash, in hexadecimal, of what these say: the same in every process and on every machine."""
    return hashlib.sha256(_said(parts).encode()).hexdigest()


def _said(part: Any) -> str:
    """A part as text: numbers by all their digits, an expression by its instructions."""
    if part is None or isinstance(part, str):
        return repr(part)
    if isinstance(part, ca.Function):
        return instructions(part)
    if isinstance(part, Mapping):
        part = tuple(part.items())
    if isinstance(part, tuple):
        return f"({', '.join(map(_said, part))})"
    array = np.asarray(part, float)
    return f"{array.shape}{array.tolist()}"

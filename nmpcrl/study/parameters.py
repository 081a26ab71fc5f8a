"""What a parameter may be: each check names the parameter, what was given and what is allowed."""

from collections.abc import Callable
from math import isfinite

from nmpcrl.control.nmpc import ABSURD


class ParameterError(ValueError):
    """A parameter is not what it may be; the message is one sentence that says so."""


def one_of(owner: object, name: str, allowed: tuple[str, ...]) -> None:
    """The field is one of the names `allowed`."""
    value = getattr(owner, name)
    if not isinstance(value, str) or value not in allowed:
        raise ParameterError(f"{name} = {value!r} must be one of {', '.join(allowed)}")


def whole(owner: object, name: str, *, least: int) -> None:
    """The field is a whole number, `least` or more."""
    value = getattr(owner, name)
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise ParameterError(f"{name} = {value!r} must be a whole number, {least} or more")


def number(owner: object, name: str, allowed: str, accept: Callable[[float], bool]) -> None:
    """The field is a finite number that `accept` accepts; `allowed` says which in words."""
    value = getattr(owner, name)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not isfinite(value) or not accept(value):
        raise ParameterError(f"{name} = {value!r} must be {allowed}")
    object.__setattr__(owner, name, float(value))


def true_or_false(owner: object, name: str) -> None:
    """The field is a truth value."""
    value = getattr(owner, name)
    if not isinstance(value, bool):
        raise ParameterError(f"{name} = {value!r} must be true or false")


def parameter_vector(owner: object, name: str, size: int) -> None:
    """The field is a list of `size` numbers that a solver can be given; it becomes a tuple."""
    given = getattr(owner, name)
    try:
        vector = () if isinstance(given, str | bytes) else tuple(float(value) for value in given)
    except (TypeError, ValueError):
        vector = ()
    if len(vector) != size or not all(isfinite(v) and abs(v) <= ABSURD for v in vector):
        raise ParameterError(
            f"{name} = {given!r} must be {size} numbers of size at most {ABSURD:g}"
        )
    object.__setattr__(owner, name, vector)

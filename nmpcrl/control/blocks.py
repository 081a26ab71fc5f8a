"""Named arrays that share one vector."""

import difflib
from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.vectors import floats


class Named(dict[str, Any]):
    """Values by name, as the symbols that a model reads; ValueError for an unknown name."""

    def __init__(self, what: str, values: Mapping[str, Any]) -> None:
        super().__init__(values)
        self._what = what

    def __missing__(self, name: str) -> Any:
        near = difflib.get_close_matches(str(name), self, 1)
        meant = f"; did you mean {near[0]!r}?" if near else ""
        raise ValueError(
            f"{self._what} has no {name!r}{meant} (it has {', '.join(self) or 'none'})"
        )


class Blocks(Named):
    """The shapes of named arrays, one after the other in a vector in the order of `np.ravel`."""

    def __init__(self, what: str, shapes: Mapping[str, tuple[int, ...]]) -> None:
        super().__init__(what, shapes)
        ends = np.cumsum([0, *(np.prod(shape, dtype=int) for shape in shapes.values())]).tolist()
        self.size: int = ends[-1]
        self._places = dict(zip(shapes, map(slice, ends[:-1], ends[1:]), strict=True))

    def part(self, name: str, vector: Any) -> Any:
        """The entries of one name in a vector, or in the last axis of an array."""
        return vector[..., self._places[name]]

    def marked(self, which: Any) -> str:
        """The names with an entry that is true in a vector of flags, with commas between."""
        return ", ".join(name for name in self if self.part(name, which).any())

    def split(self, vector: Vector) -> dict[str, Any]:
        """Every array by its name; a float where it is a single number."""
        arrays = {name: self.part(name, vector).reshape(self[name]) for name in self}
        return {name: a if a.shape else float(a) for name, a in arrays.items()}

    def symbols(self, vector: ca.SX) -> Named:
        """The arrays in a vector of symbols."""
        parts = {name: vector[place] for name, place in self._places.items()}
        return Named(self._what, {
            name: ca.reshape(part, *self[name][::-1]).T if len(self[name]) == 2 else part
            for name, part in parts.items()
        })  # fmt: skip

    def filled(self, base: Matrix, values: Mapping[str, Any]) -> Matrix:
        """A copy of `base`, vectors along its last axis, with these arrays in their places."""
        copy = np.array(base, float)
        for name, value in by_name(self._what, values).items():
            shape, whole = self[name], (*copy.shape[:-1], *self[name])
            array = numbers(f"{self._what} {name}", value, empty=0 in shape)
            if array.shape not in (shape, whole):
                either = f"{shape}" if whole == shape else f"{shape} or {whole}, a stage each"
                raise ValueError(
                    f"{self._what} {name!r} has shape {array.shape}; it must be {either}"
                )
            rows = array.reshape(*copy.shape[:-1], -1) if array.shape == whole else array.ravel()
            copy[..., self._places[name]] = rows
        return copy


def by_name(what: str, values: Any) -> Mapping[str, Any]:
    """The same; ValueError unless it has names."""
    if isinstance(values, Mapping):
        return values
    raise ValueError(f"{what} = {values!r} must have names: write {{'name': numbers}}")


def numbers(name: str, value: Any, *, empty: bool = False) -> Matrix:
    """An array of finite numbers, which may be `empty` where that is allowed; else ValueError."""
    array = floats(name, value)
    if not (array.size or empty) or not np.isfinite(array).all():
        raise ValueError(f"{name} = {value!r} must hold finite numbers")
    return array

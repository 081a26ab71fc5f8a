"""Named arrays that share one vector."""

import difflib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector


class Blocks(Mapping[str, tuple[int, ...]]):
    """Named arrays, one after the other in a vector, each in the order of `np.ravel`."""

    def __init__(self, what: str, shapes: Mapping[str, tuple[int, ...]]) -> None:
        self._what, self._shapes = what, dict(shapes)
        sizes = [int(np.prod(shape)) for shape in self._shapes.values()]
        ends = np.cumsum([0, *sizes]).tolist()
        self.size: int = ends[-1]
        self._places = dict(zip(self._shapes, map(slice, ends[:-1], ends[1:]), strict=True))

    def __getitem__(self, name: str) -> tuple[int, ...]:
        if name not in self._shapes:
            raise unknown(self._what, name, self._shapes)
        return self._shapes[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._shapes)

    def __len__(self) -> int:
        return len(self._shapes)

    def part(self, name: str, vector: Any) -> Any:
        """The entries of one name in a vector, or in the last axis of an array."""
        return vector[..., self._places[name]]

    def split(self, vector: Vector) -> dict[str, Any]:
        """Every array by its name; a float where it is a single number."""
        arrays = {name: self.part(name, vector).reshape(self[name]) for name in self}
        return {name: a if a.shape else float(a) for name, a in arrays.items()}

    def symbols(self, vector: ca.SX) -> "Symbols":
        """The arrays in a vector of symbols."""
        found = Symbols(self._what)
        for name, shape in self.items():
            part = vector[self._places[name]]
            found[name] = ca.reshape(part, *shape[::-1]).T if len(shape) == 2 else part
        return found

    def filled(self, base: Matrix, values: Mapping[str, Any]) -> Matrix:
        """A copy of `base`, vectors along its last axis, with these arrays in their places."""
        copy = np.array(base, float)
        for name, value in values.items():
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


class Symbols(dict[str, ca.SX]):
    """Symbols by name, in their shapes, as a model reads them."""

    def __init__(self, what: str) -> None:
        super().__init__()
        self._what = what

    def __missing__(self, name: str) -> ca.SX:
        raise unknown(self._what, name, self)


def unknown(what: str, name: str, known: Iterable[str]) -> ValueError:
    """The error for an unknown name, with the nearest known one."""
    near = difflib.get_close_matches(str(name), known, 1)
    meant = f"; did you mean {near[0]!r}?" if near else ""
    return ValueError(f"{what} has no {name!r}{meant} (it has {', '.join(known) or 'none'})")


def numbers(name: str, value: Any, *, empty: bool = False) -> Matrix:
    """An array of finite numbers, not `empty` unless that is allowed; ValueError for all else."""
    try:
        array = np.array(value, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {value!r} must be a number or an array of numbers") from None
    if not (array.size or empty) or not np.isfinite(array).all():
        raise ValueError(f"{name} = {value!r} must hold finite numbers")
    return array

"""Contents and keys: a value with another behaviour has another content, in every process.

The content of a function is its compiled code, its closure and the globals that it reads; comments
and its name change nothing. Objects of libraries are named, with the library's version.
"""

import dis
import hashlib
import sys
import sysconfig
from collections.abc import Iterator, Mapping
from functools import cache, cached_property, partial
from importlib.metadata import PackageNotFoundError, version
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import casadi as ca
import numpy as np

PLAIN = (type(None), bool, int, float, complex, str, bytes, range, type(Ellipsis))
AROUND = (
    property, cached_property, staticmethod, classmethod, type(cache(abs)), partial, MethodType,
)  # fmt: skip
WITHIN = ("fget", "fset", "func", "args", "keywords", "__wrapped__", "__self__", "__name__")
OWN = "nmpcrl"  # has epochs, in `provenance`, in place of a version


class NoContent(ValueError):
    """A value has no content; the message names it."""


class Described:
    """An object that is pickled, copied and hashed by its fields, without cached properties."""

    def __getstate__(self) -> dict[str, Any]:
        kind = type(self)
        return {
            name: value
            for name, value in vars(self).items()
            if not isinstance(getattr(kind, name, None), cached_property)
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the fields; arrays become read-only again."""
        for value in state.values():
            for one in value if isinstance(value, tuple) else (value,):
                if isinstance(one, np.ndarray):
                    one.setflags(write=False)
        vars(self).update(state)

    @property
    def key(self) -> str:
        """A hash of the fields, the same everywhere, and of the code of a user's class or method.

        Raises:
            NoContent: a field may be different each time.
        """
        return key_of(type(self), self.__getstate__())


def key_of(*values: Any) -> str:
    """A hash of the content of values, in hexadecimal."""
    return hashlib.sha256(repr(content(values)).encode()).hexdigest()


def content(value: Any, inside: tuple[int, ...] = ()) -> Any:
    """The content of a value: nested lists and texts, as JSON can hold them.

    Raises:
        NoContent: the value holds something that may be different each time, as a generator does.
    """
    if id(value) in inside:
        return "itself"
    if isinstance(value, PLAIN):
        return repr(value)
    inside = (*inside, id(value))
    if isinstance(value, np.ndarray | np.generic):
        return [str(value.dtype), np.asarray(value).tolist()]
    if isinstance(value, Mapping):
        return [[repr(name), content(one, inside)] for name, one in value.items()]
    if isinstance(value, tuple | list | frozenset | set):
        parts = [content(one, inside) for one in value]
        return parts if isinstance(value, tuple | list) else sorted(map(str, parts))
    if isinstance(value, ca.Function):
        return value.serialize()
    if isinstance(value, AROUND):
        return [content(getattr(value, name, None), inside) for name in WITHIN]
    if isinstance(value, ModuleType | FunctionType | BuiltinFunctionType | type):
        return _defined(value, inside)
    return _instance(value, inside)


def _instance(value: Any, inside: tuple[int, ...]) -> Any:
    """The content of an object: its key, Gymnasium's specification, or its class and fields."""
    key: Any = getattr(value, "key", None)
    spec: Any = getattr(value, "spec", None)
    if isinstance(key, str):
        return key
    if hasattr(spec, "to_json"):
        return spec.to_json()
    kind = type(value)
    names = getattr(value, "__dataclass_fields__", None)
    if names is None and (_is_library(kind.__module__) or not hasattr(value, "__dict__")):
        raise NoContent(
            f"a {kind.__name__}, {str(value)[:60]}, has no content of which a name can be made:"
            " make it inside of the function that needs it, or pass numbers"
        )
    parts = vars(value) if names is None else {name: getattr(value, name) for name in names}
    return [content(kind, inside), content(parts, inside)]


def _defined(value: Any, inside: tuple[int, ...]) -> Any:
    """The content of a module, a function or a class."""
    module = str(getattr(value, "__module__", None) or getattr(value, "__name__", ""))
    name = getattr(value, "__qualname__", "")
    if isinstance(value, ModuleType | BuiltinFunctionType) or _is_library(module):
        return [module, name, _version(module.partition(".")[0])]
    if isinstance(value, type):
        own = {n: one for n, one in vars(value).items() if _is_written(n, one)}
        return [content(value.__bases__, inside), content(own, inside)]
    closed = [cell.cell_contents for cell in value.__closure__ or ()]
    reads = {n: value.__globals__[n] for n in sorted(_reads(value.__code__)) if n in
             value.__globals__}  # fmt: skip
    parts = (value.__defaults__, value.__kwdefaults__, closed, reads)
    return [_code(value.__code__), *(content(part, inside) for part in parts)]


def _is_written(name: str, value: Any) -> bool:
    """Whether an attribute is written in its class, and not made by Python or a decorator."""
    if isinstance(value, FunctionType) and name != "__repr__":
        return not name.startswith("__") or value.__code__.co_filename != "<string>"
    return not name.startswith(("__", "_abc_"))


def _code(code: CodeType) -> Any:
    """Compiled code without its file and lines."""
    constants = [
        _code(one) if isinstance(one, CodeType) else content(one) for one in code.co_consts
    ]
    return [code.co_code.hex(), constants, [*code.co_names], [*code.co_varnames]]


def _reads(code: CodeType) -> Iterator[str]:
    """The globals that code and its inner functions read."""
    for step in dis.get_instructions(code):
        if step.opname in ("LOAD_GLOBAL", "LOAD_NAME"):
            yield step.argval
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _reads(one)


@cache
def _is_library(module: str) -> bool:
    """Whether a module belongs to Python, to an installed library or to this one."""
    root = module.partition(".")[0]
    if root == "__main__":
        return False
    if root == OWN or root in sys.stdlib_module_names:
        return True
    file = getattr(sys.modules.get(root), "__file__", None) or ""
    return file.startswith((sysconfig.get_path("purelib"), sysconfig.get_path("platlib")))


@cache
def _version(library: str) -> str:
    try:
        return version(library) if library != OWN else ""
    except PackageNotFoundError:
        return ""

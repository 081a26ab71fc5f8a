"""Python text to machine code by numba, kept on disk: compiled once on a machine, then loaded.

A package of modules lives in a folder named by a hash of its text and of all versions concerned,
so what is there is right by construction. numba keeps the machine code in the same folder.
"""

import hashlib
import importlib.util
import os
import platform
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Vector
from nmpcrl.control.codegen.source import CannotCompile, returns, source

COMPLETE = "complete"  # a file of this name says that everything in its folder is compiled


HEADER = """import math

import numpy as np
from numba import float64, njit, void


@njit({result}({arguments}), cache=True, error_model="numpy")
"""


def compiled(function: ca.Function) -> Callable[..., Any]:
    """`function` as machine code, called as `source` says, with contiguous arrays.

    Raises:
        CannotCompile: numba is missing, or an operation is not known.
    """
    returned = returns(function)
    sizes = [function.size_in(i) for i in range(function.n_in())]
    sizes += [] if returned else [function.size_out(i) for i in range(function.n_out())]
    header = HEADER.format(
        result="float64" if returned else "void",
        arguments=", ".join("float64[::1]" if k == 1 else "float64[:, ::1]" for _, k in sizes),
    )
    name = function.name()
    result: Callable[..., Any] = getattr(load(name, {"__init__": header + source(function)}), name)
    return result


def callable_of(function: ca.Function) -> Callable[..., Any]:
    """`function` of vectors with one result, on NumPy: compiled if that can be done.

    Returns a vector, or a float if the result is a scalar.
    """
    shape, scalar = function.size1_out(0), returns(function)
    try:
        code = compiled(function)
    except CannotCompile:
        if scalar:
            return lambda *vectors: float(function(*vectors))
        return lambda *vectors: function(*vectors).full().ravel()

    def call(*vectors: Vector) -> Vector | float:
        arrays = [np.ascontiguousarray(vector, dtype=float) for vector in vectors]
        if scalar:
            result: Vector | float = code(*arrays)
            return result
        out = np.empty(shape)
        code(*arrays, out)
        return out

    return call


@cache
def numba_version() -> str | None:
    """The version of numba that is installed; None where there is none."""
    try:
        return version("numba")
    except PackageNotFoundError:
        return None


def folder() -> Path:
    """Where machine code is kept: what NMPCRL_CACHE says, or nmpcrl in the user's cache folder."""
    chosen = os.environ.get("NMPCRL_CACHE")
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "nmpcrl"


def load(name: str, texts: Mapping[str, str], notice: str = "") -> ModuleType:
    """Import a package of modules; what numba compiles there is found again the next time.

    Args:
        name: what the package is called; a hash is added.
        texts: the text of each module by its name; that of `__init__` is returned.
        notice: said on standard error while something is compiled.

    Raises:
        CannotCompile: numba is not installed.
    """
    if numba_version() is None:
        raise CannotCompile("numba is not installed")
    depends = [sorted(texts.items()), sys.version, numba_version(), platform.machine()]
    package = f"{name}_{hashlib.sha256(repr(depends).encode()).hexdigest()[:16]}"
    if package not in sys.modules:
        place = _prepared(package, texts)
        if (place / COMPLETE).exists():
            try:
                return _import(package, place)
            except Exception as error:  # whatever a damaged file makes numba raise
                print(f"{place} is damaged ({error}) and is compiled again", file=sys.stderr)
                shutil.rmtree(place)
                place = _prepared(package, texts)
        _compile(package, place, notice)
    return sys.modules[package]


def _compile(package: str, place: Path, notice: str) -> None:
    began = time.perf_counter()
    if notice:
        print(notice, end=" ", file=sys.stderr, flush=True)
    try:
        _import(package, place)
    except Exception as error:  # numba's own; it cannot be imported to be named before it is found
        reason = str(error).strip().splitlines()[-1]
        raise CannotCompile(f"numba cannot compile {package}: {reason}") from error
    (place / COMPLETE).touch()
    if notice:
        print(f"done in {time.perf_counter() - began:.0f} s.", file=sys.stderr)


def _prepared(package: str, texts: Mapping[str, str]) -> Path:
    """The package's folder, its text written whole; a temporary one where no other can be."""
    place = folder() / package
    if place.exists():
        if all(_says(place / f"{module}.py", text) for module, text in texts.items()):
            return place
        print(f"{place} is damaged and is compiled again", file=sys.stderr)
        shutil.rmtree(place)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        drafted = Path(tempfile.mkdtemp(dir=place.parent, prefix=".draft"))
    except OSError as error:
        print(
            f"{place.parent} cannot be written ({error}): compiling for now only", file=sys.stderr
        )
        drafted = place = Path(tempfile.mkdtemp()) / package
        place.mkdir()
    for module, text in texts.items():
        (drafted / f"{module}.py").write_text(text)
    if drafted != place:
        try:
            drafted.rename(place)
        except OSError:  # another process was faster
            shutil.rmtree(drafted)
    return place


def _says(path: Path, text: str) -> bool:
    return path.is_file() and path.read_bytes() == text.encode()


def _import(package: str, place: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(
        package, place / "__init__.py", submodule_search_locations=[str(place)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"{place} is no package")
    module = sys.modules[package] = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        for name in [name for name in sys.modules if name.split(".")[0] == package]:
            del sys.modules[name]
        raise
    return module

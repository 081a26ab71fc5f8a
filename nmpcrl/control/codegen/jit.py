"""Python text to machine code by numba, kept on disk: compiled once on a machine, then loaded.

A package of modules lives in a folder named by a hash of its text and of all versions concerned,
and numba keeps the machine code in the same folder.
"""

import hashlib
import platform
import shutil
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Vector
from nmpcrl.control.codegen import folder
from nmpcrl.control.codegen.source import CannotCompile, source

COMPLETE = "complete"  # a file in the folder of a package: all of it is compiled
LOADING = threading.Lock()  # a package that one thread is importing is no package yet

HEADER = """import math

import numpy as np
from numba import float64, njit, void
from numba.types import Array

given, given_matrix = (Array(float64, axes, "C", readonly=True) for axes in (1, 2))


@njit({result}({arguments}), cache=True, error_model="numpy")
"""


def compiled(function: ca.Function, *, returned: bool = False) -> Callable[..., Any]:
    """`function` as machine code, called as `source` says, with contiguous arrays.

    Raises:
        CannotCompile: an operation is not known.
    """
    inputs = [function.size2_in(i) for i in range(function.n_in())]
    outputs = [] if returned else [function.size2_out(i) for i in range(function.n_out())]
    kinds = ["given" if columns == 1 else "given_matrix" for columns in inputs]
    kinds += ["float64[::1]" if columns == 1 else "float64[:, ::1]" for columns in outputs]
    result = "float64" if returned else "void"
    header = HEADER.format(result=result, arguments=", ".join(kinds))
    name, text = function.name(), source(function, returned=returned)
    made: Callable[..., Any] = getattr(load(name, {"__init__": header + text}), name)
    return made


def callable_of(function: ca.Function, *, scalar: bool = False) -> Callable[..., Any]:
    """`function` of vectors with one result, on NumPy: compiled if that can be done."""
    shape = function.size1_out(0)
    try:
        code = compiled(function, returned=scalar)
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


def key(name: str, texts: Mapping[str, str], *more: object) -> str:
    """`name` and a hash of the texts and of all versions on which compiled code depends."""
    depends = [sorted(texts.items()), sys.version, version("numba"), platform.machine(), *more]
    return f"{name}_{hashlib.sha256(repr(depends).encode()).hexdigest()[:16]}"


def load(name: str, texts: Mapping[str, str], notice: str = "") -> ModuleType:
    """Import a package of modules; the next process finds what numba compiles in it.

    Args:
        name: of the package; a hash is added.
        texts: the text of each module by its name; the module `__init__` is returned.
        notice: said on standard error while something is compiled.

    Raises:
        CannotCompile: numba cannot compile this.
        OSError: a temporary folder cannot hold it either.
    """
    package = key(name, texts)
    with LOADING:
        if package in sys.modules:
            return sys.modules[package]
        return folder.use(package, lambda place: _load(place, texts, notice))


def _load(place: Path, texts: Mapping[str, str], notice: str) -> ModuleType:
    """The package from its folder, compiled if it is not complete."""
    complete = folder.private(place) / COMPLETE
    if complete.exists():
        try:
            if not _holds(place, texts):
                raise ImportError("its text is another")
            return folder.import_package(place)
        except (OSError, MemoryError):
            raise
        except Exception as error:  # whatever a damaged file makes numba raise
            print(f"{place} is damaged ({error}) and is compiled again", file=sys.stderr)
    shutil.rmtree(place)
    began = time.perf_counter()
    if notice:
        print(notice, end=" ", file=sys.stderr, flush=True)
    try:
        folder.write(place, texts)
        module = folder.import_package(place)
    except Exception as error:
        shutil.rmtree(place, ignore_errors=True)
        if isinstance(error, OSError | MemoryError) or not _in_numba(error):
            raise
        reason = (str(error).strip() or type(error).__name__).splitlines()[-1]
        raise CannotCompile(f"numba cannot compile {place.name}: {reason}") from error
    complete.touch()
    if notice:
        print(f"done in {time.perf_counter() - began:.0f} s.", file=sys.stderr)
    return module


def _holds(place: Path, texts: Mapping[str, str]) -> bool:
    """Whether the modules in a folder have these texts."""
    paths = {place / f"{module}.py": text.encode() for module, text in texts.items()}
    return all(path.is_file() and path.read_bytes() == text for path, text in paths.items())


def _in_numba(error: Exception) -> bool:
    """Whether an error was raised while numba compiled, and not by a module's own lines."""
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    names = {frame.f_globals.get("__name__", "").partition(".")[0] for frame in frames}
    return bool(names & {"numba", "llvmlite"})

"""Python text to machine code by numba, kept on disk: compiled once on a machine, then loaded.

A package of modules lives in a folder named by a hash of its text and of all versions concerned,
so what is there is right by construction. numba keeps the machine code in the same folder, which
`folder` finds; where the disk fails, the same text is compiled in memory.
"""

import hashlib
import platform
import shutil
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Vector
from nmpcrl.control.codegen import folder, importing
from nmpcrl.control.codegen.source import CannotCompile, returns, source

COMPLETE = "complete"  # a file that says that everything in its folder is compiled: a checksum
LOADING = threading.Lock()  # a package that one thread is importing is no package yet

HEADER = """import math

import numpy as np
from numba import float64, njit, void
from numba.types import Array

given, given_matrix = (Array(float64, axes, "C", readonly=True) for axes in (1, 2))


@njit({result}({arguments}), cache=True, error_model="numpy")
"""


def compiled(function: ca.Function, *, returned: bool | None = None) -> Callable[..., Any]:
    """`function` as machine code, called as `source` says, with contiguous arrays.

    Raises:
        CannotCompile: numba is missing, or an operation is not known.
    """
    returned = returns(function) if returned is None else returned
    inputs = [function.size2_in(i) for i in range(function.n_in())]
    outputs = [] if returned else [function.size2_out(i) for i in range(function.n_out())]
    kinds = ["given" if columns == 1 else "given_matrix" for columns in inputs]
    kinds += ["float64[::1]" if columns == 1 else "float64[:, ::1]" for columns in outputs]
    result = "float64" if returned else "void"
    header = HEADER.format(result=result, arguments=", ".join(kinds))
    name, text = function.name(), source(function, returned=returned)
    made: Callable[..., Any] = getattr(load(name, {"__init__": header + text}), name)
    return made


def callable_of(function: ca.Function, *, scalar: bool | None = None) -> Callable[..., Any]:
    """`function` of vectors with one result, on NumPy: compiled if that can be done.

    Returns a vector, or a float if the result is a scalar and not to be a vector of one.
    """
    shape, scalar = function.size1_out(0), returns(function) if scalar is None else scalar
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


@cache
def numba_version() -> str | None:
    """The version of numba that is installed; None where there is none."""
    try:
        return version("numba")
    except PackageNotFoundError:
        return None


def load(name: str, texts: Mapping[str, str], notice: str = "") -> ModuleType:
    """Import a package of modules; what numba compiles there is found again the next time.

    Args:
        name: what the package is called; a hash is added.
        texts: the text of each module by its name; that of `__init__` is returned.
        notice: said on standard error while something is compiled.

    Raises:
        CannotCompile: numba is not installed, or cannot compile this.
        MemoryError: what is compiled cannot be loaded, though it is as it was written.
        RuntimeError: the texts do not fit each other.
    """
    if numba_version() is None:
        raise CannotCompile("numba is not installed")
    depends = [sorted(texts.items()), sys.version, numba_version(), platform.machine()]
    package = f"{name}_{hashlib.sha256(repr(depends).encode()).hexdigest()[:16]}"
    with LOADING:
        return sys.modules.get(package) or _load(package, texts, notice)


def _load(package: str, texts: Mapping[str, str], notice: str) -> ModuleType:
    """From the cache, from a temporary folder, from memory: no fault of a disk has a say."""
    for find, instead in (
        (folder.chosen, "in a temporary folder"),
        (folder.temporary, "in memory"),
    ):
        try:
            return _from_disk(folder.private(find()), package, texts, notice)
        except OSError as error:
            folder.say_once(error, f"machine code is kept {instead} until this process ends")
        except MemoryError:
            raise
        except Exception:  # of the text, or of what became of it on the disk: memory will tell
            break
    return _from_memory(package, texts, notice)


def _from_disk(parent: Path, package: str, texts: Mapping[str, str], notice: str) -> ModuleType:
    """The package from its folder, where it is written and compiled if it is not there whole.

    Raises:
        OSError: the disk does not let it.
    """
    place = parent / package
    if not place.exists():
        folder.write(place, texts)
    folder.private(place)
    try:
        if not _holds(place, texts):
            raise ImportError("its text is another")
        if (place / COMPLETE).exists():
            return importing.from_folder(package, place)
    except (OSError, MemoryError):
        raise
    except Exception as error:  # whatever a damaged file makes numba raise
        if _is_as_compiled(place):
            raise MemoryError(
                f"{place} is whole and cannot be loaded ({error}): is there too little memory?"
            ) from error
        print(f"{place} is damaged ({error}) and is compiled again", file=sys.stderr)
        shutil.rmtree(place)
        folder.write(place, texts)
    try:
        with _announced(notice):
            module = importing.from_folder(package, place)
    except OSError:
        raise
    except Exception as error:
        disturbed = not _holds(place, texts)
        shutil.rmtree(place, ignore_errors=True)
        if disturbed:
            raise OSError(f"{place} was changed while it was compiled") from error
        raise
    with suppress(OSError):  # it is compiled, and the next process compiles it once more
        (place / COMPLETE).write_text(_checksum(place))
    return module


def _is_as_compiled(place: Path) -> bool:
    """Whether a folder that is complete holds what was compiled."""
    complete = place / COMPLETE
    return complete.is_file() and complete.read_text("utf-8") == _checksum(place)


def _checksum(place: Path) -> str:
    """Of all that is in a folder but `COMPLETE`."""
    hashed = hashlib.sha256()
    for path in sorted(place.rglob("*")):
        if path.is_file() and path.name != COMPLETE:
            hashed.update(path.relative_to(place).as_posix().encode() + path.read_bytes())
    return hashed.hexdigest()


def _holds(place: Path, texts: Mapping[str, str]) -> bool:
    """Whether the modules in a folder have these texts."""
    paths = {place / f"{module}.py": text.encode() for module, text in texts.items()}
    return all(path.is_file() and path.read_bytes() == text for path, text in paths.items())


def _from_memory(package: str, texts: Mapping[str, str], notice: str) -> ModuleType:
    """The package without any file, for this process alone; numba caches in files only."""
    uncached = {module: text.replace(", cache=True", "") for module, text in texts.items()}
    try:
        with _announced(notice):
            return importing.from_memory(package, uncached)
    except Exception as error:
        reason = (str(error).strip() or type(error).__name__).splitlines()[-1]
        if _passed_through_numba(error):
            raise CannotCompile(f"numba cannot compile {package}: {reason}") from error
        raise RuntimeError(
            f"the modules of {package} do not fit each other ({reason}): if nmpcrl was changed"
            " while it ran, start it again"
        ) from error


def _passed_through_numba(error: Exception) -> bool:
    """Whether it was raised while numba compiled, and not by a module's own lines."""
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    names = {frame.f_globals.get("__name__", "").partition(".")[0] for frame in frames}
    return bool(names & {"numba", "llvmlite"})


@contextmanager
def _announced(notice: str) -> Iterator[None]:
    """Say `notice` before something that takes long, and how long it took after it."""
    if not notice:
        yield
        return
    began = time.perf_counter()
    print(notice, end=" ", file=sys.stderr, flush=True)
    try:
        yield
    except BaseException:
        print("stopped.", file=sys.stderr)
        raise
    print(f"done in {time.perf_counter() - began:.0f} s.", file=sys.stderr)

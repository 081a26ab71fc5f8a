"""The folder in which machine code is kept, and to which only its user may write.

numba runs the files in it, so anyone who can write to it can run code as its user.
"""

import atexit
import importlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from filelock import FileLock

CHOSEN = "NMPCRL_CACHE"  # in the environment: another folder than the default
OTHERS = 0o022  # may write: the group, and everybody
Result = TypeVar("Result")


def chosen() -> Path:
    """NMPCRL_CACHE, or nmpcrl in the user's cache folder."""
    named = os.environ.get(CHOSEN)
    if named:
        return Path(named)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "nmpcrl"


def use(name: str, work: Callable[[Path], Result]) -> Result:
    """The result of `work` on the place of this name, in one process at a time.

    Where it meets an `OSError`, a temporary folder takes the place of the chosen one, here and in
    processes started from here; a message says why.
    """
    try:
        return _locked(name, work)
    except OSError as error:
        why = f"{chosen()}: {error.strerror}" if error.strerror else str(error)
    place = tempfile.mkdtemp(prefix="nmpcrl-")
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    os.environ[CHOSEN] = place
    message = f"{why}; machine code is kept in a temporary folder until this process ends"
    print(message, file=sys.stderr)
    return _locked(name, work)


def _locked(name: str, work: Callable[[Path], Result]) -> Result:
    place = private(chosen()) / name
    with FileLock(f"{place}.lock"):
        return work(place)


def private(place: Path) -> Path:
    """`place`, made if it is missing, once it is known to be this user's own.

    Raises:
        OSError: it cannot be made or written, or another user could put code there.
    """
    place.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not os.access(place, os.W_OK):
        raise PermissionError(f"{place} cannot be written")
    if hasattr(os, "getuid"):  # elsewhere a folder's rights are not told by its mode
        about = place.stat()
        if about.st_uid != os.getuid():
            raise PermissionError(f"{place} belongs to another user")
        if about.st_mode & OTHERS:
            raise PermissionError(f"others may write to {place}, which `chmod go-w` ends")
    return place


def write(place: Path, texts: Mapping[str, str]) -> None:
    """Write the modules of a package into its folder, made if it is missing."""
    private(place)
    for module, text in texts.items():
        (place / f"{module}.py").write_bytes(text.encode())


def import_package(place: Path) -> ModuleType:
    """The package in a folder; if its import fails, none of its modules stays."""
    sys.path.insert(0, str(place.parent))
    importlib.invalidate_caches()
    try:
        return importlib.import_module(place.name)
    except BaseException:
        for name in [name for name in sys.modules if name.split(".")[0] == place.name]:
            del sys.modules[name]
        raise
    finally:
        sys.path.remove(str(place.parent))

"""The folder in which machine code is kept, and to which only its user may write.

numba runs what it finds there, so anyone who can write to it can run code as its user.
"""

import atexit
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path

CHOSEN = "NMPCRL_CACHE"  # in the environment: another folder than the default
ROOM = 4_000_000  # bytes: three times the size of the compiled solver
OTHERS = 0o022  # may write: the group, and everybody


def chosen() -> Path:
    """What NMPCRL_CACHE says, or nmpcrl in the user's cache folder."""
    said = os.environ.get(CHOSEN)
    if said:
        return Path(said)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "nmpcrl"


def temporary() -> Path:
    """A new folder that takes over, here and in the processes started from here, until the end."""
    place = tempfile.mkdtemp(prefix="nmpcrl-")
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    os.environ[CHOSEN] = place
    return Path(place)


def private(place: Path) -> Path:
    """`place`, made if it is not there, once it is known to be this user's own.

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
    """Put modules there, all at once; another process may have been faster.

    Raises:
        OSError: they cannot be written, or there is no room for what numba will add.
    """
    drafted = Path(tempfile.mkdtemp(dir=place.parent, prefix=".draft"))
    try:
        (drafted / "room").write_bytes(bytes(ROOM))
        (drafted / "room").unlink()
        for module, text in texts.items():
            (drafted / f"{module}.py").write_bytes(text.encode())
        drafted.rename(place)
    except OSError:
        shutil.rmtree(drafted, ignore_errors=True)
        if not place.exists():
            raise


@cache
def _say(sentence: str) -> None:
    print(sentence, file=sys.stderr)


def say_once(error: OSError, consequence: str) -> None:
    """Say why a folder is not used and what follows, the same only once in a process."""
    where = f"{chosen()}: {error.strerror}" if error.strerror else str(error)
    _say(f"{where}; {consequence}")

"""Files that are written whole or not at all.

A file is filled under another name beside its place, `.half-PROCESS-HOST-….tmp`, and then renamed.
`sweep` removes the unfinished files of killed processes.
"""

import contextlib
import json
import os
import secrets
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import IO, Any

from nmpcrl.study.storage.machine import host, is_running

OLD = 3600.0  # age [s] beyond which nobody is still filling a file whose writer cannot be asked for
BLOCK = 4096  # bytes that a folder must take before it is relied upon


def write_whole(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Let `write` fill a file beside `path`, then rename it into place: no reader sees a part.

    Raises:
        OSError: the folder cannot be made or the file not be written; what was there stays.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    sweep(path.parent)
    with _half(path.parent) as (name, file):
        write(file)
        file.flush()
        os.fsync(file.fileno())
        file.close()
        name.replace(path)


def write_json(path: Path, content: Any, indent: int | None = None) -> None:
    """`write_whole` for JSON, in UTF-8 and with a line's end."""
    text = json.dumps(content, indent=indent, ensure_ascii=False) + "\n"
    write_whole(path, lambda file: file.write(text.encode()))


def try_to_write(folder: Path) -> None:
    """Write a small file to `folder`, and delete it again.

    Raises:
        OSError: it cannot be written.
    """
    with _half(folder) as (_, file):
        file.write(bytes(BLOCK))
        file.flush()
        os.fsync(file.fileno())


@contextmanager
def _half(folder: Path) -> Iterator[tuple[Path, IO[bytes]]]:
    """A new file to be filled, with the mode that the umask leaves; gone in the end."""
    name = folder / f".half-{os.getpid()}-{host()}-{secrets.token_hex(4)}.tmp"
    try:
        with name.open("xb") as file:
            yield name, file
    finally:
        with contextlib.suppress(OSError):
            name.unlink()


@cache
def sweep(folder: Path) -> None:
    """Remove the unfinished files of writers that have ended; once per process and folder.

    A writer on this host is looked up by its number; files of other hosts are kept for an hour.
    """
    for half in folder.glob(".half-*.tmp"):
        with contextlib.suppress(OSError):
            if not _is_being_filled(half):
                half.unlink()


def _is_being_filled(half: Path) -> bool:
    process, _, rest = half.name.removeprefix(".half-").partition("-")
    if process.isdecimal() and rest.startswith(f"{host()}-"):
        return is_running(int(process))
    return time.time() - half.stat().st_mtime < OLD

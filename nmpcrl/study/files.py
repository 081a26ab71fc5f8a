"""Files that are written completely or not at all, and the folder of the runs."""

import json
import os
import secrets
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from filelock import FileLock, Timeout

from nmpcrl.study.refusal import Refusal


class StoreError(Refusal):
    """The folder of the runs cannot be written or read."""


def folder() -> Path:
    """The folder of the runs: `runs`, or the environment variable NMPCRL_RUNS."""
    return Path(os.environ.get("NMPCRL_RUNS") or "runs")


def check_folder() -> None:
    """Make the folder of the runs and write a file to it; StoreError where that is impossible."""
    place = folder()
    try:
        place.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=place) as file:
            file.write(bytes(4096))
    except OSError as error:
        raise unwritable(place, error) from error


def lock(name: str) -> FileLock:
    """The lock of a value that is stored under a name; not acquired.

    One process at a time makes a value. The system frees the lock of a process that ends.
    """
    place = folder() / ".locks"
    place.mkdir(parents=True, exist_ok=True)
    return FileLock(place / name, thread_local=False)


def wait_for(name: str) -> Any:
    """Acquire the lock of a value; say so where another process makes the value."""
    one = lock(name)
    try:
        return one.acquire(timeout=0)
    except Timeout:
        say(f"another process is making {name}; waiting for it")
        return one.acquire()


def unwritable(path: Path, error: OSError) -> StoreError:
    """The sentence about a path that cannot be written."""
    return StoreError(
        f"{path} cannot be written ({error.strerror or error}): correct that, or set NMPCRL_RUNS to"
        " another folder"
    )


def say(sentence: str) -> None:
    """Print a sentence on standard error, unless that is closed."""
    with suppress(OSError, ValueError):
        print(sentence, file=sys.stderr, flush=True)


def write_file(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Let `write` fill a temporary file, then rename it to `path`: no reader sees a part of it.

    An earlier file stays where that fails.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}-{secrets.token_hex(4)}.tmp")
    try:
        with temporary.open("xb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_json(path: Path, content: Any, indent: int | None = None) -> None:
    """`write_file` for JSON, in UTF-8 and with a final line break."""
    text = json.dumps(content, indent=indent, ensure_ascii=False) + "\n"
    write_file(path, lambda file: file.write(text.encode()))

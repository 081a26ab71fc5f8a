"""The folder of the runs: checked before training, with another place where it fails."""

import errno
import os
import re
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from nmpcrl.study.storage.archive import DamagedRecords
from nmpcrl.study.storage.atomic import sweep, try_to_write
from nmpcrl.study.storage.refusal import Refusal

CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f]")
UNREADABLE = (errno.EACCES, errno.EPERM, errno.EMFILE, errno.ENFILE)  # the file may yet be whole


class StoreError(Refusal):
    """Runs cannot be kept where they should be, or not be read; the message says what to do."""


def folder() -> Path:
    """Where runs are kept: `runs`, or what the environment variable NMPCRL_RUNS says."""
    return Path(os.environ.get("NMPCRL_RUNS") or "runs")


def refuse_file(place: Path | None = None) -> None:
    """Refuse a file where a folder belongs, which is not the same as an empty folder.

    Raises:
        StoreError: it is a file, or below one.
    """
    place = place or folder()
    for above in (place, *place.parents):
        if os.path.lexists(above) and not above.is_dir():
            raise StoreError(refusal(f"cannot be a folder: {above} is a file"))


def check_folder(needed: int = 0, place: Path | None = None) -> None:
    """See that runs can be kept before any is trained; what killed writers left is swept away.

    Args:
        needed: how many bytes they will take.
        place: the folder; by default that of the runs.

    Raises:
        StoreError: it is a file or below one, cannot be made or written, or has not so much room.
    """
    place = place or folder()
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        refuse_file(place)
        raise StoreError(refusal(f"cannot be made ({error.strerror})", place)) from error
    sweep(place)
    try:
        try_to_write(place)
        free = shutil.disk_usage(place).free
    except OSError as error:
        raise StoreError(refusal(f"cannot be written ({error.strerror})", place)) from error
    if free < needed:
        raise StoreError(
            refusal(f"has room for {free / 1e6:.2f} MB of the needed {needed / 1e6:.2f} MB", place)
        )


def say(sentence: str) -> None:
    """Print a sentence on standard error; no study fails because that cannot be written."""
    with suppress(OSError, ValueError):  # a log on a full disk, a terminal that was closed
        print(harmless(sentence), file=sys.stderr, flush=True)


def harmless(text: str) -> str:
    """A text of a file's, of which nothing is a command to the terminal."""
    return CONTROL.sub("?", text)


def refusal(why: str, place: Path | None = None) -> str:
    """The sentence that refuses a folder."""
    return (
        f"{place or folder()}, where runs are kept, {why}; correct that, or set NMPCRL_RUNS to"
        " another folder"
    )


def keep(path: Path, save: Callable[[Path], None]) -> bool:
    """Let `save` write what is finished to `path`; where that fails, elsewhere, and say so.

    Returns:
        Whether it is where it belongs.
    """
    try:
        save(path)
        return True
    except OSError as error:
        said = f"{path} cannot be written ({error.strerror or error})"
    try:
        place = _temporary()
        instead = place / os.path.relpath(path, folder())
        save(instead)
        said += f"; it is kept as {instead}: move it, or set NMPCRL_RUNS={place}"
    except (OSError, StoreError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        said += f", nor anything in {tempfile.gettempdir()} ({why}); it is not stored"
    say(said)
    return False


def _temporary() -> Path:
    """A folder of the user's own, which no one else can read or write."""
    user = os.getuid() if hasattr(os, "getuid") else "own"
    place = Path(tempfile.gettempdir()) / f"nmpcrl-runs-{user}"
    place.mkdir(mode=0o700, exist_ok=True)
    found = place.lstat()
    private = stat.S_ISDIR(found.st_mode) and not stat.S_IMODE(found.st_mode) & 0o077
    if hasattr(os, "getuid") and (found.st_uid != user or not private):
        raise StoreError(f"{place} is open to others")
    return place


def set_aside(path: Path, error: DamagedRecords) -> None:
    """Keep a damaged file under a new name, and say so; for who has reserved its run.

    Raises:
        StoreError: it cannot be renamed, or not be read, which does not mean that it is damaged.
    """
    cause = error.__cause__
    if isinstance(cause, OSError) and cause.errno in UNREADABLE:
        raise StoreError(
            f"{path} cannot be read ({cause.strerror}); correct that, or move the file away"
        )
    aside, count = path.with_suffix(".damaged"), 1
    while os.path.lexists(aside):
        count += 1
        aside = path.with_suffix(f".damaged{count}")
    try:
        path.rename(aside)
    except FileNotFoundError:
        return
    except OSError as refused:
        raise StoreError(f"{error}, and cannot be renamed ({refused.strerror})") from error
    say(f"{error}; it is kept as {aside.name}, and the run is done again")

"""Files that are written completely or not at all, and the folder of the runs.

A file of tables is an `.npz` with members TABLE/COLUMN, and one member of JSON, `about`. The CRC-32
of its members detects damage.
"""

import json
import os
import secrets
import shutil
import sys
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from nmpcrl.study.refusal import Refusal

Column = NDArray[Any]
Tables = dict[str, dict[str, Column]]  # columns by name, by the name of their table

ABOUT = "about"


class DamagedRecords(Refusal):
    """A file is incomplete, or of another run than its name says."""


class StoreError(Refusal):
    """The folder of the runs cannot be written or read."""


def folder() -> Path:
    """The folder of the runs: `runs`, or the environment variable NMPCRL_RUNS."""
    return Path(os.environ.get("NMPCRL_RUNS") or "runs")


def check_folder(needed: int = 0, place: Path | None = None) -> None:
    """Make a folder, by default that of the runs, and see that files can be written to it.

    Args:
        needed: bytes that will be written.
        place: the folder.

    Raises:
        StoreError: it cannot be made or written, or has less space.
    """
    place = place or folder()
    try:
        place.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=place) as file:
            file.write(bytes(4096))
        free = shutil.disk_usage(place).free
    except OSError as error:
        raise unwritable(place, error) from error
    if free < needed:
        raise StoreError(
            f"{place} has {free / 1e6:.2f} MB of free space and needs {needed / 1e6:.2f} MB: make"
            " space, or set NMPCRL_RUNS to another folder"
        )


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

    Raises:
        OSError: the file cannot be written; an earlier file of this name stays.
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


def save_tables(path: Path, about: Mapping[str, Any], tables: Tables) -> None:
    """Write tables and the facts `about` them; errors as in `write_file`."""
    arrays: dict[str, Any] = {
        f"{table}/{name}": np.asarray(column)
        for table, columns in tables.items()
        for name, column in columns.items()
    }
    arrays[ABOUT] = np.array(json.dumps(about))
    write_file(path, lambda file: np.savez_compressed(file, **arrays))


def load_tables(
    path: Path, columns: Mapping[str, Collection[str]]
) -> tuple[dict[str, Any], Tables]:
    """The facts and the tables that `save_tables` wrote.

    Args:
        path: of the file.
        columns: names by table.

    Raises:
        OSError: the file cannot be opened.
        DamagedRecords: it is damaged, has other columns, or columns of unequal length.
    """
    with _opened(path) as file:
        about = json.loads(str(file[ABOUT]))
        tables: Tables = {table: {} for table in columns}
        for member in file.files:
            table, _, name = member.partition("/")
            if name:
                tables[table][name] = file[member]
        for table, names in columns.items():
            lengths = {len(column) for column in tables[table].values()}
            if set(tables[table]) != set(names) or len(lengths) > 1:
                raise DamagedRecords(f"{path} has other columns of {table}")
        return about, tables


def load_about(path: Path) -> dict[str, Any]:
    """The facts alone; errors as in `load_tables`."""
    with _opened(path) as file:
        return dict(json.loads(str(file[ABOUT])))


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """A file of arrays; an error while it is read is one of its content."""
    with path.open("rb") as raw:
        try:
            with np.load(raw, allow_pickle=False) as file:
                yield file
        except DamagedRecords:
            raise
        except Exception as error:
            raise DamagedRecords(f"{path} is damaged, or not a run") from error

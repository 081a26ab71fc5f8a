"""Files of arrays: tables of columns and one JSON text that says what they are about.

A file has a checksum of its content, and is checked against the form that it must have. An older
file without a checksum is accepted if everything else is as expected.
"""

import json
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nmpcrl.study.storage.atomic import write_whole
from nmpcrl.study.storage.refusal import Refusal

Column = NDArray[Any]
Tables = dict[str, dict[str, Column]]  # columns by name, by the name of their table
Field = tuple[str, type] | tuple[str, type, int | tuple[int, ...]]  # name, type[, shape]

ABOUT, CHECKSUM = "about", "checksum"  # beside the columns, whose names are TABLE/COLUMN


class Form(NamedTuple):
    """What a table must look like."""

    fields: list[Field]
    rows: Collection[int]  # how many there may be


Forms = Mapping[str, Form]  # by the name of the table


class DamagedRecords(Refusal):
    """A file is not a whole run, or not the run that was asked for; the message says why."""


class _Unlike(ValueError):
    """Something in a file is not as it must be; the message says what."""


def save_arrays(path: Path, about: dict[str, Any], tables: Tables) -> None:
    """Write columns, facts and their checksum beside `path`, then rename the file into place.

    Raises:
        OSError: it cannot be written; what was there stays.
    """
    arrays: dict[str, Any] = {
        f"{table}/{name}": np.asarray(column)
        for table, columns in tables.items()
        for name, column in columns.items()
    }
    arrays[ABOUT] = np.array(json.dumps(about))
    arrays[CHECKSUM] = np.array(_checksum(arrays))
    write_whole(path, lambda file: np.savez_compressed(file, **arrays))


def load_arrays(
    path: Path, forms: Callable[[dict[str, Any]], Forms]
) -> tuple[dict[str, Any], Tables]:
    """The facts and the tables of a file that `save_arrays` wrote.

    Args:
        path: of the file.
        forms: of its tables, by what it is about; a ValueError of it says what is wrong with that.

    Raises:
        FileNotFoundError: there is none.
        DamagedRecords: it is not whole, or not of these forms.
    """
    with _reading(path) as file:
        about, expected = _about(file, forms)
        arrays = {name: _array(file, name) for name in file.files}
        checksum = arrays.pop(CHECKSUM, None)
        if checksum is not None and str(checksum) != _checksum(arrays):
            raise _Unlike("its content is not what its checksum says")
        tables: Tables = {table: {} for table in expected}
        for name in [name for name in arrays if name != ABOUT]:
            table, _, column = name.partition("/")
            tables[table][column] = arrays[name]
        for table, form in expected.items():
            _check(table, tables[table], form)
        return about, tables


def load_about(path: Path, forms: Callable[[dict[str, Any]], Forms]) -> dict[str, Any]:
    """What a file is about, once it has the names of all columns; otherwise as `load_arrays`."""
    with _reading(path) as file:
        return _about(file, forms)[0]


@contextmanager
def _reading(path: Path) -> Iterator[Any]:
    """A file of arrays; whatever is wrong with it makes it a damaged one."""
    try:
        if path.is_fifo() or path.is_socket() or path.is_char_device():
            raise _Unlike("it is no file, and to read it would not end")
        with path.open("rb") as whole, np.load(whole, allow_pickle=False) as file:
            yield file
    except FileNotFoundError:
        raise
    except IsADirectoryError as error:
        raise DamagedRecords(f"{path} is a folder where the file of a run belongs") from error
    except Exception as error:
        why = f": {error}" if isinstance(error, _Unlike) else ""
        why = f": {error.strerror}" if isinstance(error, OSError) and error.strerror else why
        raise DamagedRecords(f"{path} is damaged, or not a run{why}") from error


def _about(file: Any, forms: Callable[[dict[str, Any]], Forms]) -> tuple[dict[str, Any], Forms]:
    """What the file is about, and the forms of its tables, whose columns it has."""
    about = json.loads(str(_array(file, ABOUT)))
    try:
        expected = forms(about)
    except ValueError as error:
        raise _Unlike(str(error)) from error
    names = {f"{table}/{name}" for table, form in expected.items() for name, *_ in form.fields}
    names |= {ABOUT, CHECKSUM}
    for name in sorted(names - {CHECKSUM} - set(file.files)):
        raise _Unlike(f"there is no {name} in it")
    for name in sorted(set(file.files) - names):
        raise _Unlike(f"{name} is in it, which is nothing of a run")
    if len(set(file.files)) < len(file.files):
        raise _Unlike("something is in it twice")
    return about, expected


def _array(file: Any, name: str) -> Column:
    array = file[name]
    if not isinstance(array, np.ndarray):  # a member without the header of an array
        raise _Unlike(f"{name} is no array")
    return array


def _check(table: str, columns: Mapping[str, Column], form: Form) -> None:
    """Every column has its type and its shape, and all have as many rows."""
    counts = {len(column) for column in columns.values() if column.ndim}
    rows = max(counts, default=0)
    if rows not in form.rows:
        raise _Unlike(f"there are {rows} rows of {table}")
    expected: Mapping[str, Any] = np.dtype(form.fields).fields or {}
    for name, (kind, *_) in expected.items():
        found = columns[name]
        if (found.dtype, found.shape) != (kind.base, (rows, *kind.shape)):
            raise _Unlike(
                f"{table}/{name} holds {found.dtype} of shape {found.shape}, and"
                f" {kind.base} of shape {(rows, *kind.shape)} is what belongs there"
            )


def _checksum(arrays: Mapping[str, Column]) -> str:
    """SHA-256 of the names, types, shapes and content of arrays."""
    hashed = sha256()
    for name in sorted(arrays):
        array = arrays[name]
        hashed.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        hashed.update(array.tobytes())
    return hashed.hexdigest()

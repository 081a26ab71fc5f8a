"""The published data in `book/published`: tables, arrays, and one manifest that describes them.

A name has a table, `NAME.csv`, and may have arrays, `NAME.npz`. `manifest.json` has for each name
the hashes of its files, the commit that registered questions and settings before the first row, and
the batches in which rows were made: date, machine, versions, epochs, and counts of rows.

Floats are read to the last digit. A cell with a list is JSON; a text column has no missing cells.
"""

import io
import json
import os
from collections.abc import Collection, Iterable, Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from filelock import FileLock

import nmpcrl
from nmpcrl.study.files import write_file, write_json
from nmpcrl.study.provenance import EPOCHS, hash_of
from nmpcrl.study.refusal import Refusal

MANIFEST = "manifest.json"
TEXTS = dict.fromkeys(("part", "arm", "place"), str)  # names of rows, even if they are numbers
SEAL = "hash of all the rest"
CHECKOUT = "`git checkout -- book/published` restores it"
ELSEWHERE = (
    "it comes with the project's repository and not with an installed package: set"
    " NMPCRL_PUBLISHED to its folder book/published"
)

Arrays = dict[str, npt.NDArray[Any]]
Batch = Mapping[str, Any]


class Damaged(Refusal):
    """A published file is missing, or is not the file that was written."""


class Unpublishable(Refusal):
    """Rows cannot be added to a published table."""


def folder() -> Path:
    """The folder of the published data: the project's, or the environment's NMPCRL_PUBLISHED."""
    beside = Path(nmpcrl.__file__).parent.parent / "book" / "published"
    return Path(os.environ.get("NMPCRL_PUBLISHED") or beside)


def read(name: str, where: Path | None = None) -> pd.DataFrame:
    """A published table; `Damaged` if its file is missing, or is not the one that was written."""
    return _table(where or folder(), name).copy()


def arrays(name: str, where: Path | None = None) -> Arrays:
    """The published arrays of a name; `Damaged` as for `read`."""
    return dict(_arrays(where or folder(), name))


def about(name: str, where: Path | None = None) -> dict[str, Any]:
    """The entry of a name in the manifest; empty if nothing is published."""
    return dict(_manifest(where or folder()).get(name, {}))


def counts(batch: Batch) -> dict[str, int]:
    """The number of rows of each part that a batch added; empty if the manifest has none."""
    return {**batch.get("rows", {}), **batch.get("runs", {})}


def batch_of(entry: Mapping[str, Any], part: str = "") -> Batch:
    """The last batch in an entry of the manifest that counts a part, else the first one, if any."""
    batches = entry.get("batches", [])
    found: list[Batch] = [one for one in batches if part in counts(one)] or batches[:1]
    return found[-1] if found else {}


def epochs(entry: Mapping[str, Any], part: str = "") -> dict[str, int]:
    """The epochs of a part's rows, 1 where its batch has none; empty if nothing is published."""
    batch = batch_of(entry, part)
    return {**dict.fromkeys(EPOCHS, 1), **batch.get("epochs", {})} if batch else {}


def is_current(
    name: str, part: str = "", where: Path | None = None, present: Mapping[str, int] = EPOCHS
) -> bool:
    """Whether the published rows of a part are of the present epochs."""
    return epochs(about(name, where), part) == present


def without(batches: Iterable[Batch], parts: Collection[str]) -> list[dict[str, Any]]:
    """The batches without these parts; a batch that counts no other part is dropped."""
    kept = []
    for batch in batches:
        left = {part: n for part, n in counts(batch).items() if part not in parts}
        if left:
            kept.append({**batch, "runs" if "runs" in batch else "rows": left})
        elif not counts(batch):
            kept.append({**batch})
    return kept


def write(
    name: str,
    table: pd.DataFrame,
    arrays: Mapping[str, npt.NDArray[Any]] | None = None,
    *,
    batch: Batch,
    registered: str | None = None,
    earlier: Iterable[Batch] | None = None,
    where: Path | None = None,
) -> Path:
    """Write a whole table and its arrays, and describe them in the manifest; the table's path.

    Args:
        name: of the files, without a suffix.
        table: all rows, the rows of earlier batches included.
        arrays: all arrays.
        batch: `provenance.made_here()`, and counts of the new rows.
        registered: the commit of questions and settings; by default the published rows'.
        earlier: batches whose rows stay; by default all. A batch without counts is dropped where
            the others count every row.
        where: the folder, by default the project's.
    """
    place = where or folder()
    place.mkdir(parents=True, exist_ok=True)
    with FileLock(place / ".lock"):
        known, files = _manifest(place), [place / f"{name}.csv"]
        if name not in known and files[0].exists():
            raise Unpublishable(f"{files[0]} is there, and not in {MANIFEST}: restore that")
        write_file(files[0], lambda file: file.write(_csv(table)))
        if arrays:
            files.append(place / f"{name}.npz")
            write_file(files[1], lambda file: np.savez_compressed(file, **dict(arrays)))  # type: ignore[arg-type]
        old = known.get(name, {})
        batches = [*(old.get("batches", ()) if earlier is None else earlier), dict(batch)]
        if sum(sum(counts(one).values()) for one in batches) == len(table):
            batches = [one for one in batches if counts(one)]
        entry = {
            **old,
            "files": {file.name: sha256(file.read_bytes()).hexdigest() for file in files},
            "batches": batches,
            "registered": old.get("registered", "") if registered is None else registered,
        }
        entries = {**known, name: entry}
        write_json(place / MANIFEST, {**entries, SEAL: hash_of(entries)}, indent=1)
        for each in (_manifest, _table, _arrays):
            each.cache_clear()
    return files[0]


@cache
def _manifest(place: Path) -> dict[str, Any]:
    path = place / MANIFEST
    if not path.exists():
        return {}
    try:
        entries: dict[str, Any] = json.loads(path.read_text("utf-8"))
        if entries.pop(SEAL) != hash_of(entries):
            raise ValueError("it is not the file that was written")
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise Damaged(f"{path} is damaged ({error}); {_restore(place)}") from error
    return entries


def _content(place: Path, name: str, suffix: str) -> bytes:
    """The bytes of a published file, if they are those that were written."""
    path = place / f"{name}{suffix}"
    known = _manifest(place).get(name, {}).get("files", {})
    if path.name not in known:
        write = "`nmpcrl investigate FILE.py --publish` writes it"
        raise Damaged(f"nothing is published in {place} as {path.name}; {_restore(place, write)}")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise Damaged(f"{path} cannot be read ({error.strerror}); {_restore(place)}") from error
    if sha256(content).hexdigest() != known[path.name]:
        raise Damaged(f"{path} is not the file that was published; {_restore(place)}")
    return content


@cache
def _table(place: Path, name: str) -> pd.DataFrame:
    return _of_csv(_content(place, name, ".csv"))


@cache
def _arrays(place: Path, name: str) -> Arrays:
    with np.load(io.BytesIO(_content(place, name, ".npz")), allow_pickle=False) as file:
        return {key: file[key] for key in file.files}


def _csv(table: pd.DataFrame) -> bytes:
    """A table as text, with lists as JSON."""
    plain = table.copy()
    for column in (name for name, kind in plain.dtypes.items() if kind.kind == "O"):
        plain[column] = [
            json.dumps(one) if isinstance(one, list | tuple) else one for one in plain[column]
        ]
    return bytes(plain.to_csv(index=False), "utf-8")


def _of_csv(content: bytes) -> pd.DataFrame:
    """The table that `_csv` was given."""
    table = pd.read_csv(io.BytesIO(content), dtype=TEXTS)
    for column in table.select_dtypes("str"):
        texts = table[column].fillna("")
        lists = len(texts) > 0 and texts.str.startswith("[").all()
        table[column] = [json.loads(one) for one in texts] if lists else texts
    return table


def _restore(place: Path, own: str = "restore it") -> str:
    """How to get the published data back: a reader's `own`, a checkout's, and elsewhere."""
    if place != folder():
        return own
    checkout = (Path(nmpcrl.__file__).parents[1] / ".git").exists()
    return CHECKOUT if checkout else ELSEWHERE

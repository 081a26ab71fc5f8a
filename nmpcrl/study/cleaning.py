"""Files in the folder of runs that are not needed: found by name, and only in that folder."""

import json
import re
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nmpcrl.study.experiment import Experiment
from nmpcrl.study.provenance import is_accepted, key, locked_hash
from nmpcrl.study.storage.archive import ABOUT

RUN = re.compile(r"[A-Za-z]+-\w+-[a-z]+-seed\d+-\d+ep-[0-9a-f]{10}")  # what a run's file is called
HALF = re.compile(r"\.half-.*\.tmp")
DAMAGED = re.compile(rf"{RUN.pattern}\.damaged\d*")
NOTE = re.compile(rf"{RUN.pattern}\.failed\.json")
PICTURE = re.compile(rf"{RUN.pattern}\.(svg|png)")
OLD = 3600.0  # age [s] beyond which nobody is still filling a half written file
KINDS = {  # of files that are not needed; runs are deleted only if that is asked for
    "damaged": "damaged files that were set aside",
    "half": "unfinished files of killed processes",
    "failed": "reasons why runs failed; the next study trains them again",
    "old": "runs of other code or other versions of libraries",
    "pictures": "pages that `nmpcrl show` can draw again",
    "runs": "finished runs",
}

Names = Mapping[Path, Callable[[Experiment], Path]]  # the file of an experiment, by folder


@dataclass(frozen=True)
class Leftover:
    """A file that can go."""

    path: Path
    kind: str  # of `KINDS`
    bytes: int


def leftovers(folders: Names) -> list[Leftover]:
    """What can go from some folders; whatever is not known by its name stays, and so do links."""
    found = []
    for folder, file_of in folders.items():
        for path in sorted(folder.iterdir()) if _is_own(folder) else ():
            if path.is_file() and not path.is_symlink():
                kind = _kind(path, file_of)
                found += [Leftover(path, kind, path.stat().st_size)] if kind else []
    return found


def remove(files: list[Leftover]) -> Iterator[Leftover]:
    """Delete what `leftovers` found; each file as it is gone.

    Raises:
        OSError: one cannot be deleted; the others before it are.
    """
    for one in files:
        if not one.path.is_symlink():
            one.path.unlink(missing_ok=True)
            yield one


def _is_own(folder: Path) -> bool:
    """Whether it is a folder; that of the runs may be a link, for the user named it."""
    inner = folder.name == "summaries"
    return folder.is_dir() and not (inner and folder.is_symlink())


def _kind(path: Path, file_of: Callable[[Experiment], Path]) -> str:
    """Why a file can go; "" if it cannot."""
    name = path.name
    if DAMAGED.fullmatch(name):
        return "damaged"
    if HALF.fullmatch(name):
        return "half" if time.time() - path.stat().st_mtime > OLD else ""
    if NOTE.fullmatch(name):
        return "failed"
    if PICTURE.fullmatch(name):
        return "pictures"
    if path.suffix == ".npz" and RUN.fullmatch(path.stem):
        return _kind_of_run(path, file_of)
    return ""


def _kind_of_run(path: Path, file_of: Callable[[Experiment], Path]) -> str:
    """Whether this code would look for the run; one that cannot be read now may yet be whole.

    A run of this code that somebody gave the name of another one stays.
    """
    try:
        with path.open("rb") as whole, np.load(whole, allow_pickle=False) as file:
            about = json.loads(str(file[ABOUT]))
            fields, facts = dict(about["experiment"]), dict(about["facts"])
    except Exception:
        return ""
    try:
        experiment = Experiment(**fields)
    except (TypeError, ValueError):  # fields that this code does not know
        return "old"
    own = file_of(experiment)
    if own.name == path.name:
        return "runs" if is_accepted(facts.get("sources", locked_hash())) else "old"
    parts, others = own.stem.rpartition("-"), path.stem.rpartition("-")
    renamed = parts[0] != others[0] or key(experiment).startswith(parts[2])
    return "" if renamed and facts.get("key") == key(experiment) else "old"

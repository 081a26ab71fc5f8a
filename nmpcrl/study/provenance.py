"""What the numbers of a stored run depend on, and how a run of other code is noticed.

A run's *key* is a hash of

- the fields of its experiment that its learner reads and that differ from `ORIGINAL`, resolved: the
  centres of the obstacles in place of the letter of the layout;
- the versions of the libraries that bear on its numbers;
- the epoch of each room whose code does, a number in `EPOCHS` that is raised by hand.

A new field, layout or metric changes no key, and neither does a file that is moved or renamed. Code
has no part in a key. Instead `sources.lock.json` has a hash of every file of `FILES`. Where a file
differs from the lock, a test fails and every command that reads a run warns, until either the epoch
of its room is raised, so that all runs are trained anew, or `nmpcrl verify --relock` has shown with
fresh runs that no bit has changed.

A stored run names the sources that made it. It is read if these are the present ones, those of the
lock, or those of an earlier lock of the same epochs. A run of an edit in between is trained again.
"""

import ast
import hashlib
import json
import math
import os
import platform
import sys
import threading
from collections import Counter
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, TypedDict

from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.machine import Fingerprint, fingerprint
from nmpcrl.study.trial import Trial

# Raised by hand where an edit of the room changes a number; then every run is trained anew.
EPOCHS = {"control": 1, "learning": 1, "study": 1, "analysis": 1}
RUN_ROOMS = ("control", "learning", "study")  # whose code bears on a run
SUMMARY_ROOMS = (*RUN_ROOMS, "analysis")  # and on its summary

LIBRARIES = ("casadi", "numba", "numpy")  # of every run; also torch, where a network learns

# A field is left out of the key where it has this value, which it had when it became a field. New
# fields are added with the value that all runs before them had; an entry never changes, even if the
# default of the field does.
ORIGINAL: dict[str, Any] = {
    "learner": "ES",
    "seed": 0,
    "episodes": 300,
    "obstacles": ((0.5, 2.2), (3.0, 0.5), (5.5, 2.8), (7.0, 0.3)),
    "decay": "step",
    "decay_rate": 0.99,
    "alpha": 1e-7,
    "beta": 1e-8,
    "zeta": 1e-2,
    "gated": True,
    "clipped": True,
    "constrained": False,
    "network": "plain",
    "box": "hard",
    "ties_active": False,
    "curvature": True,
    "projected": True,
    "beta_tdc": 1.5e-7,
    "theta": (1.0, 1.0, 0.05, 0.05, 0.05, 1.0, 1.0, 0.1, 0.001),
    "steps": 130,
    "start": (-2.5, 1.5, 0.0),
    "target": (8.5, 2.0, math.pi / 2),
    "horizon": 10,
    "solver": "riccati",
    "tolerance": 1e-8,
    "evaluate_every": 10,
}

FILES = (  # whose code bears on the numbers of runs, summaries and searches
    *("control/**/*.py", "learning/**/*.py"),
    *(f"study/{name}.py" for name in ("experiment", "geometry", "learners", "paper", "parameters")),
    *(f"study/{name}.py" for name in ("records", "run", "setup", "trial")),
    *(f"analysis/{name}.py" for name in ("imitation", "metrics", "rows", "search", "summary")),
)
OTHER_HOSTS = (  # not among them: compiled for browsers and hosts where no stored run is made
    *("control/browser.py", "control/codegen/browser/", "learning/browser.py"),
    *("control/solvers/charge.py", "control/solvers/entries.py", "learning/rules.py"),
)
ROOT = Path(__file__).parent.parent
LOCK = Path(__file__).with_name("sources.lock.json")
WARNED = "NMPCRL_WARNED"  # set in the environment once the warning has been given
PARSING = threading.Lock()  # Python 3.11 fails where two threads parse at once


class Provenance(TypedDict):
    """Where a run was made, and what its numbers depend on."""

    versions: dict[str, str]  # of `environment`
    machine: Fingerprint
    key: str
    sources: str  # `sources_hash`


def before() -> dict[str, Any]:
    """The fields of an experiment but the layout, with the values of runs before each was added."""
    return {name: value for name, value in ORIGINAL.items() if name != "obstacles"}


def key(experiment: Experiment | Trial) -> str:
    """A hash of all that the run's numbers depend on."""
    return hash_of([identity(experiment), versions(experiment), epochs(RUN_ROOMS)])


def summary_key(experiment: Experiment) -> str:
    """A hash of all that the numbers of the run's summary depend on."""
    return hash_of([identity(experiment), versions(experiment), epochs()])


def identity(experiment: Experiment | Trial) -> dict[str, Any]:
    """The fields that name a run, resolved, without those that have their `ORIGINAL` value."""
    if isinstance(experiment, Trial):
        return experiment.identity
    fields = resolved(experiment)
    return {name: value for name, value in fields.items() if value != ORIGINAL[name]}


def resolved(experiment: Experiment) -> dict[str, Any]:
    """The fields as its learner reads them, with the centres of the obstacles for the layout."""
    fields = dict(vars(experiment.canonical))
    return {"obstacles": paper.centres_of(fields.pop("layout"))} | fields


def versions(experiment: Experiment | Trial | None = None) -> dict[str, str]:
    """The versions of the libraries that bear on a run, or on any run.

    A build's suffix after "+" is left out: the code is the same.
    """
    learns = not isinstance(experiment, Experiment) or LEARNERS[experiment.learner].network
    names = (*LIBRARIES, "torch") if learns else LIBRARIES
    return {name: installed(name).partition("+")[0] for name in names}


def environment() -> dict[str, str]:
    """The versions that must be equal, beside key and machine, for the same bits."""
    libraries = {name: installed(name) for name in (*LIBRARIES, "torch")}
    return {"python": platform.python_version(), **libraries}


def provenance(experiment: Experiment | Trial) -> Provenance:
    """Versions, machine, key and source hash, stored with a run."""
    return {
        "versions": environment(),
        "machine": fingerprint(),
        "key": key(experiment),
        "sources": sources_hash(),
    }


def made_here() -> dict[str, Any]:
    """Date, epochs, versions and machine, published with runs."""
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "epochs": EPOCHS,
        "versions": environment(),
        "machine": fingerprint(),
    }


def signature() -> str:
    """Equal in all processes that make the same numbers of the same experiments."""
    return hash_of([versions(), EPOCHS, sources_hash()])


def epochs(rooms: Iterable[str] = SUMMARY_ROOMS) -> dict[str, int]:
    """The epochs of rooms; by default of those that bear on summaries and searches."""
    return {room: EPOCHS[room] for room in rooms}


@cache
def installed(library: str) -> str:
    """The version of a library, or "absent"."""
    try:
        return version(library)
    except PackageNotFoundError:  # only numba may be missing: fatrop then solves
        return "absent"


def hash_of(depends: Any) -> str:
    """A hash of anything that JSON can hold."""
    return hashlib.sha256(json.dumps(depends, sort_keys=True).encode()).hexdigest()


def sources(root: Path = ROOT) -> dict[str, str]:
    """A hash of the code of each file of `FILES` by path; a file without code is left out."""
    found = {path.relative_to(root).as_posix(): path for one in FILES for path in root.glob(one)}
    with PARSING:
        codes = {name: code(path.read_text("utf-8")) for name, path in sorted(found.items())}
    return {
        name: hashlib.sha256(text.encode()).hexdigest()
        for name, text in codes.items()
        if text and not name.startswith(OTHER_HOSTS)
    }


@cache
def sources_hash() -> str:
    """One hash of all `sources`, wherever the files are."""
    return hash_of(sorted(sources().values()))


def room_hash(room: str) -> str:
    """One hash of the code of a whole room."""
    return hash_of([code(path.read_text("utf-8")) for path in sorted((ROOT / room).rglob("*.py"))])


def locked() -> dict[str, str]:
    """The `sources` of the lock."""
    return dict(_lock()["sources"])


def locked_hash() -> str:
    """The `sources_hash` of the lock."""
    return hash_of(sorted(locked().values()))


def locks() -> tuple[str, ...]:
    """The hashes of the lock and of the earlier locks of these epochs."""
    lock = _lock()
    return (locked_hash(), *(lock["earlier"] if lock["epochs"] == EPOCHS else ()))


def is_accepted(made: str | None) -> bool:
    """Whether the sources with this `sources_hash` make the same numbers as the present ones.

    A run that was never stored names no sources, and is accepted.
    """
    return made in (None, sources_hash(), *locks())


def changed(now: Mapping[str, str], lock: Mapping[str, str]) -> list[str]:
    """The files whose code is in one of two `sources` alone; a moved file is not among them."""
    new, old = Counter(now.values()), Counter(lock.values())
    added = {path for path, found in now.items() if new[found] > old[found]}
    return sorted(added | {path for path, found in lock.items() if old[found] > new[found]})


def relock() -> Path:
    """Write the lock; the one before becomes an earlier one, unless an epoch was raised."""
    same = LOCK.exists() and _lock()["epochs"] == EPOCHS
    earlier = list(dict.fromkeys([*locks()[1:], locked_hash()])) if same else []
    lock = {"epochs": EPOCHS, "earlier": earlier, "sources": sources()}
    LOCK.write_text(json.dumps(lock, indent=1) + "\n", "utf-8")
    return LOCK


def _lock() -> dict[str, Any]:
    return dict(json.loads(LOCK.read_text("utf-8")))


@cache
def warn_of_changes() -> None:
    """Warn that stored runs may be of other code; once, also for the processes started after it."""
    if os.environ.get(WARNED):
        return
    if files := changed(sources(), locked()):
        os.environ[WARNED] = "1"
        print(
            f"{', '.join(files)}: changed since the stored runs were trained;"
            " `nmpcrl verify --relock` shows whether the numbers stay the same; if not, raise the"
            " epoch of the room in nmpcrl/study/provenance.py",
            file=sys.stderr,
        )


def code(text: str) -> str:
    """A module's syntax tree as text, without comments, docstrings and types of functions.

    An import counts if it renames or is used; of a module of this package the last name counts, so
    that a file can be moved. The text is the same on every version of Python.
    """
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg):
            node.annotation = None
    return "\n".join([*sorted(_imports(tree)), *map(_shape, filter(_counts, tree.body))])


def _imports(tree: ast.AST) -> set[str]:
    """The imported names that are used or renamed, each with the module that it comes from."""
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = getattr(node, "module", None) or ""
            place = module.rpartition(".")[2] if module.startswith("nmpcrl.") else module
            for one in node.names:
                name = one.asname or one.name.partition(".")[0]
                if name in used or one.asname not in (None, one.name):
                    found.add(f"from {place} import {one.name} as {name}")
    return found


def _counts(node: Any) -> bool:
    """Whether a statement is more than an import, a docstring or the list of exports."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return False
    exports = isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__"
    return not exports and not isinstance(node, ast.Import | ast.ImportFrom)


def _shape(node: Any) -> str:
    """`ast.dump`, but the same text on every version of Python."""
    if isinstance(node, list):
        return f"[{', '.join(_shape(one) for one in node if _counts(one))}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = (
        f"{name}={_shape(value)}"
        for name, value in ast.iter_fields(node)
        if name not in ("ctx", "kind", "type_comment", "type_params") and value not in (None, [])
    )
    return f"{type(node).__name__}({', '.join(fields)})"

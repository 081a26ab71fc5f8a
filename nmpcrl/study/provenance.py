"""What the numbers of a stored run depend on, and how a stored run of old code is noticed.

A run's *key* is a hash of what names its numbers:

- the fields of its experiment that its learner reads and that differ from `ORIGINAL`, in resolved
  form: the centres of the obstacles and not the letter of the layout;
- the versions of the libraries that touch its numbers;
- the epoch of each room whose code does, a number in `EPOCHS` that is raised by hand.

So a new field, layout or metric, a moved or a renamed file leaves every key as it is. Source code
has no part in a key. Instead, `sources.lock.json` holds a hash of every file that bears on numbers.
Where one differs from the lock, a test fails and every command that reads a run warns, until
either the epoch of its room is raised, so that all runs are trained anew, or
`nmpcrl verify --relock` has shown with fresh runs that no bit has changed.

A stored run says which sources made it. It is read if these are today's, the lock's, or those of an
earlier lock of the same epochs; what was trained in the midst of an edit is trained again after it.
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
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, TypedDict

from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.storage.atomic import write_json
from nmpcrl.study.storage.machine import Fingerprint, fingerprint
from nmpcrl.study.trial import Trial

# Raised by hand where an edit of the room changes a number; then every run is trained anew.
EPOCHS = {"control": 1, "learning": 1, "study": 1, "analysis": 1}
RUN_ROOMS = ("control", "learning", "study")  # whose code bears on a run
SUMMARY_ROOMS = (*RUN_ROOMS, "analysis")  # and on its summary

LIBRARIES = ("casadi", "numba", "numpy")  # of every run; torch besides, where a network learns

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

WARNED = "NMPCRL_WARNED"  # set in the environment once the warning has been given
ROOT = Path(__file__).parent.parent
LOCK = Path(__file__).with_name("sources.lock.json")
WHOLE_ROOMS = ("control", "learning")  # every file of which counts, but
ELSEWHERE = (  # those that are compiled for other hosts, where no stored run is made
    "control/browser.py",
    "control/codegen/browser/",
    "control/solvers/charge.py",
    "control/solvers/entries.py",
    "learning/browser.py",
    "learning/rules.py",
)
ENTRIES = (
    "study/run.py",
    "analysis/summary.py",
    "analysis/rows.py",
)  # which count with all that they import
ALONE = ("analysis/policy_search.py",)  # which count without
UNCOUNTED = ("__future__", "collections.abc", "typing")  # modules that no number comes from
PARSING = threading.Lock()  # Python 3.11 fails where two threads parse at once


class Provenance(TypedDict):
    """Where a run was made, and what its numbers depend on."""

    versions: dict[str, str]  # as `environment` has them
    machine: Fingerprint
    key: str
    sources: str  # `sources_hash`


def before() -> dict[str, Any]:
    """The fields of an experiment but the layout, with what all runs had before each was one."""
    return {name: value for name, value in ORIGINAL.items() if name != "obstacles"}


def key(experiment: Experiment | Trial) -> str:
    """A hash of all that the run's numbers depend on."""
    return hash_of([identity(experiment), versions(experiment), _epochs(RUN_ROOMS)])


def summary_key(experiment: Experiment) -> str:
    """A hash of all that the numbers of the run's summary depend on."""
    return hash_of([identity(experiment), versions(experiment), _epochs(SUMMARY_ROOMS)])


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
    """The versions of the libraries that touch the numbers of a run, or of any run.

    What a build adds after "+" is left out: it is the same code.
    """
    learns = not isinstance(experiment, Experiment) or LEARNERS[experiment.learner].network
    names = (*LIBRARIES, "torch") if learns else LIBRARIES
    return {name: installed(name).partition("+")[0] for name in names}


def environment() -> dict[str, str]:
    """All that must be the same, beside key and machine, for the same bits."""
    libraries = {name: installed(name) for name in (*LIBRARIES, "torch")}
    return {"python": platform.python_version(), **libraries}


def provenance(experiment: Experiment | Trial) -> Provenance:
    """That of a run that is made here and now."""
    return {
        "versions": environment(),
        "machine": fingerprint(),
        "key": key(experiment),
        "sources": sources_hash(),
    }


def signature() -> str:
    """The same for all who would make the same numbers of the same experiments."""
    return hash_of([versions(), EPOCHS, sources_hash()])


def epochs() -> dict[str, int]:
    """Those of the rooms that bear on summaries, and on what is searched for."""
    return _epochs(SUMMARY_ROOMS)


@cache
def installed(library: str) -> str:
    """The version of a library; "absent" if it is not there."""
    try:
        return version(library)
    except PackageNotFoundError:  # only numba may be missing: fatrop then solves
        return "absent"


def _epochs(rooms: Iterable[str]) -> dict[str, int]:
    return {room: EPOCHS[room] for room in rooms}


def hash_of(depends: Any) -> str:
    """A hash of anything that JSON can hold."""
    return hashlib.sha256(json.dumps(depends, sort_keys=True).encode()).hexdigest()


def sources(root: Path = ROOT) -> dict[str, str]:
    """A hash of the code of each file that bears on the numbers of runs and summaries, by path."""
    with PARSING:
        paths = {path for room in WHOLE_ROOMS for path in _counted(root, room)}
        paths |= _reached(root, [root / entry for entry in ENTRIES])
        paths |= {root / entry for entry in ALONE}
        codes = {path: code(path.read_text("utf-8")) for path in sorted(paths)}
    return {
        path.relative_to(root).as_posix(): hashlib.sha256(text.encode()).hexdigest()
        for path, text in codes.items()
        if text
    }


def _counted(root: Path, room: str) -> list[Path]:
    """The files of a room that bear on numbers."""
    paths = (root / room).rglob("*.py")
    return [path for path in paths if not path.relative_to(root).as_posix().startswith(ELSEWHERE)]


@cache
def sources_hash() -> str:
    """One hash of all `sources`, wherever they lie."""
    return hash_of(sorted(sources().values()))


def room_hash(room: str) -> str:
    """One hash of the code of a whole room."""
    return hash_of([code(path.read_text("utf-8")) for path in sorted((ROOT / room).rglob("*.py"))])


def locked() -> dict[str, str]:
    """`sources` as the lock has them."""
    return dict(json.loads(LOCK.read_text("utf-8"))["sources"])


def locked_hash() -> str:
    """`sources_hash` as it was when the lock was written."""
    return hash_of(sorted(locked().values()))


def is_accepted(made: str) -> bool:
    """Whether the sources with this `sources_hash` make the numbers that these here make."""
    return made in (sources_hash(), *locks())


def locks() -> tuple[str, ...]:
    """The hashes of the lock and of the earlier locks of these epochs."""
    return (locked_hash(), *_earlier())


def _earlier() -> list[str]:
    """The hashes of the earlier locks of these epochs."""
    lock = json.loads(LOCK.read_text("utf-8"))
    return list(lock.get("earlier", ())) if lock["epochs"] == EPOCHS else []


def changed(now: Mapping[str, str], lock: Mapping[str, str]) -> list[str]:
    """The files whose code is not what the lock has, moved and renamed ones left out."""
    new, old = Counter(now.values()), Counter(lock.values())
    other = {path for path, found in now.items() if new[found] > old[found]}
    gone = {path for path, found in lock.items() if old[found] > new[found]}
    return sorted(other | gone)


def relock() -> Path:
    """Write the lock anew; the one before is among the earlier ones, unless an epoch was raised."""
    lock = json.loads(LOCK.read_text("utf-8")) if LOCK.exists() else {}
    same = lock.get("epochs") == EPOCHS
    earlier = list(dict.fromkeys([*_earlier(), locked_hash()])) if same else []
    write_json(LOCK, {"epochs": EPOCHS, "earlier": earlier, "sources": sources()}, indent=1)
    return LOCK


@cache
def warn_of_changes() -> None:
    """Say once, on standard error, that stored runs may be of other code than this.

    Processes that are started after that keep quiet: a chapter that the driver executes, a worker.
    """
    if os.environ.get(WARNED):
        return
    files = changed(sources(), locked())
    if files:
        os.environ[WARNED] = "1"
        print(
            f"{', '.join(files)}: changed since the stored runs were trained;"
            " `nmpcrl verify --relock` shows whether the numbers stay the same; if not, raise the"
            " epoch of the room in nmpcrl/study/provenance.py",
            file=sys.stderr,
        )


def code(text: str) -> str:
    """A module's syntax tree as text, without comments, docstrings and functions' types.

    Of its imports it has what can change a number: of what is used in it, the name of the module
    that it comes from and its own. Of modules of ours that is the last part alone, so that they can
    be moved. Empty if nothing but imports is in it, which rename nothing of ours. The same text on
    every version of Python that we know.
    """
    tree = ast.parse(text)
    renamed, used = _imports(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg):
            node.annotation = None
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            documented = ast.get_docstring(node) is not None
            node.body = [one for one in node.body[documented:] if not _is_bookkeeping(one)]
    body = list(map(_shape, tree.body))
    return "\n".join([*renamed, *(used if body else ()), *body])


def _imports(tree: ast.AST) -> tuple[list[str], list[str]]:
    """What a module imports: ours under another name; and all that it uses, with where it is."""
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    renamed, used = set(), set()
    for node in ast.walk(tree):
        if not isinstance(node, ast.Import | ast.ImportFrom):
            continue
        module = (node.module or "") if isinstance(node, ast.ImportFrom) else ""
        own = module.split(".")[0] == "nmpcrl"
        for one in node.names:
            bound = one.asname or one.name.partition(".")[0]
            if own and bound != one.name:
                renamed.add(f"import {one.name} as {bound}")
            if bound in names and module not in UNCOUNTED:
                place = module.rpartition(".")[2] if own else module
                used.add(f"from {place} import {one.name} as {bound}")
    return sorted(renamed), sorted(used)


def _is_bookkeeping(node: ast.stmt) -> bool:
    """Whether a statement is an import, or names what a package exports."""
    exports = isinstance(node, ast.Assign) and any(
        isinstance(target, ast.Name) and target.id == "__all__" for target in node.targets
    )
    return exports or isinstance(node, ast.Import | ast.ImportFrom)


def _shape(node: Any) -> str:
    """`ast.dump`, whose text is not the same on every version of Python."""
    if isinstance(node, list):
        return f"[{', '.join(map(_shape, node))}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    kept = (
        f"{name}={_shape(value)}"
        for name, value in ast.iter_fields(node)
        if name not in ("ctx", "kind", "type_comment", "type_params") and value not in (None, [])
    )
    return f"{type(node).__name__}({', '.join(kept)})"


def _reached(root: Path, entries: Iterable[Path]) -> set[Path]:
    """The files of the package that some files import, directly or through others."""
    found: set[Path] = set()
    left = list(entries)
    while left:
        path = left.pop()
        if path not in found:
            found.add(path)
            left += _imported(root, path)
    return found


def _imported(root: Path, path: Path) -> Iterator[Path]:
    """The files that a file imports; what a package passes on is followed to where it is made."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "nmpcrl":
            for alias in node.names:
                yield from _defined(root, str(node.module), alias.name)


def _defined(root: Path, module: str, name: str) -> Iterator[Path]:
    """Where `from module import name` is defined."""
    place = root.joinpath(*module.split(".")[1:])
    if place.with_suffix(".py").is_file():
        yield place.with_suffix(".py")
    elif (place / f"{name}.py").is_file():
        yield place / f"{name}.py"
    elif (place / "__init__.py").is_file():
        for node in ast.parse((place / "__init__.py").read_text("utf-8")).body:
            if isinstance(node, ast.ImportFrom):
                for alias in node.names:
                    if (alias.asname or alias.name) == name and node.module != module:
                        yield from _defined(root, str(node.module), alias.name)

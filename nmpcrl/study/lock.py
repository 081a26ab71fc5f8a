"""The hashes of the code on which numbers depend, and the lock that they are compared with.

Where a file of `FILES` differs from `sources.lock.json`, a test fails and commands that read a run
warn, until `nmpcrl verify --relock` has shown with fresh runs that no bit has changed, or an epoch
of `provenance` is raised. A stored run names the hash of the sources that made it.
"""

import ast
import hashlib
import json
import os
import threading
from collections import Counter
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from nmpcrl.study.files import say
from nmpcrl.study.provenance import EPOCHS, hash_of

FILES = (  # whose code bears on numbers of runs, summaries and searches
    *("control/**/*.py", "learning/**/*.py"),
    *(f"study/{name}.py" for name in ("experiment", "geometry", "learners", "paper", "parameters")),
    *(f"study/{name}.py" for name in ("records", "run", "setup", "trial")),
    *(f"analysis/{name}.py" for name in ("imitation", "metrics", "rows", "search", "summary")),
)
OTHER_HOSTS = (  # of `FILES`, compiled for browsers and hosts where no stored run is made
    *("control/browser.py", "control/codegen/browser/", "learning/browser.py"),
    "control/solvers/entries.py",
)
ROOT = Path(__file__).parent.parent
LOCK = Path(__file__).with_name("sources.lock.json")
WARNED = "NMPCRL_WARNED"  # set in the environment once the warning has been given
PARSING = threading.Lock()  # Python 3.11 fails where two threads parse at once


def sources(root: Path = ROOT) -> dict[str, str]:
    """The hash of each file of `FILES` that has code, by path."""
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
    """One hash of all `sources`; a moved file does not change it."""
    return hash_of(sorted(sources().values()))


def locked() -> dict[str, Any]:
    """The content of the lock: epochs, `sources`, and the hashes of earlier locks."""
    return dict(json.loads(LOCK.read_text("utf-8")))


def locks() -> tuple[str, ...]:
    """The `sources_hash` of the lock and of the earlier locks of these epochs."""
    lock = locked()
    now = hash_of(sorted(lock["sources"].values()))
    return (now, *(lock["earlier"] if lock["epochs"] == EPOCHS else ()))


def is_accepted(made: str | None) -> bool:
    """Whether this is the hash of present or locked sources, or None, as of a run in memory."""
    return made in (None, sources_hash()) or made in locks()


def changed(now: Mapping[str, str], lock: Mapping[str, str]) -> list[str]:
    """The files whose code is in one of two `sources` only, without moved files."""
    new, old = Counter(now.values()), Counter(lock.values())
    added = {path for path, found in now.items() if new[found] > old[found]}
    return sorted(added | {path for path, found in lock.items() if old[found] > new[found]})


def relock() -> Path:
    """Write the lock; the old one becomes an earlier lock, unless an epoch was raised."""
    same = LOCK.exists() and locked()["epochs"] == EPOCHS
    earlier = list(dict.fromkeys([*locks()[1:], locks()[0]])) if same else []
    lock = {"epochs": EPOCHS, "earlier": earlier, "sources": sources()}
    LOCK.write_text(json.dumps(lock, indent=1) + "\n", "utf-8")
    return LOCK


@cache
def warn_of_changes() -> None:
    """Warn once, in this process and its children, that stored runs may be of other code."""
    if os.environ.get(WARNED):
        return
    if files := changed(sources(), locked()["sources"]):
        os.environ[WARNED] = "1"
        say(
            f"{', '.join(files)}: changed since the stored runs were trained;"
            " `nmpcrl verify --relock` shows whether the numbers stay the same; if not, raise the"
            " epoch of its package in nmpcrl/study/provenance.py"
        )


def code(text: str) -> str:
    """A module's syntax tree as text, without comments, docstrings and types of functions.

    Imports count if they are used or rename, by the last name of a module of this package, so that
    a file can be moved. The text is the same on every version of Python.
    """
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg):
            node.annotation = None
    return "\n".join([*sorted(_imports(tree)), *map(_shape, filter(_counts, tree.body))])


def _imports(tree: ast.AST) -> set[str]:
    """The imported names that are used or renamed, each with its module."""
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

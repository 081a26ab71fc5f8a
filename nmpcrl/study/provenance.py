"""Keys of stored runs: hashes of fields, versions of libraries and epochs.

A new field, layout or metric changes no key, nor does code, whose changes `lock` notices.
"""

import hashlib
import json
import platform
from dataclasses import fields
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.learners import LEARNERS
from nmpcrl.study.machine import fingerprint
from nmpcrl.study.trial import Trial

# By package; raised by hand where an edit changes a number, so that every run is trained anew. The
# first edition is of the first epochs; of the second is one solver for every problem, and one loop.
EPOCHS = {"control": 2, "learning": 2, "study": 1, "analysis": 1}
RUN_ROOMS = ("control", "learning", "study")  # whose code bears on a run; all, on its summary

LIBRARIES = ("casadi", "numba", "numpy")  # of every run; also torch, where a network learns

# A field is left out of the key where it has this value, which all runs had before it was a field:
# its default. If a default changes, its first value is written here, so that no key changes.
ORIGINAL: dict[str, Any] = {one.name: one.default for one in fields(Experiment)}
ORIGINAL["obstacles"] = paper.LAYOUTS[ORIGINAL.pop("layout")]


def key(experiment: Experiment | Trial) -> str:
    """A hash of all on which the numbers of a run depend."""
    epochs = {room: EPOCHS[room] for room in RUN_ROOMS}
    return hash_of([identity(experiment), versions(experiment), epochs])


def summary_key(experiment: Experiment) -> str:
    """A hash of all on which the numbers of a run's summary depend."""
    return hash_of([identity(experiment), versions(experiment), EPOCHS])


def identity(experiment: Experiment | Trial) -> dict[str, Any]:
    """The fields that name a run: those that its learner reads and that differ from `ORIGINAL`.

    The centres of the obstacles take the place of the layout.
    """
    if isinstance(experiment, Trial):
        return experiment.identity
    named = dict(vars(experiment.canonical))
    named = {"obstacles": paper.centres_of(named.pop("layout"))} | named
    return {name: value for name, value in named.items() if value != ORIGINAL[name]}


def versions(experiment: Experiment | Trial | None = None) -> dict[str, str]:
    """The versions of the libraries that bear on a run, or on any run, without a build's suffix."""
    learns = not isinstance(experiment, Experiment) or LEARNERS[experiment.learner].network
    names = (*LIBRARIES, "torch") if learns else LIBRARIES
    return {name: installed(name).partition("+")[0] for name in names}


def environment() -> dict[str, str]:
    """The versions on which the last bits of numbers depend."""
    libraries = {name: installed(name) for name in (*LIBRARIES, "torch")}
    return {"python": platform.python_version(), **libraries}


def made_here() -> dict[str, Any]:
    """Date, epochs, versions and machine, published with runs."""
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "epochs": EPOCHS,
        "versions": environment(),
        "machine": fingerprint(),
    }


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

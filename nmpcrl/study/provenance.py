"""Keys of stored runs: hashes of fields, versions of libraries and epochs.

A new field, layout or metric changes no key, nor does code, whose changes `lock` notices.
"""

import hashlib
import json
import math
import platform
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
    fields = dict(vars(experiment.canonical))
    fields = {"obstacles": paper.centres_of(fields.pop("layout"))} | fields
    return {name: value for name, value in fields.items() if value != ORIGINAL[name]}


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

"""A plant's controller as WebAssembly: the solver that trains every run, for any other host."""

from importlib.resources import files

import casadi as ca
import numpy as np

from nmpcrl.control.codegen import browser
from nmpcrl.control.codegen.source import source
from nmpcrl.control.plant import Plant
from nmpcrl.control.solvers import riccati, stages
from nmpcrl.control.solvers.charge import DISCS, LONGEST
from nmpcrl.control.task import Task

HEADER = '''"""The RL stage cost of a task, and inputs to start from."""

import math

import numpy as np
from numba import njit

DISCS, LONGEST = {discs}, {longest}
WARM_LIMIT, COLD_LIMIT = {warm}, {cold}
RANDOM_INPUTS = np.array({inputs})


@njit(error_model="numpy", forceinline=True)
'''


def module(plant: Plant, task: Task) -> bytes:
    """One WebAssembly module that solves Eq. (2), steps the plant and charges Eq. (20).

    Target, obstacles, box, horizon and discount are arguments of its functions, which
    `solvers.entries` describes; the plant and the rest of the task are compiled in. Made once, in
    about a minute, and kept with the machine code.

    Raises:
        CannotCompile: the plant or the task holds an operation that is not known.
        RuntimeError: numba is missing, or cannot compile this.
        CannotLink: they call more than the functions that every host has.
    """
    return browser.from_texts(texts(plant, task))


def texts(plant: Plant, task: Task) -> dict[str, str]:
    """What is compiled: the text of each module by its name."""
    here = files(riccati.__package__)
    return {
        **{name: riccati.TEXTS[name] for name in (*riccati.STAGES, "solve", "hessian_times")},
        "model": stages.write(plant),
        "charge": _charge(plant, task),
        "entries": here.joinpath("entries.py").read_text("utf-8"),
    }


def _charge(plant: Plant, task: Task) -> str:
    """The text of the module `charge`: the signatures are those of `solvers.charge`."""
    state, action = ca.SX.sym("state", plant.n), ca.SX.sym("action", plant.m)
    target, discs = ca.SX.sym("target", plant.n), ca.SX.sym("discs", DISCS, 3)
    cost = task.cost_of(state, action, target, tuple(ca.horzsplit(discs)))
    names = ["state", "action", "target", "discs"]
    function = ca.Function("charge", [state, action, target, discs], [cost], names, ["cost"])
    inputs = [riccati.random_inputs(plant, seed, LONGEST) for seed in range(riccati.PERTURBED)]
    header = HEADER.format(
        discs=DISCS,
        longest=LONGEST,
        warm=riccati.WARM_LIMIT,
        cold=riccati.COLD_LIMIT,
        inputs=np.array(inputs).tolist(),
    )
    return header + source(function)

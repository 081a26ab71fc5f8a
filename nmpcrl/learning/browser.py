"""The module with which a robot learns in a browser: solver, plant, cost and Algorithm 1."""

from importlib.resources import files

from nmpcrl.control import Plant, Problem, Task, browser
from nmpcrl.control.codegen.browser import from_texts

OWN = ("updates", "dense", "loop")
LEARN = '''"""What is called to learn: `loop` on pointers, as in `entries`."""

import numpy as np
from numba import carray, float32, float64, int32, int64, njit, types, uint64

from . import updates
from .dense import fit, follow, predict, remember
from .entries import COLD, address, places_in, unpacked
from .find import find
from .loop import COUNT, copy, episode, move, plain, start_in
from .model import NTHETA, NU, NX, transition
from .slopes import slopes
from .task import charge

HOW = 9  # numbers of a learner besides the bounds of theta
NONE = np.zeros(1)  # neither theta nor data is read by the model of a plant
NETWORK = (  # the arrays of `dense`, with the rate among them; length of an input, and capacity
    *map(types.CPointer, (float32, float32, int32, int64, uint64, float64)), float64,
    types.CPointer(int64), int32, int32,
)  # fmt: skip
steps = plain(episode)
td_error = njit(float64(float64, float64, float64, float64), error_model="numpy")(updates.td_error)


@plain
def step(state, action, later):
    transition(state, action, NONE, NONE, later)


@njit(
    int32(address, address, *NETWORK, address, address, address, address, int32, address, address),
    error_model="numpy",
)
def learn(
    problem, learner, weights, examples, order, counts, draw, scales, rate, sizes, inputs, capacity,
    state, theta, w, warm, cold, noise, row,
):  # fmt: skip
    """One step of Algorithm 1; returns 1, or 0 where a solve failed.

    `learner` holds rule, alpha, beta, bootstrap, whether theta is an input of the network, whether
    Q(s, a) is learned, the tolerance, the largest number of a state and of theta, and the least and
    the largest theta. `cold` says that an episode begins; `row` is one of `loop.episode`.
    """
    (given, others, drawn), (fixed, _, _) = unpacked(problem, 0), unpacked(problem, 1)
    stage, _, place, _, size = places_in(given, 0)
    how = carray(learner, HOW + 2 * NTHETA)
    next_input = NX + (stage if len(given[5]) > 2 else 0)  # where u_1 is, or u_0 if N is 1
    hidden = sizes[0]
    count = (inputs + hidden + 3) * hidden + 1
    net = (
        carray(weights, (4, count)), carray(examples, (capacity, inputs + 1)),
        carray(order, capacity), carray(counts, 2), carray(draw, 1), carray(scales, inputs + 1),
        rate, carray(sizes, 4),
    )
    state_, warm_, start = carray(state, NX), carray(warm, size), COLD
    if not cold:
        start = start_in(state_, warm_)
    return steps(
        find, slopes, step, charge, remember, fit, predict, follow,
        given, fixed, others, drawn, how[6], place, next_input, how[7],
        how[8], int(how[0]), how[1], how[2], how[HOW : HOW + NTHETA], how[HOW + NTHETA :],
        int(how[3]), net, net, (how[4] > 0, True, False, 1, 0, 0.0), how[5] > 0, True,
        start, 0, state_, carray(theta, NTHETA),
        carray(w, NTHETA), warm_, carray(noise, (1, NU)),
        carray(row, (1, COUNT + NX + NU + 3 * NTHETA)),
    )  # fmt: skip


@njit(
    int32(int32, int32, address, address, float64, address, address, float64, float64, float64),
    error_model="numpy",
)
def moved(rule, d, theta, w, delta, phi, phi_next, alpha, beta, gamma):
    """Move theta and w, in place, by a semi-gradient or by gradient TD."""
    there, w_, phi_ = carray(theta, d), carray(w, d), carray(phi, d)
    after = move(rule, there, w_, delta, phi_, carray(phi_next, d), phi_, alpha, beta, gamma)
    copy(after, there)
    return 0


EXPORTS = (learn, td_error, moved)
'''


def module(of: Plant | Problem, task: Task | None = None) -> bytes:
    """One WebAssembly module that solves, and with a task learns: `browser.texts` and `LEARN`.

    Made once, in about a minute, and kept with the machine code.

    Raises:
        CannotCompile: the plant or the task holds an operation that is not known.
        RuntimeError: numba cannot compile this, or it calls more than every host has.
    """
    learning = {}
    if task is not None:
        here = files(__package__)
        learning = {name: here.joinpath(f"{name}.py").read_text("utf-8") for name in OWN}
        learning["learn"] = LEARN
    return from_texts(browser.texts(of, task) | learning)

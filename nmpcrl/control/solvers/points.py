"""A solution's numbers, as what is called from outside Python holds them: z, lam and nu of `Ocp`.

N is the horizon, M the number of slacks a stage, and `fixed` whether u_0 is given.
"""

import numpy as np
from numba import njit

from .kernel import options
from .model import NU, NX

plain = njit(**options)


@plain
def lengths(N, M, fixed):
    """Of z and of lam."""
    return (N + 1) * (NX + M) + N * NU, (N + 1) * (NX + M) + fixed * NU


@plain
def carried(N, M, fixed, old_fixed, old):
    """The numbers of a solution as those of the same problem with u_0 fixed or free instead."""
    z, lam = lengths(N, M, fixed)
    _, old_lam = lengths(N, M, old_fixed)
    new = np.zeros(2 * z + lam)
    for k in range(z):
        new[k] = old[k]
        new[z + lam + k] = old[z + old_lam + k]
    for k in range(lam):  # the rows of a given u_0 follow those of x_0
        beyond = k >= 2 * NX
        if k < 2 * NX or k >= 2 * NX + fixed * NU:
            new[z + k] = old[z + k + ((old_fixed - fixed) * NU if beyond else 0)]
    return new


@plain
def equal(x, y):
    """Whether two vectors are the same, number by number."""
    for k in range(len(x)):  # noqa: SIM110  numba compiles no generators
        if x[k] != y[k]:
            return False
    return True

"""The derivative of a value and of a plan in all that a solve was given, backwards.

A number J = v V + sum w u of the value and the plan changes with p, the state, theta, a given
u_0 and the data, by v L_p + w' du/dp. The first term is the envelope theorem; the second is one
solve of the KKT system with w on its right, and not one for each entry of p: see `Sensitivity`.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from nmpcrl import Matrix, Vector
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.sensitivity import Sensitivity


@dataclass(frozen=True, eq=False)
class Gradient:
    """The derivatives of a number in what a solve was given."""

    state: Vector  #: in s, shape (n,)
    theta: Vector  #: shape (d,)
    action: Vector  #: in the u_0 that was given, shape (m,), or (0,) where it was free
    data: dict[str, NDArray[np.float64]]  #: by name, each of N + 1 stages, shape (N + 1, ...)


class Backward(Sensitivity):
    """`Sensitivity` of an OCP in all its parameters p in place of theta."""

    def __init__(self, ocp: Ocp) -> None:
        super().__init__(replace(ocp, theta=ocp.parameters))

    def gradient(self, z: Matrix, p: Matrix, lam: Matrix) -> Matrix:
        """dV/dp, L_p, a column a solution."""
        found: Matrix = self._value_and_gradient(z, p, lam)[1].full()
        return found

    def along(self, z: Matrix, p: Matrix, lam: Matrix, step: Matrix, weights: Matrix) -> Matrix:
        """w' dz/dp from the steps of z and lam that solve K step + w = 0: L_p along them.

        In a step, the multipliers of x_0 = s and of a given u_0 are 0: those are found here.
        """
        found: Matrix = self._along(z, p, lam, step, weights).full()
        return found

    @cached_property
    def _along(self) -> ca.Function:
        ocp = self._ocp
        step, w = (
            ca.SX.sym("step", z) for z in (ocp.lower.size + self._lam.numel(), ocp.lower.size)
        )
        n, m = ocp.initial.size, ocp.fixed_action.size
        given = np.concatenate([ocp.states[0], ocp.inputs[0][:m]]).tolist()
        slope = ca.gradient(self._lagrangian, ocp.variables)[given]
        both = ca.vertcat(slope, ca.gradient(self._lagrangian, ocp.theta))
        moved = ca.jtimes(both, ca.vertcat(ocp.variables, self._lam), step)
        pulled, found = moved[: n + m] + w[given], moved[n + m :]
        at = n + ocp.problem.names.size
        for k, one in zip([*range(n), *range(at, at + m)], ca.vertsplit(pulled), strict=True):
            found[k] += one
        return ca.Function("along", [*self._arguments, step, w], [found])

"""How the value of Eq. (2) answers to theta: the gradient is free, the Hessian a linear solve.

With the Lagrangian L(z, lam, nu; p) = f + lam' g + nu' z of Eq. (2), the envelope theorem says that
the derivative of the optimal value is the *partial* derivative of L: how z moves does not matter to
first order (Fiacco 1983; Gros and Zanon 2020). How z moves does matter to second order, and the
implicit function theorem on the KKT conditions supplies it.
"""

from functools import cached_property

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.ocp import Ocp


def lagrangian(ocp: Ocp) -> tuple[ca.SX, ca.SX]:
    """L = f + lam' g and its multipliers lam; the bounds on z add nu' z, whatever p is."""
    lam = ca.SX.sym("lam", ocp.constraints.numel())
    return ocp.objective + ca.dot(lam, ocp.constraints), lam


class Sensitivity:
    """The derivatives of an OCP's optimal value, evaluated at a primal-dual solution.

    The arguments are those of the NLP: variables z, parameters p, multipliers lam of the
    constraints and nu of the bounds, with CasADi's signs: lam >= 0 where g <= 0, and nu < 0 at a
    lower bound.
    """

    def __init__(self, ocp: Ocp) -> None:
        self._ocp = ocp
        self._lagrangian, self._lam = lagrangian(ocp)
        self._arguments = [ocp.variables, ocp.parameters, self._lam]
        results = ca.cse([ocp.objective, ca.gradient(self._lagrangian, ocp.theta)])
        self._value_and_gradient = ca.Function("value_and_gradient", self._arguments, results)

    def value_and_gradient(self, z: Vector, p: Vector, lam: Vector) -> tuple[float, Vector]:
        """V = f(z; p) and dV/dtheta = dL/dtheta, shape (2n + m + 1,): the envelope theorem."""
        value, gradient = self._value_and_gradient(z, p, lam)
        return float(value), gradient.full().ravel()

    def hessian(self, z: Vector, p: Vector, lam: Vector, nu: Vector) -> Matrix:
        """d2V/dtheta2, shape (d, d) with d = 2n + m + 1, while the active set does not change.

        With A the rows of the active constraints and bounds, the KKT conditions give (dz, dlam) as
        -K^-1 (L_z theta, A_theta) with K = [[L_zz, A'], [A, 0]]; the chain rule does the rest. A
        constraint is active where its multiplier exceeds its distance (Nocedal and Wright 2006);
        a bound that may be left at a price, where what is left of the price does so as well.

        Raises:
            numpy.linalg.LinAlgError: K is singular, so the optimum is not a strict one.
        """
        l_tt, right, moved = self._moved(z, p, lam, nu)
        result: Matrix = l_tt - right.T @ moved
        return result

    def plan(self, z: Vector, p: Vector, lam: Vector, nu: Vector) -> Matrix:
        """dz/dtheta, shape (size of z, d): as `hessian`, and as it raises."""
        return -self._moved(z, p, lam, nu)[2][: z.size]

    def _moved(
        self, z: Vector, p: Vector, lam: Vector, nu: Vector
    ) -> tuple[Matrix, Matrix, Matrix]:
        """L_theta theta, (L_z theta, A_theta), and K^-1 times the latter."""
        ocp = self._ocp
        g, l_zz, l_zt, l_tt, g_z, g_t = (b.full() for b in self._second_derivatives(z, p, lam))
        row = ocp.equality | (lam > np.abs(g.ravel()))
        bound = np.full(z.size, False)
        for multiplier, distance in ((-nu, np.abs(z - ocp.lower)), (nu, np.abs(ocp.upper - z))):
            bound |= (multiplier > distance) & (ocp.bound_prices - multiplier > distance)
        active = np.vstack([g_z[row], np.eye(z.size)[bound]])
        active_t = np.vstack([g_t[row], np.zeros((bound.sum(), len(l_tt)))])
        kkt = np.block([[l_zz, active.T], [active, np.zeros((len(active), len(active)))]])
        right = np.vstack([l_zt, active_t])
        return l_tt, right, np.linalg.solve(kkt, right)

    def kkt_residual(
        self, z: Vector, p: Vector, lam: Vector, nu: Vector, *, relative: bool = False
    ) -> float:
        """The largest violation of the KKT conditions, 0 at an optimum.

        Stationarity counts relative to the largest multiplier; complementarity as the smaller of a
        multiplier and its constraint's distance, or where a bound is left at a price, as what is
        left of the price. Where it is to be `relative`, multipliers are
        taken in parts of the largest, and distances in parts of the largest variable.
        """
        ocp = self._ocp
        g, slope = (part.full().ravel() for part in self._conditions(z, p, lam))
        inequality, largest = ~ocp.equality, max(1.0, np.abs(lam).max(), np.abs(nu).max())
        slope = (slope + nu) / largest
        lower, upper, prices = ocp.lower, ocp.upper, ocp.bound_prices
        if relative:
            lam, nu, size = lam / largest, nu / largest, max(1.0, np.abs(z).max())
            prices = prices / largest
            z, g, lower, upper = z / size, g / size, lower / size, upper / size
        below, above = np.maximum(-nu, 0), np.maximum(nu, 0)
        violations = (
            slope,
            g[ocp.equality],
            np.minimum(-g, lam)[inequality],
            np.maximum(np.minimum(z - lower, below), below - prices),
            np.maximum(np.minimum(upper - z, above), above - prices),
        )
        return float(max(np.abs(violation).max(initial=0) for violation in violations))

    @cached_property
    def _conditions(self) -> ca.Function:
        slope = ca.gradient(self._lagrangian, self._ocp.variables)
        return ca.Function("kkt", self._arguments, [self._ocp.constraints, slope])

    @cached_property
    def _second_derivatives(self) -> ca.Function:
        ocp = self._ocp
        slope = ca.gradient(self._lagrangian, ocp.variables)
        blocks = [
            ocp.constraints,
            ca.jacobian(slope, ocp.variables),
            ca.jacobian(slope, ocp.theta),
            ca.hessian(self._lagrangian, ocp.theta)[0],
            ca.jacobian(ocp.constraints, ocp.variables),
            ca.jacobian(ocp.constraints, ocp.theta),
        ]
        return ca.Function("second_derivatives", self._arguments, blocks)

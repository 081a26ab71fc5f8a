"""Derivatives of the value of Eq. (2) in theta, by dense algebra.

With the Lagrangian L(z, lam, nu; p) = f + lam' g + nu' z of Eq. (2), the envelope theorem says that
the derivative of the optimal value is the *partial* derivative of L: to first order the change of z
does not matter (Fiacco 1983; Gros and Zanon 2020). To second order it does, and the implicit
function theorem on the KKT conditions supplies it.

A number J = v V + sum w u of value and plan changes with p, the state, theta, a given u_0 and the
data, by v L_p + w' du/dp: one solve of the KKT system with w on its right, and not one for each
entry of p. That is `Sensitivity` of an OCP with all of p in the place of theta.

Where more rows and bounds are active than the inputs can follow, the plan has a kink. The value's
gradient then lies between those of the two sides, and every other derivative is that of one side:
theta + t (1, ..., 2) for small t > 0, where all parameters grow, the last twice as fast as the
first. The multipliers of that side are those of largest growth along it, a linear program.
"""

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.optimize import linprog

from nmpcrl import Matrix, Vector
from nmpcrl.control.ocp import Ocp

DEPENDENT = 1e-9  # least independent part of an active gradient, relative to the largest
INACTIVE = 1e-6  # part of itself to which a multiplier falls that is 0 on the side taken
PULLED = 1e-6  # largest residual of a linear system, relative to its right-hand side
STIFF, FLAT = 1e6, 1e-8  # spring of an active row, and no curvature, relative to the largest

Flags = NDArray[np.bool_]


def lagrangian(ocp: Ocp) -> tuple[ca.SX, ca.SX]:
    """L = f + lam' g and its multipliers lam; the bounds on z add nu' z, whatever p is."""
    lam = ca.SX.sym("lam", ocp.constraints.numel())
    return ocp.objective + ca.dot(lam, ocp.constraints), lam


@dataclass(frozen=True, eq=False)
class Gradient:
    """The derivatives of a number in what a solve was given."""

    state: Vector  #: in s, shape (n,)
    theta: Vector  #: shape (d,)
    action: Vector  #: in the u_0 that was given, shape (m,), or (0,) where it was free
    data: dict[str, NDArray[np.float64]]  #: by name, each of N + 1 stages, shape (N + 1, ...)


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

    def value_and_gradient(self, z: Matrix, p: Matrix, lam: Matrix) -> tuple[Matrix, Matrix]:
        """V = f(z; p) and dV/dtheta = dL/dtheta, a column a solution: the envelope theorem."""
        value, gradient = self._value_and_gradient(z, p, lam)
        return value.full(), gradient.full()

    def hessian(self, z: Vector, p: Vector, lam: Vector, nu: Vector) -> Matrix:
        """d2V/dtheta2, shape (d, d) with d = 2n + m + 1, while the active set does not change.

        With A the rows of the active constraints and bounds, the KKT conditions give (dz, dlam) as
        -K^-1 (L_z theta, A_theta) with K = [[L_zz, A'], [A, 0]]; the chain rule does the rest. A
        constraint is active where its multiplier exceeds its distance (Nocedal and Wright 2006).

        Raises:
            numpy.linalg.LinAlgError: K is singular on every side: a direction in which theta pulls
                has no curvature.
        """
        l_tt, right, moved = self._moved(z, p, lam, nu)
        return np.asarray(l_tt - right.T @ moved)

    def plan(self, z: Vector, p: Vector, lam: Vector, nu: Vector) -> Matrix:
        """dz/dtheta, shape (size of z, d): as `hessian`, and as it raises."""
        return -self._moved(z, p, lam, nu)[2][: z.size]

    def _moved(
        self, z: Vector, p: Vector, lam: Vector, nu: Vector
    ) -> tuple[Matrix, Matrix, Matrix]:
        """L_theta theta, (L_z theta, A_theta) and K^-1 times the latter, both for L of size 1."""
        ocp = self._ocp
        g, l_zz, l_zt, l_tt, g_z, g_t = (b.full() for b in self._second_derivatives(z, p, lam))
        row, bound = self._active(z, g.ravel(), lam, nu)
        active = np.vstack([g_z[row], np.eye(z.size)[bound]])
        active_t = np.vstack([g_t[row], np.zeros((bound.sum(), len(l_tt)))])
        left = np.abs(np.diag(qr(active.T, mode="r", pivoting=True)[0]))
        if len(active) > active.shape[1] or left.min() < DEPENDENT * left.max():  # to first order
            free = np.append(ocp.equality[row], np.zeros(bound.sum(), bool))
            held, multipliers = _one_side(active, active_t, np.append(lam[row], nu[bound]), free)
            lam = lam.copy()
            lam[row] = multipliers[: row.sum()]
            _, l_zz, l_zt, l_tt, _, _ = (b.full() for b in self._second_derivatives(z, p, lam))
            active, active_t = active[held], active_t[held]
        size = ocp.cost_size
        kkt = np.block([[l_zz / size, active.T], [active, np.zeros((len(active), len(active)))]])
        right = np.vstack([l_zt / size, active_t])
        return l_tt, size * right, _solved(kkt, right)

    def _active(self, z: Vector, g: Vector, lam: Vector, nu: Vector) -> tuple[Flags, Flags]:
        """Which constraints and which bounds hold as equalities, each in its own unit."""
        ocp, (of_z, of_g), size = self._ocp, self._ocp.sizes, self._ocp.cost_size
        row: Flags = ocp.equality | (lam * of_g / size > np.abs(g) / of_g)
        bound: Flags = np.full(z.size, False)
        for multiplier, distance in ((-nu, np.abs(z - ocp.lower)), (nu, np.abs(ocp.upper - z))):
            bound |= multiplier * of_z / size > distance / of_z
        return row, bound

    def is_minimum(self, z: Vector, p: Vector, lam: Vector, nu: Vector) -> bool:
        """Whether the optimum is a strict minimum: the Lagrangian curves up wherever inputs lead.

        By the Riccati recursion, in which active rows and bounds are springs; true where no
        curvature can be had.
        """
        ocp = self._ocp
        g, _ = self._conditions(z, p, lam)
        active, bound = self._active(z, g.full().ravel(), lam, nu)
        active[ocp.obstacles] &= bound[ocp.slacks]
        bound[ocp.inputs[: int(ocp.fixed_action.size > 0)]] = True
        least, size = map(float, self._pivots(z, p, lam, bound, active))
        return least > FLAT * size if 0 < size < np.inf else bool(size)  # inf: true

    def kkt_residual(
        self, z: Vector, p: Vector, lam: Vector, nu: Vector, *, relative: bool = False
    ) -> float:
        """The largest violation of the KKT conditions, 0 at an optimum.

        Stationarity counts relative to the largest multiplier; complementarity as the smaller of a
        multiplier and its constraint's distance, each in its unit of `Ocp.sizes`. Where it is to be
        `relative`, multipliers are taken in parts of the largest, and distances in parts of the
        largest variable.
        """
        ocp = self._ocp
        g, slope = (part.full().ravel() for part in self._conditions(z, p, lam))
        of_z, of_g = ocp.sizes
        z, lower, upper = z / of_z, ocp.lower / of_z, ocp.upper / of_z
        nu, slope = nu * of_z, slope * of_z
        g, lam = g / of_g, lam * of_g
        inequality = ~ocp.equality
        largest = max(ocp.cost_size, np.abs(lam).max(), np.abs(nu).max())
        slope = (slope + nu) / largest
        if relative:
            lam, nu, size = lam / largest, nu / largest, max(1.0, np.abs(z).max())
            z, g, lower, upper = z / size, g / size, lower / size, upper / size
        below, above = np.maximum(-nu, 0), np.maximum(nu, 0)
        violations = (
            slope,
            g[ocp.equality],
            np.minimum(-g, lam)[inequality],
            np.minimum(z - lower, below),
            np.minimum(upper - z, above),
        )
        return float(max(np.abs(violation).max(initial=0) for violation in violations))

    def along(self, z: Matrix, p: Matrix, lam: Matrix, step: Matrix, weights: Matrix) -> Matrix:
        """w' dz/dp by steps of z and lam that solve K step + w = 0: L_p along them, a column each.

        It needs all of p in theta. The multipliers of x_0 = s and of a given u_0, which are 0 in a
        step, are found here.
        """
        found: Matrix = self._along(z, p, lam, step, weights).full()
        return found

    @cached_property
    def _along(self) -> ca.Function:
        ocp, n, m = self._ocp, self._ocp.initial.size, self._ocp.fixed_action.size
        step = ca.SX.sym("step", ocp.lower.size + self._lam.numel())
        w = ca.SX.sym("w", ocp.lower.size)
        given = np.concatenate([ocp.states[0], ocp.inputs[0][:m]]).tolist()
        slope = ca.gradient(self._lagrangian, ocp.variables)[given]
        both = ca.vertcat(slope, ca.gradient(self._lagrangian, ocp.theta))
        moved = ca.jtimes(both, ca.vertcat(ocp.variables, self._lam), step)
        pulled, found = moved[: n + m] + w[given], moved[n + m :]
        at = n + ocp.problem.names.size
        for k, one in zip([*range(n), *range(at, at + m)], ca.vertsplit(pulled), strict=True):
            found[k] += one
        return ca.Function("along", [*self._arguments, step, w], [found])

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

    @cached_property
    def _pivots(self) -> ca.Function:
        """The least pivot of any stage's Q_uu, with springs, and the largest curvature without."""
        ocp, N = self._ocp, len(self._ocp.inputs)
        slope = ca.gradient(self._lagrangian, ocp.variables)
        bends, slopes = (ca.jacobian(f, ocp.variables) for f in (slope, ocp.constraints))
        bound, active = ca.SX.sym("bound", ocp.lower.size), ca.SX.sym("active", ocp.equality.size)
        y = [np.append(u, x).tolist() for u, x in zip(ocp.inputs, ocp.states, strict=False)]
        y.append(ocp.states[N].tolist())
        size = ca.norm_inf(ca.veccat(*(bends[k, k] for k in y)))
        least, V = ca.SX(ca.inf), ca.SX(0, 0)
        for i in range(N, -1, -1):
            rows = [*ocp.obstacles[i].tolist(), *ocp.hard[i].tolist()]
            C = slopes[rows, y[i]]
            springs = ca.diag(bound[y[i]]) + C.T @ ca.diag(active[rows]) @ C
            K = ca.densify(bends[y[i], y[i]]) + STIFF * size * springs
            if i < N:
                F = slopes[ocp.dynamics[i].tolist(), y[i]]
                K += F.T @ V @ F
                for _ in ocp.inputs[i]:  # eliminate an input
                    least = ca.fmin(least, K[0, 0])
                    K = K[1:, 1:] - K[1:, 0] @ K[0, 1:] / K[0, 0]
            V = K
        return ca.Function("pivots", [*self._arguments, bound, active], [least, size])


def _one_side(
    active: Matrix, active_t: Matrix, multipliers: Vector, free: Vector
) -> tuple[Vector, Vector]:
    """Which of the active constraints hold on the side that is taken, and all multipliers there.

    Multipliers keep their signs, unless they are `free`.

    Raises:
        numpy.linalg.LinAlgError: no multipliers are largest, for the constraints contradict
            each other on that side.
    """
    size = np.where(multipliers == 0, 1.0, np.abs(multipliers))
    signed = np.where(free, 1.0, np.sign(multipliers)) * size
    columns = (signed[:, None] * active).T
    columns /= np.maximum(np.abs(columns).max(axis=1, keepdims=True), np.finfo(float).tiny)
    growth = signed * (active_t @ np.linspace(1, 2, active_t.shape[1]))
    now = multipliers / signed
    change = linprog(  # from these multipliers, which rounding cannot call infeasible
        -growth / max(np.abs(growth).max(), np.finfo(float).tiny),
        A_eq=columns,
        b_eq=np.zeros(len(columns)),
        bounds=np.column_stack([np.where(free, -np.inf, -now), np.full(now.size, np.inf)]),
        method="highs-ds",
    )
    if not change.success:
        raise np.linalg.LinAlgError(f"no multipliers on one side: {change.message}")
    there = now + change.x
    held = free | (there > INACTIVE)
    return held, np.where(held, signed * there, 0.0)


def _solved(kkt: Matrix, right: Matrix) -> Matrix:
    """K^-1 right; a variable without curvature that no parameter pulls at stays where it is.

    Raises:
        numpy.linalg.LinAlgError: a parameter pulls at one.
    """
    enough = PULLED * np.abs(right).max(initial=0.0)
    for solve in (np.linalg.solve, lambda K, b: np.linalg.lstsq(K, b, rcond=DEPENDENT)[0]):
        with suppress(np.linalg.LinAlgError):
            result: Matrix = np.asarray(solve(kkt, right), float)
            if np.abs(kkt @ result - right).max(initial=0.0) <= enough:
                return result
    raise np.linalg.LinAlgError("the optimum has no curvature where a parameter pulls at it")

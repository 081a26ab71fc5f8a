"""The controller: Eq. (2) solved in a state, with the value's gradient in theta.

`Nmpc.solve(state, theta)` is the value V_theta(s), the paper's Q_theta(s, a) of Eq. (3);
`Nmpc.solve(state, theta, action=a)` fixes u_0 = a and is the action value proper.
"""

import time
import warnings
from functools import cached_property

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.control.ocp import Ocp, transcribe
from nmpcrl.control.plant import Plant
from nmpcrl.control.sensitivity import Sensitivity
from nmpcrl.control.solution import Solution, short
from nmpcrl.control.solvers import Fatrop, Prepared, Riccati, Solver, solver_of
from nmpcrl.control.task import Task

ABSURD = 1e6  # no theta or action beyond this reaches a solver: fatrop never returns from some
FAR = 1e3  # nor does a state: from 1e4 outside the box fatrop never returns either

DEFAULT = Riccati()

__all__ = ["ABSURD", "Nmpc"]


class Nmpc:
    """Eq. (2) for one plant and one task, as a function of the state and of theta."""

    def __init__(
        self,
        plant: Plant,
        task: Task,
        horizon: int = 10,
        gamma: float = 0.97,
        slack_weight: float = 100.0,
        solver: Solver | str = DEFAULT,
        *,
        ties_active: bool = False,
    ) -> None:
        """Check and keep the problem; it is transcribed at the first solve.

        Args:
            plant: predicts; the robot of Eq. (18) in the paper.
            task: target, box and obstacles.
            horizon: N, the number of planned inputs.
            gamma: discount factor, 0 < gamma <= 1.
            slack_weight: omega, the cost of a unit of each slack.
            solver: `Riccati()`, which is compiled for the plant at its first solve and gives way to
                fatrop with a warning where that cannot be done; `Fatrop()`; `Ipopt()`; or the
                name of one of them.
            ties_active: whether a state exactly on an obstacle's boundary counts as in it: the
                other side of a kink in theta_c.  # departure L
        """
        if isinstance(horizon, bool) or not isinstance(horizon, int | np.integer) or horizon < 1:
            raise ValueError(f"horizon = {horizon!r} must be a whole number, 1 or more")
        if not 0 < gamma <= 1:
            raise ValueError(f"gamma = {gamma} must lie in (0, 1]")
        if not 0 < slack_weight < np.inf:
            raise ValueError(f"slack_weight = {slack_weight} must be a positive number")
        if task.start.size != plant.n:
            raise ValueError(f"the task has {task.start.size} states and the plant {plant.n}")
        self.plant = plant
        self.task = task
        self.horizon = int(horizon)
        self.gamma = float(gamma)
        self.slack_weight = float(slack_weight)
        self.solver = solver_of(solver)
        self.solver.check(task)
        self._solves = self.solver  # or what took over
        self.ties_active = ties_active

    def solve(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None = None,
        action: Vector | None = None,
    ) -> Solution:
        """Solve Eq. (2) from `state`: V_theta(s), or Q_theta(s, a) with u_0 = `action`.

        Args:
            state: plant state, shape (n,); (x [m], y [m], heading [rad]) for the robot.
            theta: NMPC parameters, shape (2n + m + 1,).
            warm_start: an earlier solution to start from: as it is if it was solved in this state,
                shifted by one stage if in another. Standing still at `state` if absent.
            action: the first input, shape (m,), within the plant's bounds; free if absent.

        Raises:
            ValueError: an argument has the wrong shape, is not finite, or is absurdly large.
            SolverError: no optimum was found; carries the status, the state and theta.
        """
        began = time.perf_counter()
        state = _checked("state", state, self.plant.n, FAR)
        theta = _checked("theta", theta, 2 * self.plant.n + self.plant.m + 1)
        if action is None:
            return self._free.solve(state, theta, warm_start, began=began)
        action = _checked("action", action, self.plant.m)
        if (action < self.plant.lower).any() or (action > self.plant.upper).any():
            bounds = f"{short(self.plant.lower)} and {short(self.plant.upper)}"
            raise ValueError(f"action {short(action)} must lie between {bounds}")
        return self._fixed.solve(state, theta, warm_start, action, began=began)

    def value_hessian(self, solution: Solution) -> Matrix:
        """The second derivative of `solution.value` in theta, shape (d, d): see `Sensitivity`."""
        return self._variant(solution).sensitivity.hessian(*_point(solution))

    def value_hessian_times(self, solution: Solution, vector: Vector) -> Vector:
        """The product of `value_hessian` with a vector of shape (d,); in microseconds by riccati.

        Raises:
            ValueError: the vector has another shape, is not finite or is absurdly large.
        """
        vector = _checked("vector", vector, solution.theta.size)
        return self._variant(solution).hessian_times(solution, vector)

    def kkt_residual(self, solution: Solution) -> float:
        """How far `solution` is from satisfying the KKT conditions: see `Sensitivity`."""
        return self._variant(solution).sensitivity.kkt_residual(*_point(solution))

    @property
    def ocp(self) -> Ocp:
        """Eq. (2) with u_0 free, in symbols."""
        return self._free.ocp

    def _prepared(self, ocp: Ocp) -> Prepared:
        """The solver for a problem; fatrop, and a warning, where there is no machine code."""
        try:
            return self._solves.prepare(ocp)
        except CannotCompile as error:
            instead = Fatrop(self.solver.tolerance)
            try:
                instead.check(self.task)
            except ValueError as refusal:
                raise ValueError(f"{error}, and {refusal}") from error
            warnings.warn(
                f"{error}: {instead.name} solves instead of {self.solver.name}", stacklevel=2
            )
            self._solves = instead
        return self._solves.prepare(ocp)

    def _variant(self, solution: Solution) -> "_Variant":
        return self._fixed if solution.ocp.fixed_action.size else self._free

    @cached_property
    def _free(self) -> "_Variant":
        return _Variant(self, fix_action=False)

    @cached_property
    def _fixed(self) -> "_Variant":
        return _Variant(self, fix_action=True)


class _Variant:
    """Eq. (2) with u_0 free or fixed: transcribed, with its sensitivities and a solver."""

    def __init__(self, nmpc: Nmpc, *, fix_action: bool) -> None:
        problem = (nmpc.plant, nmpc.task, nmpc.horizon, nmpc.gamma, nmpc.slack_weight)
        self.ocp = transcribe(*problem, fix_action=fix_action, ties_active=nmpc.ties_active)
        self._solver = nmpc._prepared(self.ocp)
        self.solve = self._solver.solve

    def hessian_times(self, solution: Solution, vector: Vector) -> Vector:
        """As `Nmpc.value_hessian_times`; by dense algebra where there is no machine code."""
        product = self._solver.hessian_times(solution, vector)
        if product is None:
            return self.sensitivity.hessian(*_point(solution)) @ vector
        return product

    @cached_property
    def sensitivity(self) -> Sensitivity:
        return Sensitivity(self.ocp)


def _point(solution: Solution) -> tuple[Vector, Vector, Vector, Vector]:
    action = solution.action[: solution.ocp.fixed_action.size]
    p = np.concatenate([solution.state, solution.theta, action])
    return solution.primal, p, solution.constraint_duals, solution.bound_duals


def _checked(name: str, vector: Vector, size: int, largest: float = ABSURD) -> Vector:
    """A copy of `vector`, once its shape and its numbers are known to be right."""
    try:
        vector = np.array(vector, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} = {vector!r} must hold {size} numbers") from None
    if vector.shape != (size,):
        raise ValueError(f"{name} has shape {vector.shape}; it must be ({size},)")
    if not vector.dot(vector) <= largest**2 and not (np.abs(vector) <= largest).all():
        raise ValueError(
            f"{name} {short(vector)} must hold finite numbers of size at most {largest:g}"
        )
    return vector

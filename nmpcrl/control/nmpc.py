"""The controller: Eq. (2) solved in a state, with the value's gradient in theta.

`Nmpc.solve(state, theta)` is the value V_theta(s), the paper's Q_theta(s, a) of Eq. (3);
`Nmpc.solve(state, theta, action=a)` fixes u_0 = a and is the action value proper.
"""

import time
import warnings
from functools import cached_property
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.codegen.source import CannotCompile
from nmpcrl.control.ocp import transcribe
from nmpcrl.control.plant import Plant
from nmpcrl.control.sensitivity import Sensitivity
from nmpcrl.control.solution import Solution, SolverError, short
from nmpcrl.control.solvers.nlpsol import SOLVERS as CASADI_SOLVERS
from nmpcrl.control.solvers.nlpsol import TOLERANCE, Program
from nmpcrl.control.solvers.riccati import InteriorPoint
from nmpcrl.control.task import Task

ABSURD = 1e6  # no theta or action beyond this reaches a solver: fatrop never returns from some
FAR = 1e3  # nor does a state: from 1e4 outside the box fatrop never returns either

LEAST_TOLERANCE, LARGEST_TOLERANCE = 1e-12, 1e-2

SOLVERS = ("riccati", *CASADI_SOLVERS)
FALLBACK = "fatrop"  # where the default cannot be compiled

__all__ = ["ABSURD", "SOLVERS", "Nmpc", "Solution", "SolverError"]


class Nmpc:
    """Eq. (2) for one plant and one task, as a function of the state and of theta."""

    def __init__(
        self,
        plant: Plant,
        task: Task,
        horizon: int = 10,
        gamma: float = 0.97,
        slack_weight: float = 100.0,
        solver: str = SOLVERS[0],
        *,
        ties_active: bool = False,
        soft_box: bool = False,
        tolerance: float = TOLERANCE,
    ) -> None:
        """Check and keep the problem; it is transcribed at the first solve.

        Args:
            plant: predicts; the robot of Eq. (18) in the paper.
            task: target, box and obstacles.
            horizon: N, the number of planned inputs.
            gamma: discount factor, 0 < gamma <= 1.
            slack_weight: omega, the cost of a unit of each slack.
            solver: "riccati", which is compiled for the plant at its first solve and gives way to
                "fatrop" with a warning where that cannot be done; "fatrop"; or "ipopt".
            ties_active: whether a state exactly on an obstacle's boundary counts as in it: the
                other side of a kink in theta_c.  # departure L
            soft_box: whether leaving the box costs `slack_weight` a metre, as entering an obstacle
                does, instead of being forbidden; riccati only.  # departure M
            tolerance: of the KKT conditions.
        """
        if isinstance(horizon, bool) or not isinstance(horizon, int | np.integer) or horizon < 1:
            raise ValueError(f"horizon = {horizon!r} must be a whole number, 1 or more")
        if not 0 < gamma <= 1:
            raise ValueError(f"gamma = {gamma} must lie in (0, 1]")
        if not 0 < slack_weight < np.inf:
            raise ValueError(f"slack_weight = {slack_weight} must be a positive number")
        if solver not in SOLVERS:
            raise ValueError(f"solver = {solver!r} must be one of {', '.join(SOLVERS)}")
        if not LEAST_TOLERANCE <= tolerance <= LARGEST_TOLERANCE:
            allowed = f"[{LEAST_TOLERANCE:g}, {LARGEST_TOLERANCE:g}]"
            raise ValueError(f"tolerance = {tolerance} must lie in {allowed}")
        if soft_box and solver != "riccati":
            raise ValueError(f"soft_box = {soft_box} is for riccati, not for {solver}")
        if task.start.size != plant.n:
            raise ValueError(f"the task has {task.start.size} states and the plant {plant.n}")
        self.plant = plant
        self.task = task
        self.horizon = int(horizon)
        self.gamma = float(gamma)
        self.slack_weight = float(slack_weight)
        self.solver = solver
        self.soft_box = soft_box
        self.options: dict[str, Any] = {"ties_active": ties_active, "tolerance": float(tolerance)}

    def solve(
        self,
        state: Vector,
        theta: Vector,
        guess: Solution | None = None,
        action: Vector | None = None,
    ) -> Solution:
        """Solve Eq. (2) from `state`: V_theta(s), or Q_theta(s, a) with u_0 = `action`.

        Args:
            state: plant state, shape (n,); (x [m], y [m], heading [rad]) for the robot.
            theta: NMPC parameters, shape (2n + m + 1,).
            guess: an earlier solution to start from: as it is if it was solved in this state,
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
            return self._free.solve(state, theta, guess, began=began)
        action = _checked("action", action, self.plant.m)
        if (action < self.plant.lower).any() or (action > self.plant.upper).any():
            bounds = f"{short(self.plant.lower)} and {short(self.plant.upper)}"
            raise ValueError(f"action {short(action)} must lie between {bounds}")
        return self._fixed.solve(state, theta, guess, action, began=began)

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
        plant, task = nmpc.plant, nmpc.task
        problem = (plant, task, nmpc.horizon, nmpc.gamma, nmpc.slack_weight)
        self._ocp = transcribe(*problem, fix_action=fix_action)
        self._interior_point: InteriorPoint | None = None
        if nmpc.solver == "riccati":
            try:
                point = InteriorPoint(
                    self._ocp, plant, task, soft_box=nmpc.soft_box, **nmpc.options
                )
                self._interior_point, self.solve = point, point.solve
                return
            except CannotCompile as error:
                if nmpc.soft_box:
                    raise ValueError(
                        f"{error}: no other solver than riccati has soft_box"
                    ) from error
                warnings.warn(f"{error}: {FALLBACK} solves instead of riccati", stacklevel=2)
                nmpc.solver = FALLBACK
        self.solve = Program(self._ocp, self.sensitivity, task, nmpc.solver, **nmpc.options).solve

    def hessian_times(self, solution: Solution, vector: Vector) -> Vector:
        """As `Nmpc.value_hessian_times`; by dense algebra where there is no machine code."""
        fast = self._interior_point
        product = fast.hessian_times(solution, vector) if fast else None
        if product is None:
            return self.sensitivity.hessian(*_point(solution)) @ vector
        return product

    @cached_property
    def sensitivity(self) -> Sensitivity:
        return Sensitivity(self._ocp)


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

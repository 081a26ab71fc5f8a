"""One OCP with u_0 free or fixed: a solver that is ready for it, and its derivatives."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.diagnosis import Diagnosis
from nmpcrl.control.ocp import Indices, Ocp
from nmpcrl.control.sensitivity import Sensitivity
from nmpcrl.control.solution import DerivativeError, Solution, SolverError
from nmpcrl.control.solvers import Prepared
from nmpcrl.control.solvers.riccati import Compiled
from nmpcrl.control.units import Units, units_of


class Variant:
    """Eq. (2) with u_0 free or fixed: transcribed, with its sensitivities and a solver."""

    def __init__(self, ocp: Ocp, prepared: Callable[[Ocp], Prepared]) -> None:
        self.ocp = ocp
        self._units: Units | None = units_of(ocp)
        self.solver = prepared(ocp if self._units is None else self._units.ocp)
        self.solve = self.solver.solve if self._units is None else self._solve_in_units

    @property
    def machine(self) -> Compiled | None:
        """The compiled solver; None where another one solves, or this one in units of its own."""
        return self.solver if self._units is None and isinstance(self.solver, Compiled) else None

    def _solve_in_units(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None,
        *action: Vector,
        **others: Any,
    ) -> Solution:
        """As `Prepared.solve`, of a problem that is solved in other units than its own."""
        units = self._units
        assert units is not None
        begin = None if warm_start is None else units.inside(warm_start)
        scaled = [one / units.inputs for one in action]
        try:
            found = self.solver.solve(state / units.states, theta, begin, *scaled, **others)
        except SolverError as error:
            raise type(error)(error.status, state, theta) from None
        return units.outside(found, state)

    def _inside(self, solution: Solution) -> Solution:
        """A solution in the units in which it was found."""
        return solution if self._units is None else self._units.inside(solution)

    def hessian(self, solution: Solution) -> Matrix:
        """As `Nmpc.value_hessian`."""
        return self._dense(self._sensitivity.hessian, solution)

    def kkt_residual(self, solution: Solution, *, relative: bool) -> float:
        """As `Nmpc.kkt_residual`."""
        point = _point(self._inside(solution))
        return self._sensitivity.kkt_residual(*point, relative=relative)

    def hessian_times(self, solution: Solution, vector: Vector) -> Vector:
        """As `Nmpc.value_hessian_times`; by dense algebra where there is no machine code."""
        product = self.solver.hessian_times(self._inside(solution), vector)
        return self.hessian(solution) @ vector if product is None else product

    def inputs_jacobian(self, solution: Solution, stage: int) -> Matrix:
        """d u_i / d theta; by dense algebra where there is no machine code."""
        if stage == len(self.ocp.inputs):
            return np.zeros((0, solution.theta.size))
        return self._rows(solution, stage, self.ocp.inputs)

    def states_jacobian(self, solution: Solution, stage: int) -> Matrix:
        """d x_i / d theta, in the same way."""
        return self._rows(solution, stage, self.ocp.states)

    def feedback(self, solution: Solution) -> Matrix:
        """As `Nmpc.policy_feedback`."""
        slopes = self.solver.feedback(self._inside(solution))
        if slopes is None:
            slopes = self._dense(self._in_state.plan, solution)[self.ocp.inputs[0]]
        if self._units is not None:
            slopes = self._units.inputs[:, None] * slopes / self._units.states
        return slopes

    def _rows(self, solution: Solution, stage: int, part: Indices) -> Matrix:
        """The gradients of the plan's entries at a stage, a sweep each."""
        ocp, found = self.ocp, []
        states: Matrix = np.zeros(ocp.states.shape)
        inputs: Matrix = np.zeros(ocp.inputs.shape)
        chosen = states if part is ocp.states else inputs
        size = np.ones(chosen.shape[1])
        if self._units is not None:
            size = self._units.states if part is ocp.states else self._units.inputs
        inside = self._inside(solution)
        for k in range(chosen.shape[1]):
            chosen[stage] = size * (np.arange(chosen.shape[1]) == k)
            gradient = self.solver.plan_gradient(inside, states, inputs)
            if gradient is None:
                dense = self._dense(self._sensitivity.plan, solution)[part[stage]]
                return np.asarray(size[:, None] * dense, float)
            found.append(gradient)
        return np.array(found)

    def _dense(self, derivative: Callable[..., Matrix], solution: Solution) -> Matrix:
        """A derivative of `Sensitivity` at a solution.

        Raises:
            DerivativeError: there is none.
        """
        try:
            return derivative(*_point(self._inside(solution)))
        except np.linalg.LinAlgError as error:
            raise DerivativeError(str(error), solution.state, solution.theta) from error

    @cached_property
    def diagnosis(self) -> Diagnosis:
        return Diagnosis(self.ocp)

    @property
    def _solved(self) -> Ocp:
        """The OCP in the units in which it is solved."""
        return self.ocp if self._units is None else self._units.ocp

    @cached_property
    def _sensitivity(self) -> Sensitivity:
        return Sensitivity(self._solved)

    @cached_property
    def _in_state(self) -> Sensitivity:
        """The derivatives in the initial state in place of theta."""
        ocp = self._solved
        return Sensitivity(replace(ocp, theta=ocp.parameters[: ocp.problem.states]))


def _point(solution: Solution) -> tuple[Vector, Vector, Vector, Vector]:
    return (
        solution.primal, solution.parameters, solution.constraint_duals, solution.bound_duals,
    )  # fmt: skip

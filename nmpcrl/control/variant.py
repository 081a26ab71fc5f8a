"""Eq. (2) with u_0 free or fixed: its OCP, its solver and its derivatives."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from nmpcrl import Vector
from nmpcrl.control.diagnosis import Diagnosis
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.sensitivity import Sensitivity
from nmpcrl.control.solution import DerivativeError, Solution, SolverError
from nmpcrl.control.solvers import Solver
from nmpcrl.control.solvers.riccati import Compiled
from nmpcrl.control.units import Units


class Variant:
    """An OCP with its solver and its derivatives."""

    def __init__(self, ocp: Ocp, solver: Solver) -> None:
        self.ocp, self.units = ocp, Units(ocp)
        self.solver = solver.prepare(self.units.ocp)
        self.solve = self.solver.solve if self.units.trivial else self._solve_in_units

    @property
    def machine(self) -> Compiled | None:
        """The compiled solver; None where another one solves, or where units are not 1."""
        return self.solver if self.units.trivial and isinstance(self.solver, Compiled) else None

    def _solve_in_units(
        self,
        state: Vector,
        theta: Vector,
        warm_start: Solution | None,
        *action: Vector,
        **others: Any,
    ) -> Solution:
        """`Prepared.solve` in the units of `Units.ocp`."""
        units = self.units
        begin = None if warm_start is None else units.inside(warm_start)
        scaled = [one / units.inputs for one in action]
        try:
            found = self.solver.solve(state / units.states, theta, begin, *scaled, **others)
        except SolverError as error:
            raise type(error)(error.status, state, theta) from None
        return units.outside(found, state)

    def compiled(
        self, derivative: Callable[..., Vector | None], solution: Solution, *along: Vector
    ) -> Any:
        """A derivative by the compiled solver, in units of `units`; None where it has none."""
        if not isinstance(self.solver, Compiled):
            return None
        return derivative(self.solver, self.units.inside(solution), *along)

    def dense(
        self,
        function: Callable[..., Any],
        solution: Solution,
        *,
        in_state: bool = False,
        **how: Any,
    ) -> Any:
        """A function of `Sensitivity`, in theta or `in_state`; DerivativeError if there is none."""
        inside = self.units.inside(solution)
        duals = inside.constraint_duals, inside.bound_duals
        of = self._in_state if in_state else self._sensitivity
        try:
            return function(of, inside.primal, inside.parameters, *duals, **how)
        except np.linalg.LinAlgError as error:
            raise DerivativeError(str(error), solution.state, solution.theta) from error

    @cached_property
    def diagnosis(self) -> Diagnosis:
        return Diagnosis(self.ocp)

    @cached_property
    def _sensitivity(self) -> Sensitivity:
        return Sensitivity(self.units.ocp)

    @cached_property
    def _in_state(self) -> Sensitivity:
        """Derivatives in the initial state in place of theta."""
        ocp = self.units.ocp
        return Sensitivity(replace(ocp, theta=ocp.parameters[: ocp.problem.states]))

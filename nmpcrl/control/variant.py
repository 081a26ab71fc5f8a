"""Eq. (2) with u_0 free or fixed: its OCP, its solver and its derivatives."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.diagnosis import Diagnosis
from nmpcrl.control.ocp import Ocp
from nmpcrl.control.sensitivity import Gradient, Sensitivity
from nmpcrl.control.solution import DerivativeError, Solution, SolverError
from nmpcrl.control.solvers import Asked, Solver
from nmpcrl.control.solvers.riccati import Compiled
from nmpcrl.control.units import Units


class Variant:
    """An OCP with its solver and its derivatives."""

    def __init__(self, ocp: Ocp, solver: Solver) -> None:
        self.ocp, self.units = ocp, Units(ocp)
        self.solver = solver.prepare(self.units.ocp)
        self.solve = self.solver.solve if self.units.trivial else self._solve_in_units

    def gradient(
        self, solutions: Sequence[Solution | None], value: Any, *, alone: bool, **weights: Any
    ) -> Gradient:
        """See `Nmpc.gradient`, of a batch; `weights` are those of inputs and states."""
        ocp, units, of, count = self.ocp, self.units, self.ocp.problem, len(solutions)
        w = np.zeros((count, ocp.lower.size))
        for name, unit in (("inputs", units.inputs), ("states", units.states)):
            shape, one = (count, *getattr(ocp, name).shape), weights[name]
            if one is not None and np.shape(one) != shape:
                found, wanted = np.shape(one)[alone:], shape[alone:]
                raise ValueError(f"{name} has shape {found}; it must be {wanted}")
            w[:, getattr(ocp, name)] = 0.0 if one is None else one * unit
        n, d, m, stages = of.states, of.names.size, ocp.fixed_action.size, len(ocp.states)
        found = np.zeros((count, n + d + m + of.data_names.size * stages))
        rows = [k for k, one in enumerate(solutions) if one is not None]
        if rows:
            solved = [one for one in solutions if one is not None]
            found[rows] = self._pulled(
                solved, np.broadcast_to(value, count)[rows], w[rows], alone=alone
            )
        state, theta, action, data = np.split(found, np.cumsum([n, d, m]), axis=1)
        data = data.reshape(count, stages, -1)
        parts = {name: of.data_names.part(name, data) for name in of.data_names}
        return Gradient(
            state / units.states,
            theta,
            action / units.inputs[:m],
            {name: part.reshape(count, -1, *of.data_names[name]) for name, part in parts.items()},
        )

    def _pulled(
        self, solutions: list[Solution], value: Vector, w: Matrix, *, alone: bool
    ) -> Matrix:
        """The derivatives in p, a row a solution; only the value's where a plan has none.

        CasADi's functions take a column a solution.
        """
        inside = [self.units.inside(one) for one in solutions]
        of_each = ((one.primal, one.parameters, one.constraint_duals) for one in inside)
        given = [np.array(part).T for part in zip(*of_each, strict=True)]
        found = value * self._backward.value_and_gradient(*given)[1]
        steps = {}
        for k in np.flatnonzero(w.any(axis=1)).tolist():
            step = self.compiled(Compiled.adjoint, solutions[k], w[k])
            if step is not None:
                steps[k] = step
                continue
            try:
                found[:, k] += w[k] @ self.dense(Sensitivity.plan, solutions[k], of=self._backward)
            except DerivativeError:
                if alone:
                    raise
        if steps:
            swept, moved = [*steps], np.array([*steps.values()]).T
            z, p, lam = (part[:, swept] for part in given)
            found[:, swept] += self._backward.along(z, p, lam, moved, w[swept].T)
        return found.T

    @property
    def machine(self) -> Compiled | None:
        """The compiled solver; None where another one solves, or where units are not 1."""
        return self.solver if self.units.trivial and isinstance(self.solver, Compiled) else None

    def _solve_in_units(self, asked: Asked) -> Solution:
        """`Prepared.solve` in the units of `Units.ocp`."""
        units, state, warm_start, action = self.units, asked.state, asked.warm_start, asked.action
        begin = None if warm_start is None else units.inside(warm_start)
        inside = asked._replace(
            state=state / units.states,
            warm_start=begin,
            action=action / units.inputs[: action.size],
        )
        try:
            found = self.solver.solve(inside)
        except SolverError as error:
            raise type(error)(error.status, state, asked.theta) from None
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
        of: Sensitivity | None = None,
        **how: Any,
    ) -> Any:
        """A method of `Sensitivity` at a solution, in theta by default; else DerivativeError."""
        inside = self.units.inside(solution)
        duals = inside.constraint_duals, inside.bound_duals
        try:
            return function(
                of or self._sensitivity, inside.primal, inside.parameters, *duals, **how
            )
        except np.linalg.LinAlgError as error:
            raise DerivativeError(str(error), solution.state, solution.theta) from error

    @cached_property
    def diagnosis(self) -> Diagnosis:
        return Diagnosis(self.ocp)

    @cached_property
    def _sensitivity(self) -> Sensitivity:
        return Sensitivity(self.units.ocp)

    @cached_property
    def _backward(self) -> Sensitivity:
        """Derivatives in all of p."""
        return Sensitivity(replace(self.units.ocp, theta=self.units.ocp.parameters))

    @cached_property
    def in_state(self) -> Sensitivity:
        """Derivatives in the initial state in place of theta."""
        ocp = self.units.ocp
        return Sensitivity(replace(ocp, theta=ocp.parameters[: ocp.problem.states]))

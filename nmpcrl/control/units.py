"""A `Problem` in units in which its states and inputs are of size 1, and its solutions in its own.

No solver is indifferent to units: with states of 1e-6 the errors that are allowed exceed the plan.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from nmpcrl import Vector
from nmpcrl.control.ocp import Ocp, transcribe
from nmpcrl.control.solution import Solution


class Units:
    """The way from an OCP to the one that is solved, and back."""

    def __init__(self, ocp: Ocp) -> None:
        self._outer, self._problem = ocp, ocp.problem
        self.states, self.inputs = ocp.problem.sizes
        self.ocp = transcribe(
            ocp.problem.solved, fix_action=ocp.fixed_action.size > 0, ties_active=ocp.ties_active
        )

    def inside(self, solution: Solution) -> Solution:
        """A solution as that of the OCP that is solved."""
        own = solution.ocp is self._outer
        sizes = self._sizes if own else self._sizes_in(solution.ocp)
        return replace(
            solution,
            state=solution.state / self.states,
            point=solution.point / sizes,
            ocp=self.ocp if own else solution.ocp,
        )

    def outside(self, found: Solution, state: Vector) -> Solution:
        """A solution of the OCP that is solved as that of the problem."""
        return replace(found, state=state, point=found.point * self._sizes, ocp=self._outer)

    @cached_property
    def _sizes(self) -> Vector:
        return self._sizes_in(self._outer)

    def _sizes_in(self, ocp: Ocp) -> Vector:
        return sizes_in(ocp, self.states, self.inputs)


def sizes_in(ocp: Ocp, states: Vector, inputs: Vector) -> Vector:
    """The units of z, lam and nu, each in the order of an OCP."""
    z, lam = np.ones(ocp.lower.size), np.ones(ocp.equality.size)
    z[ocp.states], z[ocp.inputs] = states, inputs
    lam[ocp.initial], lam[ocp.dynamics] = 1 / states, 1 / states
    lam[ocp.fixed_action] = 1 / inputs[: ocp.fixed_action.size]
    return np.concatenate([z, lam, 1 / z])


def units_of(ocp: Ocp) -> Units | None:
    """None where a problem is solved in its own units."""
    return None if ocp.problem.solved is ocp.problem else Units(ocp)

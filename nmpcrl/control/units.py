"""A `Problem` in units in which states and inputs are of size 1, and its solutions in both units.

No solver is indifferent to units: with states of 1e-6 the allowed errors exceed the plan.
"""

from dataclasses import replace

import numpy as np

from nmpcrl import Vector
from nmpcrl.control.ocp import Ocp, transcribe
from nmpcrl.control.solution import Solution


class Units:
    """An OCP, and in `ocp` the scaled one that is solved; both are one if units are `trivial`."""

    def __init__(self, ocp: Ocp) -> None:
        self._outer, self.ocp, solved = ocp, ocp, ocp.problem.solved
        self.states, self.inputs = ocp.problem.sizes
        self.trivial = solved is ocp.problem
        if not self.trivial:
            fixed = ocp.fixed_action.size > 0
            self.ocp = transcribe(solved, fix_action=fixed, ties_active=ocp.ties_active)

    def inside(self, solution: Solution) -> Solution:
        """A solution in the units of `ocp`."""
        if self.trivial:
            return solution
        return replace(
            solution,
            state=solution.state / self.states,
            point=solution.point / self.sizes(solution.ocp),
            ocp=self.ocp if solution.ocp is self._outer else solution.ocp,
        )

    def outside(self, found: Solution, state: Vector) -> Solution:
        """A solution of `ocp` in the problem's units."""
        point = found.point * self.sizes(self._outer)
        return replace(found, state=state, point=point, ocp=self._outer)

    def sizes(self, ocp: Ocp) -> Vector:
        """The units of z, lam and nu, each in the order of an OCP."""
        z, lam = np.ones(ocp.lower.size), np.ones(ocp.equality.size)
        z[ocp.states], z[ocp.inputs] = self.states, self.inputs
        lam[ocp.initial], lam[ocp.dynamics] = 1 / self.states, 1 / self.states
        lam[ocp.fixed_action] = 1 / self.inputs[: ocp.fixed_action.size]
        return np.concatenate([z, lam, 1 / z])

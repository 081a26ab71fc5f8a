"""A warning where a learned weight turns negative, and a cost bends downwards for it."""

import warnings

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.problem import Problem
from nmpcrl.control.solution import short

ROUNDING = 1e-9  # of a curvature, in parts of the largest


class Bending:
    """The curvature of a problem's costs in state and input, where it depends on theta."""

    def __init__(self, problem: Problem) -> None:
        e = problem.expressions
        z = ca.vertcat(e.x, e.u)
        bends = [ca.hessian(cost, z)[0] for cost in (e.stage, e.terminal)]
        weighs = np.array(ca.which_depends(ca.veccat(*bends), e.theta, 1), bool)
        self._problem = problem
        self._bends = ca.Function("bends", [e.x, e.u, e.theta, e.d], bends)
        self.least = np.where(weighs & (problem.theta > 0), 0.0, -np.inf)
        self.said: list[str] = []  # the warnings given

    def judge(self, state: Vector, theta: Vector, data: Matrix) -> None:
        """Warn if a cost bends downwards for the entries of theta below `least`.

        With their signs changed it must not bend down as much. An entry without a warning is judged
        again at twice its value, and never again after a warning.
        """
        of, fell = self._problem, theta < self.least
        self.least = np.where(fell, 2 * theta, self.least)
        now, before = (self._bends(state, of.still, one, of.own(data[0]))
                       for one in (theta, np.where(fell, -theta, theta)))  # fmt: skip
        for pair in zip(now, before, strict=True):
            bends = np.array([bend.full() for bend in pair])
            if not np.isfinite(bends).all():
                continue
            (found, *_), (other, *_) = np.linalg.eigvalsh(bends)
            if found < min(0.0, other) - ROUNDING * np.abs(bends).max():
                self.least = np.where(fell, -np.inf, self.least)
                self.said.append(
                    f"theta {of.names.marked(fell)} turned negative, and a cost of the plan bends"
                    f" downwards in state {short(state)}, so that a worst plan may be taken for"
                    " the best: write Parameter(start, lower=0), and learners keep it positive"
                )
                warnings.warn(self.said[-1], stacklevel=3)
                return

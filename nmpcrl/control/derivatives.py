"""Derivatives of the model and of the cost of reinforcement learning in state and input."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.expression import expression
from nmpcrl.control.nmpc import Nmpc
from nmpcrl.control.solution import Solution


class StageDerivatives:
    """f_y, l_y and l_yy with y = (x, u), of the model of an `Nmpc` and the cost of its environment.

    The cost of a task is Eq. (20), and l_yy the Hessian of the squares in it. That of a `Problem`
    is given: `cost` is a function (x, u) -> l in SX, or (x, u, d) where the problem has data.

    Raises:
        ValueError: there is no cost.
    """

    def __init__(self, nmpc: Nmpc, cost: Callable[..., Any] | None = None) -> None:
        self._problem, task = nmpc.problem, nmpc.task
        e, known = self._problem.expressions, self._problem.own_names
        y = ca.vertcat(e.x, e.u)
        if cost is not None:
            given = (e.x, e.u, *([known.symbols(e.d)] if known else []))
            symbols = {"x": e.x, "u": e.u, "d": e.d}
            squares = expression("cost", cost, given, symbols, 1, "number")
            slope = ca.jacobian(squares, y)
        elif task is None:
            raise ValueError("a Problem plans, and says nothing of the cost of its environment:"
                             " give cost=(x, u) -> l, in SX")  # fmt: skip
        else:
            squares = ca.dot(task.weights, (e.x - task.target) ** 2)
            charged = task.charge(nmpc.m)(e.x, e.u, ca.SX(0, 1))
            slope, n = ca.jacobian(charged, y), nmpc.n
            slope[n:] = ca.if_else(ca.sumsqr(e.u) > 0, slope[n:], 0)  # ||u|| has no slope at 0
        found = [ca.jacobian(e.next_x, y), slope, ca.hessian(squares, y)[0]]
        self._function = ca.Function("derivatives", [e.x, e.u, e.theta, e.d], found)

    def __call__(self, solution: Solution, action: Vector) -> tuple[Matrix, Vector, Matrix]:
        """In a solution's state and data, under its theta, with an action that was applied.

        Shapes (n, n + m), (n + m,) and (n + m, n + m).
        """
        given = solution.state, action, solution.theta, self._problem.own(solution.data[0])
        model, slope, curvature = (np.array(one.full()) for one in self._function(*given))
        return model, slope[0], curvature

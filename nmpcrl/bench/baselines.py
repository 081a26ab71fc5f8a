"""Baselines: Eq. (2) as it is commonly written with CasADi, twice, to be measured against.

`mx` keeps one NLP of matrix expressions, in which the dynamics are a called function; `rebuilt`
writes that NLP anew for every solve, as scripts do that put numbers into the model. Ipopt solves
both. A solve starts from the last plan, shifted by a stage, and from nothing else: multipliers and
Ipopt's options for them, which `Program` uses, are uncommon.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from nmpcrl import Matrix, Vector
from nmpcrl.control.nmpc import Nmpc
from nmpcrl.control.solution import SolverError
from nmpcrl.control.solvers.nlpsol import Ipopt
from nmpcrl.control.task import Theta, overlap, stage_cost, terminal_cost

OPTIONS: dict[str, Any] = {"print_time": False, "ipopt": Ipopt().options}


class Plan(NamedTuple):
    """What is found."""

    value: float  #: V_theta(s)
    features: Vector  #: its gradient in theta
    iterations: int
    variables: tuple[Matrix, ...]  #: states (n, N + 1), inputs (m, N) and slacks (M, N + 1)


Solve = Callable[[Vector, Vector, Plan | None], Plan]


def mx(nmpc: Nmpc) -> Solve:
    """A function of state, theta and the last plan that solves one NLP of matrix expressions."""
    plant, N = nmpc.plant, nmpc.horizon
    shapes = {"x": (plant.n, N + 1), "u": (plant.m, N), "sigma": (len(nmpc.task.obstacles), N + 1)}
    variables = [ca.MX.sym(name, *shape) for name, shape in shapes.items()]
    state, theta = ca.MX.sym("s", plant.n), ca.MX.sym("theta", nmpc.problem.theta.size)
    objective, equal, below = _written(nmpc, variables, state, theta)
    g, z, p = ca.vertcat(equal, below), ca.veccat(*variables), ca.vertcat(state, theta)
    solver = ca.nlpsol("mx", "ipopt", {"x": z, "p": p, "f": objective, "g": g}, OPTIONS)
    split = ca.Function("split", [z], variables)
    lower, upper = _bounds(nmpc, shapes)
    least = ca.vertcat(ca.DM.zeros(equal.numel()), -ca.inf * ca.DM.ones(below.numel()))
    bounds: dict[str, Any] = {"lbx": lower, "ubx": upper, "lbg": least, "ubg": 0}

    def solve(state: Vector, theta: Vector, last: Plan | None = None) -> Plan:
        if last is None:  # standing still
            x, *others = (np.zeros(shape) for shape in shapes.values())
            start = [x + state[:, None], *others]
        else:  # a stage later, the end twice
            start = [np.hstack([part[:, 1:], part[:, -1:]]) for part in last.variables]
        result = solver(x0=ca.veccat(*start), p=np.concatenate([state, theta]), **bounds)
        stats = solver.stats()
        if not stats["success"]:
            raise SolverError(stats["return_status"], state, theta)
        return Plan(
            float(result["f"]),
            -result["lam_p"].full().ravel()[plant.n :],
            int(stats["iter_count"]),
            tuple(part.full() for part in split(result["x"])),
        )

    return solve


def rebuilt(nmpc: Nmpc) -> Solve:
    """A function of state, theta and the last plan that writes the problem anew at every call."""
    return lambda state, theta, last: mx(nmpc)(state, theta, last)


def _written(
    nmpc: Nmpc, variables: list[Any], state: Any, theta: Any
) -> tuple[ca.MX, ca.MX, ca.MX]:
    """The objective, what is to be 0, and what is to be at most 0."""
    x, u, sigma = variables
    plant, task, N = nmpc.plant, nmpc.task, nmpc.horizon
    weights = Theta.split(theta, plant.n, plant.m)
    equal, below = [x[:, 0] - state], []
    discount = nmpc.gamma ** np.arange(N + 1)
    objective = discount[N] * terminal_cost(x[:, N], weights, task.target)
    for i in range(N):
        objective += discount[i] * stage_cost(x[:, i], u[:, i], weights, task.target)
        equal.append(x[:, i + 1] - plant.transition(x[:, i], u[:, i]))
    for j, disc in enumerate(zip(*task.discs, strict=True)):
        below.append(overlap(x[0, :], x[1, :], *disc) + weights.c - sigma[j, :])
        objective += nmpc.slack_weight * (sigma[j, :] @ discount)
    return objective, ca.vertcat(*equal), ca.veccat(*below)


def _bounds(nmpc: Nmpc, shapes: dict[str, tuple[int, int]]) -> Iterator[ca.DM]:
    """The least and the largest values of the variables; x_0 is free."""
    for box, inputs, slack, free in (
        (nmpc.task.lower, nmpc.plant.lower, 0.0, -np.inf),
        (nmpc.task.upper, nmpc.plant.upper, np.inf, np.inf),
    ):
        x, u, sigma = (np.zeros(shape) for shape in shapes.values())
        x += box[:, None]
        x[:, 0] = free
        yield ca.veccat(x, u + inputs[:, None], sigma + slack)

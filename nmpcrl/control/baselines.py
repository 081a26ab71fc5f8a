"""Baselines: Eq. (2) as it is commonly written with CasADi, twice, to be measured against.

`mx` keeps one NLP of matrix expressions, in which the dynamics are a called function; `rebuilt`
writes the problem anew for every solve, as scripts do that put numbers into the model. Ipopt solves
both. A solve starts from the last plan, shifted by a stage, and from nothing else: multipliers and
Ipopt's options for them, which `Program` uses, are uncommon.
"""

from collections.abc import Callable
from functools import partial
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

    value: float  # V_theta(s)
    features: Vector  # its gradient in theta
    iterations: int
    variables: tuple[Matrix, ...]  # states (n, N + 1), inputs (m, N) and slacks (M, N + 1)


Solve = Callable[[Vector, Vector, Plan | None], Plan]


def mx(nmpc: Nmpc) -> Solve:
    """A function of state, theta and the last plan that solves one NLP of matrix expressions."""
    variables = [ca.MX.sym(name, *shape) for name, shape in _shapes(nmpc).items()]
    n, m = nmpc.plant.n, nmpc.plant.m
    state, theta = ca.MX.sym("s", n), ca.MX.sym("theta", 2 * n + m + 1)
    objective, equal, below = _written(nmpc, variables, state, theta)
    z, p, g = ca.veccat(*variables), ca.vertcat(state, theta), ca.vertcat(equal, below)
    solver = ca.nlpsol("mx", "ipopt", {"x": z, "p": p, "f": objective, "g": g}, OPTIONS)
    lam = ca.MX.sym("lam", g.numel())
    slope = ca.gradient(objective + ca.dot(lam, g), theta)
    gradient = ca.Function("gradient", [z, p, lam], [slope])
    split = ca.Function("split", [z], variables)
    lower, upper = (ca.veccat(*side) for side in _bounds(nmpc))
    least = ca.vertcat(ca.DM.zeros(equal.numel()), -ca.inf * ca.DM.ones(below.numel()))
    bounds: dict[str, Any] = {"lbx": lower, "ubx": upper, "lbg": least, "ubg": 0}

    def solve(state: Vector, theta: Vector, last: Plan | None = None) -> Plan:
        p = np.concatenate([state, theta])
        result = solver(x0=ca.veccat(*_start(nmpc, state, last)), p=p, **bounds)
        stats = solver.stats()
        if not stats["success"]:
            raise SolverError(stats["return_status"], state, theta)
        return Plan(
            float(result["f"]),
            gradient(result["x"], p, result["lam_g"]).full().ravel(),
            int(stats["iter_count"]),
            tuple(part.full() for part in split(result["x"])),
        )

    return solve


def rebuilt(nmpc: Nmpc) -> Solve:
    """A function of state, theta and the last plan that writes the problem anew at every call."""
    return partial(_solve_rebuilt, nmpc)


def _solve_rebuilt(nmpc: Nmpc, state: Vector, theta: Vector, last: Plan | None = None) -> Plan:
    opti = ca.Opti()
    variables = [opti.variable(*shape) for shape in _shapes(nmpc).values()]
    weights = opti.parameter(theta.size)
    objective, equal, below = _written(nmpc, variables, state, weights)
    opti.minimize(objective)
    opti.subject_to(equal == 0)
    opti.subject_to(below <= 0)
    opti.set_value(weights, theta)
    for variable, start, *sides in zip(
        variables, _start(nmpc, state, last), *_bounds(nmpc), strict=True
    ):
        bounded = np.flatnonzero(np.isfinite(sides).any(axis=0).T)
        lower, upper = (side.T.ravel()[bounded] for side in sides)
        opti.subject_to(opti.bounded(lower, ca.vec(variable)[bounded.tolist()], upper))
        opti.set_initial(variable, start)
    opti.solver("ipopt", OPTIONS)
    try:
        found = opti.solve()
    except RuntimeError as error:
        raise SolverError(opti.return_status(), state, theta) from error
    slope = ca.gradient(opti.f + ca.dot(opti.lam_g, opti.g), weights)
    return Plan(
        float(found.value(opti.f)),
        np.ravel(found.value(slope)),
        int(found.stats()["iter_count"]),
        tuple(np.reshape(found.value(one), one.shape) for one in variables),
    )


def _shapes(nmpc: Nmpc) -> dict[str, tuple[int, int]]:
    """Rows and columns of the variables; a column a stage."""
    plant, N = nmpc.plant, nmpc.horizon
    return {"x": (plant.n, N + 1), "u": (plant.m, N), "sigma": (len(nmpc.task.obstacles), N + 1)}


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


def _bounds(nmpc: Nmpc) -> tuple[tuple[Matrix, ...], tuple[Matrix, ...]]:
    """The least and the largest values of the variables; x_0 is free."""
    sides = []
    for box, inputs, slack, sign in (
        (nmpc.task.lower, nmpc.plant.lower, 0.0, -1),
        (nmpc.task.upper, nmpc.plant.upper, np.inf, 1),
    ):
        states, actions, slacks = _shapes(nmpc).values()
        x = np.broadcast_to(box[:, None], states).copy()
        x[:, 0] = sign * np.inf
        sides.append((x, np.broadcast_to(inputs[:, None], actions), np.full(slacks, slack)))
    return sides[0], sides[1]


def _start(nmpc: Nmpc, state: Vector, last: Plan | None) -> tuple[Matrix, ...]:
    """The last plan a stage later, its end twice; or standing still."""
    if last is not None:
        return tuple(np.hstack([part[:, 1:], part[:, -1:]]) for part in last.variables)
    x, u, sigma = _shapes(nmpc).values()
    return np.broadcast_to(state[:, None], x), np.zeros(u), np.zeros(sigma)

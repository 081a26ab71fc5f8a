"""Rows that an engineer needs, soft and hard, against the same NLP written by hand in CasADi."""

from collections.abc import Callable
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from differences import agrees

from nmpcrl import Vector
from nmpcrl.control import Hard, Nmpc, Problem, Riccati, Series, Soft, Solution, SolverError

pytestmark = pytest.mark.usefixtures("interpreted")

N, GAMMA, T, W = 8, 0.97, 0.2, 20.0
CORNERS = np.array([[1.0, 0.2], [0.2, 1.0], [-1.0, 0.3]])  # outward normals of a polygon
SIDES = np.array([0.8, 0.9, 0.6])
MOVES = np.column_stack([np.sin(0.4 * np.arange(N + 1)), 0.5 * np.cos(0.4 * np.arange(N + 1))])
LAST = np.array([-1.0, 0.5])  # input


def drift(x: Any, u: Any, th: Any) -> Any:
    v = x[2:4]
    return ca.vertcat(x[:2] + T * v, v + T * (u - th["drag"] * v * ca.sqrt(ca.sumsqr(v) + 0.01)))


def point(**changes: Any) -> Problem:
    """A point that is pushed about a plane, with drag: (x, y, its velocity)."""
    fields = {
        "states": 4, "inputs": 2, "horizon": N, "gamma": GAMMA, "lower": -3.0, "upper": 3.0,
        "theta": {"drag": 0.3, "r": 0.05, "limit": 0.0},
        "model": drift,
        "stage": lambda x, u, th: ca.sumsqr(x[:2] - 1) + th["r"] * ca.sumsqr(u),
        "terminal": lambda x, th: 4 * ca.sumsqr(x[:2] - 1) + ca.sumsqr(x[2:4]),
    }  # fmt: skip
    return Problem(**fields | changes)


def by_hand(
    theta: Vector, near: Solution, rows: Callable[..., Any], moves: Any = 1.0, weight: Any = W
) -> Any:
    """(value, states, inputs) near a solution; a row has a slack that costs `weight`, or none."""
    opti = ca.Opti()
    x, u, drag, r = opti.variable(4, N + 1), opti.variable(2, N), theta[0], theta[1]
    target = np.broadcast_to(moves, (N + 1, 2))
    total: Any = 0
    opti.subject_to(x[:, 0] == near.state[:4])
    for i in range(N + 1):
        away = ca.sumsqr(x[:2, i] - target[i])
        if i < N:
            total += GAMMA**i * (away + r * ca.sumsqr(u[:, i]))
            opti.subject_to(x[:, i + 1] == drift(x[:, i], u[:, i], {"drag": drag}))
            opti.subject_to(opti.bounded(-3, u[:, i], 3))
        else:
            total += GAMMA**i * (4 * away + ca.sumsqr(x[2:, i]))
        for row in rows(i, x, u):
            slack = opti.variable() if weight else 0
            opti.subject_to(row + theta[2] <= slack)
            if weight:
                opti.subject_to(slack >= 0)
                total += GAMMA**i * weight * slack
    opti.minimize(total)
    quiet = {"print_level": 0, "sb": "yes", "tol": 1e-10, "bound_relax_factor": 0.0}
    opti.solver("ipopt", {"print_time": False, "ipopt": quiet})
    opti.set_initial(x, near.states[:, :4].T)
    opti.set_initial(u, near.inputs.T)
    found = opti.solve()
    return found.value(total), found.value(x).T, found.value(u).T


class Row(NamedTuple):
    """A row, the same by hand, and how far the solution is beyond it."""

    row: Callable[..., Any]  # as of `Soft`
    stages: Any
    hand: Callable[..., Any]  # (i, x, u) -> expressions
    state: Any
    beyond: Callable[[Solution], Any]
    more: dict[str, Any] = {}  # noqa: RUF012


def rate(x: Any, u: Any, th: Any) -> Any:
    """The last input is a state, and its rate a row of state and input."""
    return ca.vertcat(u - x[4:], x[4:] - u) - 0.6 + th["limit"]


def rates(i: int, x: Any, u: Any) -> Any:
    if i == N:
        return []
    change = u[:, i] - (LAST if i == 0 else u[:, i - 1])
    return ca.vertsplit(ca.vertcat(change, -change) - 0.6)


ROWS = {
    "an input's rate": Row(
        rate, None, rates, [0.0, -0.2, 0.3, 0.0, *LAST],
        lambda one: np.abs(np.diff(np.vstack([LAST, one.inputs]), axis=0)) - 0.6,
        {"states": 6, "model": lambda x, u, th: ca.vertcat(drift(x[:4], u, th), u)},
    ),
    "power, force times speed": Row(
        lambda x, u, th: ca.dot(u, x[2:]) - 1.0 + th["limit"], None,
        lambda i, x, u: [] if i == N else [ca.dot(u[:, i], x[2:, i]) - 1.0],
        [-0.5, -0.8, 0.4, 0.2],
        lambda one: (one.inputs * one.states[:-1, 2:]).sum(axis=1) - 1.0,
    ),
    "a terminal set": Row(
        lambda x, u, th: ca.sumsqr(x[2:]) - 0.04 + th["limit"], [-1],
        lambda i, x, u: [ca.sumsqr(x[2:, i]) - 0.04] if i == N else [],
        [-1.5, -0.3, 0.2, -0.1], lambda one: (one.states[-1:, 2:] ** 2).sum(axis=1) - 0.04,
    ),
    "a polygon, a row a side": Row(
        lambda x, u, th: ca.DM(CORNERS) @ x[:2] - SIDES + th["limit"], slice(1, None),
        lambda i, x, u: ca.vertsplit(ca.DM(CORNERS) @ x[:2, i] - SIDES) if i else [],
        [0.0, -1.0, 0.2, 0.5], lambda one: one.states[1:, :2] @ CORNERS.T - SIDES,
    ),
}  # fmt: skip


@pytest.mark.parametrize("hard", [False, True])
@pytest.mark.parametrize("name", ROWS)
def test_a_row_holds_as_by_hand(name, hard):
    row = ROWS[name]
    kept = {"hard": Hard(row.row, row.stages)} if hard else {"soft": Soft(row.row, W, row.stages)}
    problem = point(**row.more, **kept)
    nmpc, theta = Nmpc(problem, solver=Riccati(1e-11)), problem.theta
    solution = nmpc.solve(np.array(row.state), theta)
    value, states, inputs = by_hand(theta, solution, row.hand, weight=None if hard else W)
    assert solution.value == pytest.approx(value, abs=1e-6)
    np.testing.assert_allclose(solution.states[:, :4], states, atol=2e-4)
    np.testing.assert_allclose(solution.inputs, inputs, atol=2e-3)
    assert nmpc.kkt_residual(solution, relative=True) < 1e-7
    assert row.beyond(solution).max() == pytest.approx(0, abs=1e-6)  # it binds, and is kept to
    assert solution.violation <= 1e-6
    assert agrees(nmpc, solution, 2e-4)


def test_a_reference_may_move():
    """As data: in the problem, or given to each solve."""

    def following(start: Any) -> Problem:
        return point(
            stage=lambda x, u, th, d: ca.sumsqr(x[:2] - d["target"]) + th["r"] * ca.sumsqr(u),
            terminal=lambda x, th, d: 4 * ca.sumsqr(x[:2] - d["target"]) + ca.sumsqr(x[2:]),
            model=lambda x, u, th, d: drift(x, u, th) + th["limit"],
            data={"target": start},
        )

    state, problem = np.array([0.3, 0.4, 0.0, 0.5]), following(Series(MOVES))
    solution = Nmpc(problem, solver=Riccati(1e-11)).solve(state, problem.theta)
    value, states, _ = by_hand(problem.theta, solution, lambda i, x, u: [], moves=MOVES)
    assert solution.value == pytest.approx(value, abs=1e-6)
    np.testing.assert_allclose(solution.states, states, atol=2e-4)
    other = following(np.zeros(2))
    given = Nmpc(other, solver=Riccati(1e-11)).solve(state, other.theta, data={"target": MOVES})
    np.testing.assert_array_equal(given.point, solution.point)


def train(stages: Any, solver: str = "riccati") -> Nmpc:
    """A mass on a line, pushed by at most 1 and by 0.5 if it can, that has to stay left of 2."""
    problem = Problem(
        states=2, inputs=1, horizon=4, gamma=0.9, theta={"r": 0.1, "limit": 2.0},
        model=lambda x, u, th: [x[0] + x[1], x[1] + u], lower=-1.0, upper=1.0,
        stage=lambda x, u, th: (x[0] - 9) ** 2 + th["r"] * u**2,
        hard=[Hard(lambda x, u, th: x[0] - th["limit"], stages), Hard(lambda x, u, th: u - 0.5)],
    )  # fmt: skip
    return Nmpc(problem, solver=solver)


def test_where_hard_rows_cannot_all_hold_they_are_violated_least_and_said_to_be():
    """From 0 with a speed of 3 the mass is at 3, then 5 at best, where it was to be at 2."""
    nmpc, state = train(slice(2, None)), np.array([0.0, 3.0])
    solution = nmpc.solve(state, nmpc.problem.theta)
    np.testing.assert_allclose(solution.states[:4, 0], [0, 3, 5, 6], atol=1e-5)
    assert solution.violation == pytest.approx(4.0, abs=1e-5)
    stage = (solution.states[:-1, 0] - 9) ** 2 + 0.1 * solution.inputs[:, 0] ** 2
    assert solution.value == pytest.approx(0.9 ** np.arange(4) @ stage)  # the rows cost nothing
    for name in ("fatrop", "ipopt"):
        with pytest.raises(SolverError, match=name):
            train(slice(2, None), name).solve(state, nmpc.problem.theta)


def test_hard_rows_that_no_plan_can_change_do_not_count(solver):
    """Those of the first state, and of a first input that is given."""
    nmpc, state = train(None, solver), np.array([2.5, -0.6])
    for action in (None, np.array([0.6])):
        solution = nmpc.solve(state, nmpc.problem.theta, action=action)
        assert solution.violation <= 1e-6
        assert solution.states[1:, 0].max() == pytest.approx(2.0, abs=1e-5)
        assert solution.inputs[1:].max() <= 0.5 + 1e-6
        assert action is None or solution.action == pytest.approx(0.6)

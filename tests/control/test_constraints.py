"""Rows that an engineer needs, soft and hard, against the same NLP written by hand in CasADi."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from differences import agrees

from nmpcrl.control import Hard, Nmpc, Problem, Riccati, Series, Soft, Solution, SolverError

pytestmark = pytest.mark.usefixtures("interpreted")

N, GAMMA, T, W = 8, 0.97, 0.2, 20.0
CORNERS = np.array([[1.0, 0.2], [0.2, 1.0], [-1.0, 0.3]])  # outward normals of a polygon
SIDES = np.array([0.8, 0.9, 0.6])
DISC = np.column_stack([0.1 * np.arange(N + 1), 0.5 - 0.05 * np.arange(N + 1)])  # which moves
LAST = np.array([-1.0, 0.5])  # input
THETA = {"drag": 0.3, "r": 0.05, "limit": 0.0}


def drift(x: Any, u: Any, th: Any, d: Any) -> Any:
    v = x[2:4]
    return ca.vertcat(x[:2] + T * v, v + T * (u - th["drag"] * v * ca.sqrt(ca.sumsqr(v) + 0.01)))


def stage(x: Any, u: Any, th: Any, d: Any) -> Any:
    return ca.sumsqr(x[:2] - d["target"]) + th["r"] * ca.sumsqr(u)


def terminal(x: Any, th: Any, d: Any) -> Any:
    return 4 * ca.sumsqr(x[:2] - d["target"]) + ca.sumsqr(x[2:4])


def point(target: Any = (1.0, 1.0), **changes: Any) -> Problem:
    """A point that is pushed about a plane, with drag: (x, y, its velocity)."""
    fields = {
        "states": 4, "inputs": 2, "horizon": N, "gamma": GAMMA, "lower": -3.0, "upper": 3.0,
        "theta": THETA, "model": drift, "stage": stage, "terminal": terminal,
        "data": {"target": target, "discs": Series(DISC[:, None])},
    }  # fmt: skip
    return Problem(**fields | changes)


class Row(NamedTuple):
    """A row, where it holds, a state before it, and fields of its problem."""

    row: Callable[..., Any]  # as of `Soft`
    stages: Iterable[int]
    state: Any
    more: dict[str, Any] = {}  # noqa: RUF012
    each: str | None = None


def by_hand(near: Solution, one: Row, targets: Any, weight: float | None = W) -> Any:
    """(value, states, inputs) near a solution; a row has a slack that costs `weight`, or none."""
    opti = ca.Opti()
    x, u, at = opti.variable(near.state.size, N + 1), opti.variable(2, N), [*one.stages]
    total: Any = GAMMA**N * terminal(x[:, N], THETA, {"target": targets[N]})
    opti.subject_to(x[:, 0] == near.state)
    opti.subject_to(opti.bounded(-3, ca.vec(u), 3))
    for i in range(N):
        given = x[:, i], u[:, i], THETA, {"target": targets[i]}
        total += GAMMA**i * stage(*given)
        opti.subject_to(x[:, i + 1] == one.more.get("model", drift)(*given))
    for i in at:
        row = one.row(x[:, i], u[:, i] if i < N else None, THETA, {"discs": DISC[i]})
        slack = opti.variable(row.numel()) if weight else 0
        opti.subject_to(row <= slack)
        if weight:
            opti.subject_to(slack >= 0)
            total += GAMMA**i * weight * ca.sum1(slack)
    opti.minimize(total)
    quiet = {"print_level": 0, "sb": "yes", "tol": 1e-10, "bound_relax_factor": 0.0}
    opti.solver("ipopt", {"print_time": False, "ipopt": quiet})
    opti.set_initial(x, near.states.T)
    opti.set_initial(u, near.inputs.T)
    found = opti.solve()
    return found.value(total), found.value(x).T, found.value(u).T


ROWS = {
    "an input's rate, where the last input is a state": Row(
        lambda x, u, th, d: ca.vertcat(u - x[4:], x[4:] - u) - 0.6 + th["limit"],
        range(N), [0.0, -0.2, 0.3, 0.0, *LAST],
        {"states": 6, "model": lambda x, u, th, d: ca.vertcat(drift(x, u, th, d), u)},
    ),
    "power, force times speed": Row(
        lambda x, u, th, d: ca.dot(u, x[2:]) - 1.0 + th["limit"], range(N), [-0.5, -0.8, 0.4, 0.2],
    ),
    "a terminal set": Row(
        lambda x, u, th, d: ca.sumsqr(x[2:]) - 0.04 + th["limit"], [N], [-1.5, -0.3, 0.2, -0.1],
    ),
    "a polygon, a row a side": Row(
        lambda x, u, th, d: ca.DM(CORNERS) @ x[:2] - SIDES + th["limit"],
        range(1, N + 1), [0.0, -1.0, 0.2, 0.5],
    ),
    "a disc that moves": Row(
        lambda x, u, th, d: 0.16 - ca.sumsqr(x[:2] - d["discs"]) + th["limit"],
        range(1, N + 1), [-0.5, -0.3, 0.2, 0.1], each="discs",
    ),
}  # fmt: skip
KEPT = [(name, hard) for hard in (False, True) for name in ROWS if not (hard and ROWS[name].each)]


@pytest.mark.parametrize(("name", "hard"), KEPT)
def test_a_row_holds_as_by_hand(name, hard):
    one = ROWS[name]
    at = [*one.stages]
    kept = {"hard": Hard(one.row, at)} if hard else {"soft": Soft(one.row, W, at, one.each)}
    problem = point(**one.more, **kept)
    nmpc = Nmpc(problem, solver=Riccati(1e-11))
    solution = nmpc.solve(np.array(one.state), problem.theta)
    value, states, inputs = by_hand(solution, one, np.ones((N + 1, 2)), None if hard else W)
    assert solution.value == pytest.approx(value, abs=1e-6)
    np.testing.assert_allclose(solution.states, states, atol=2e-4)
    np.testing.assert_allclose(solution.inputs, inputs, atol=2e-3)
    assert nmpc.kkt_residual(solution, relative=True) < 1e-7
    x, u = solution.states, [*solution.inputs, None]
    beyond = [float(ca.mmax(ca.DM(one.row(x[i], u[i], THETA, {"discs": DISC[i]})))) for i in at]
    assert max(beyond) == pytest.approx(0, abs=1e-6)  # it binds, and is kept to
    assert solution.violation <= 1e-6
    assert agrees(nmpc, solution, 2e-4)


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

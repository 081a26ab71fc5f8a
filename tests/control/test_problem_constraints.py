"""Constraints and references that a practitioner has, against an NLP that is written by hand.

Rates of an input, rows of state and input, a terminal set, polygons, references that move; and the
kinematic bicycle.
"""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

from nmpcrl import Vector
from nmpcrl.control import Nmpc, Problem, Riccati, Series, Soft, Solution

pytestmark = pytest.mark.usefixtures("interpreted")

N, GAMMA, T, W = 8, 0.97, 0.2, 20.0
CORNERS = np.array([[1.0, 0.2], [0.2, 1.0], [-1.0, 0.3]])  # outward normals of a polygon
SIDES = np.array([0.8, 0.9, 0.6])
MOVES = np.column_stack([np.sin(0.4 * np.arange(N + 1)), 0.5 * np.cos(0.4 * np.arange(N + 1))])


def point(**changes) -> Problem:
    """A point that is pushed about a plane, with drag: (x, y, its velocity)."""
    fields = {
        "states": 4,
        "inputs": 2,
        "horizon": N,
        "gamma": GAMMA,
        "theta": {"drag": 0.3, "r": 0.05, "limit": 0.0},
        "model": drift,
        "stage": lambda x, u, th: ca.sumsqr(x[:2] - 1) + th["r"] * ca.sumsqr(u),
        "terminal": lambda x, th: 4 * ca.sumsqr(x[:2] - 1) + ca.sumsqr(x[2:4]),
        "lower": -3.0,
        "upper": 3.0,
    }
    return Problem(**fields | changes)


def drift(x: Any, u: Any, th: Any) -> Any:
    v = x[2:4]
    return ca.vertcat(x[:2] + T * v, v + T * (u - th["drag"] * v * ca.sqrt(ca.sumsqr(v) + 0.01)))


def by_hand(theta: Vector, near: Solution, rows: Callable[..., Any], moves: Any = 1.0) -> Any:
    """(value, states, inputs) near a solution; every row h has a slack that costs W."""
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
            slack = opti.variable()
            opti.subject_to(slack >= 0)
            opti.subject_to(row + theta[2] <= slack)
            total += GAMMA**i * W * slack
    opti.minimize(total)
    quiet = {"print_level": 0, "sb": "yes", "tol": 1e-10, "bound_relax_factor": 0.0}
    opti.solver("ipopt", {"print_time": False, "ipopt": quiet})
    opti.set_initial(x, near.states[:, :4].T)
    opti.set_initial(u, near.inputs.T)
    found = opti.solve()
    return found.value(total), found.value(x).T, found.value(u).T


def agrees(problem: Problem, state: Vector, rows: Callable[..., Any], **data: Any) -> Solution:
    """One solve held against the hand-written NLP, and all its derivatives against others."""
    nmpc, theta = Nmpc(problem, solver=Riccati(1e-11)), problem.theta
    solution = nmpc.solve(state, theta)
    value, states, inputs = by_hand(theta, solution, rows, **data)
    assert solution.value == pytest.approx(value, abs=1e-6)
    np.testing.assert_allclose(solution.states[:, :4], states, atol=2e-4)
    np.testing.assert_allclose(solution.inputs, inputs, atol=2e-3)
    assert nmpc.kkt_residual(solution, relative=True) < 1e-7
    step, along = 1e-5, np.array([1.0, -2.0, 0.5])
    sides = [
        [nmpc.solve(state, theta + s * step * e, solution) for s in (1, -1)]
        for e in np.eye(theta.size)
    ]
    slope = [(a.value - b.value) / (2 * step) for a, b in sides]
    np.testing.assert_allclose(solution.features, slope, atol=1e-5)
    policy = np.transpose([(a.action - b.action) / (2 * step) for a, b in sides])
    np.testing.assert_allclose(nmpc.policy_jacobian(solution), policy, atol=1e-3)
    hessian = np.transpose([(a.features - b.features) / (2 * step) for a, b in sides])
    product, size = nmpc.value_hessian_times(solution, along), np.abs(hessian).max()
    np.testing.assert_allclose(product, hessian @ along, atol=2e-4 * size)
    dense = nmpc.value_hessian(solution)
    np.testing.assert_allclose(product, dense @ along, atol=1e-4 * np.abs(dense).max())
    return solution


def test_an_input_may_only_change_so_fast():
    """The last input becomes a state, and its rate a row of state and input."""

    def rate(x, u, th):
        return ca.vertcat(u - x[4:], x[4:] - u) - 0.6 + th["limit"]

    problem = point(
        states=6,
        model=lambda x, u, th: ca.vertcat(drift(x[:4], u, th), u),
        soft=[Soft(rate, weight=W)],
    )
    last = np.array([-1.0, 0.5])

    def rows(i, x, u):
        if i == N:
            return []
        change = u[:, i] - (last if i == 0 else u[:, i - 1])
        return ca.vertsplit(ca.vertcat(change, -change) - 0.6)

    solution = agrees(problem, np.array([0.0, -0.2, 0.3, 0.0, *last]), rows)
    changes = np.abs(np.diff(np.vstack([last, solution.inputs]), axis=0))
    assert changes.max() == pytest.approx(0.6, abs=1e-6)  # and it binds


def test_a_row_may_mix_state_and_input():
    """Power: force times speed."""
    rows = [Soft(lambda x, u, th: ca.dot(u, x[2:]) - 1.0 + th["limit"], weight=W)]

    def power(i, x, u):
        return [] if i == N else [ca.dot(u[:, i], x[2:, i]) - 1.0]

    solution = agrees(point(soft=rows), np.array([-0.5, -0.8, 0.4, 0.2]), power)
    powers = (solution.inputs * solution.states[:-1, 2:]).sum(axis=1)
    assert powers.max() == pytest.approx(1.0, abs=1e-5)


def test_a_terminal_set_is_a_row_of_the_last_stage():
    rows = [Soft(lambda x, u, th: ca.sumsqr(x[2:]) - 0.04 + th["limit"], weight=W, stages=[-1])]

    def slow(i, x, u):
        return [ca.sumsqr(x[2:, i]) - 0.04] if i == N else []

    solution = agrees(point(soft=rows), np.array([-1.5, -0.3, 0.2, -0.1]), slow)
    assert (solution.states[-1, 2:] ** 2).sum() == pytest.approx(0.04, abs=1e-6)


def test_a_polygon_is_a_row_a_side():
    """Half-planes a'x <= b; the target lies outside two of them."""
    rows = [Soft(lambda x, u, th: ca.DM(CORNERS) @ x[:2] - SIDES + th["limit"], weight=W)]

    def inside(i, x, u):
        return [] if i == 0 else ca.vertsplit(ca.DM(CORNERS) @ x[:2, i] - SIDES)

    solution = agrees(point(soft=rows), np.array([0.0, -1.0, 0.2, 0.5]), inside)
    beyond = solution.states[1:, :2] @ CORNERS.T - SIDES
    assert beyond.max() < 1e-6
    assert np.isclose(beyond, 0, atol=1e-6).any()


def test_a_reference_may_move():
    """As data: in the problem, or given to each solve."""

    def following(start):
        return point(
            stage=lambda x, u, th, d: ca.sumsqr(x[:2] - d["target"]) + th["r"] * ca.sumsqr(u),
            terminal=lambda x, th, d: 4 * ca.sumsqr(x[:2] - d["target"]) + ca.sumsqr(x[2:]),
            model=lambda x, u, th, d: drift(x, u, th) + th["limit"],
            data={"target": start},
        )

    state = np.array([0.3, 0.4, 0.0, 0.5])
    solution = agrees(following(Series(MOVES)), state, lambda i, x, u: [], moves=MOVES)
    other = following(np.zeros(2))
    given = Nmpc(other, solver=Riccati(1e-11)).solve(state, other.theta, data={"target": MOVES})
    np.testing.assert_array_equal(given.point, solution.point)


def bicycle() -> Problem:
    """A kinematic bicycle at 10 m/s on a curved lane, with its wheelbase learned."""

    def path(x, u, th):
        slip = ca.atan(0.5 * ca.tan(u[1]))
        return ca.vertcat(
            x[0] + 0.1 * x[3] * ca.cos(x[2] + slip),
            x[1] + 0.1 * x[3] * ca.sin(x[2] + slip),
            x[2] + 0.1 * x[3] / th["wheelbase"] * ca.sin(slip),
            x[3] + 0.1 * u[0],
        )

    def off(x, th):
        return x[1] - th["bend"] * x[0] ** 2

    return Problem(
        states=4,
        inputs=2,
        horizon=20,
        theta={"wheelbase": 2.6, "bend": 0.004, "speed": 10.0, "q": np.array([1.0, 0.1, 5.0])},
        model=path,
        stage=lambda x, u, th: (
            th["q"][0] * off(x, th) ** 2
            + th["q"][1] * (x[3] - th["speed"]) ** 2
            + th["q"][2] * u[1] ** 2
            + 0.1 * u[0] ** 2
        ),
        terminal=lambda x, th: 10 * off(x, th) ** 2,
        soft=[Soft(lambda x, u, th: x[3] * u[1] - 1.5, weight=100.0)],
        lower=[-6.0, -0.5],
        upper=[3.0, 0.5],
    )


@pytest.mark.parametrize("cost", [1.0, 1e4, 1e-4])
def test_the_relative_residual_of_a_bicycle_is_small_whatever_its_cost_is_worth(cost):
    problem = bicycle()
    plain = Nmpc(problem, solver=Riccati(1e-9))
    state, theta = np.array([0.0, 1.5, 0.2, 8.0]), problem.theta
    solution = plain.solve(state, theta)
    assert plain.kkt_residual(solution, relative=True) < 1e-7
    e = problem.expressions
    along = np.linspace(-1, 1, theta.size)
    dense = plain.value_hessian(solution)
    product = plain.value_hessian_times(solution, along)
    np.testing.assert_allclose(product, dense @ along, atol=1e-4 * np.abs(dense).max())
    at = ca.Function("at", [e.x, e.u, e.theta], [e.next_x, e.stage, e.terminal, e.fixed])
    dear = Problem(
        states=4,
        inputs=2,
        horizon=20,
        theta={"all": theta},
        model=lambda x, u, th: at(x, u, th["all"])[0],
        stage=lambda x, u, th: cost * at(x, u, th["all"])[1],
        terminal=lambda x, th: cost * at(x, ca.SX.zeros(2), th["all"])[2],
        soft=[Soft(lambda x, u, th: at(x, u, th["all"])[3], weight=cost * 100.0)],
        lower=problem.lower,
        upper=problem.upper,
    )
    nmpc = Nmpc(dear, solver=Riccati(1e-9))
    other = nmpc.solve(state, theta)
    assert nmpc.kkt_residual(other, relative=True) < 1e-7
    assert other.value == pytest.approx(cost * solution.value, rel=1e-7)
    np.testing.assert_allclose(other.states, solution.states, atol=1e-4)

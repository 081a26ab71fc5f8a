"""Derivatives where more is active than the inputs can follow: of one side, and the same by all."""

from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Nmpc, Problem, Soft, SolverError
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.study import paper
from nmpcrl.study.drawn import JUDGE

# min u' diag(q) u / 2 - g' u + b' P u with A u + S b + o <= 0 at a price of 100, and u <= 1
PROBLEM = Problem(
    states=2, inputs=2, horizon=1, theta={"b": np.zeros(3)}, model=lambda x, u, th, d: u,
    data={"q": np.full(2, 2.0), "g": np.zeros(2), "P": np.zeros((3, 2)),
          "A": np.zeros((3, 2)), "S": np.zeros((3, 3)), "o": -np.ones(3)},
    stage=lambda x, u, th, d: ca.dot(d["q"], u**2) / 2 - ca.dot(d["g"], u) + th["b"].T @ d["P"] @ u,
    soft=[Soft(lambda x, u, th, d: d["A"] @ u + d["S"] @ th["b"] + d["o"], 100.0, stages=0)],
    lower=-5.0, upper=1.0,
)  # fmt: skip


class Case(NamedTuple):
    """A problem, and at b what is true in the first parameters."""

    b: list
    rows: list  # of (A, S), each A u + S b <= 0
    policy: list  # du/db where b grows, the last of its parameters most
    hessian: list  # d2V/db2 there
    slopes: list  # of V, on both sides, a parameter
    cost: dict = {}  # noqa: RUF012


CASES = {
    "u^2 with u >= a and u >= b, both 0.5": Case(
        [0.5, 0.5], [([-1, 0], [1, 0, 0]), ([-1, 0], [0, 1, 0])],
        [[0, 1], [0, 0]], [[0, 0], [0, 2]], [[0, 1], [0, 1]],
    ),
    "(u - 2)^2 with u <= b and the bound, both 1": Case(
        [1], [([1, 0], [-1, 0, 0])], [[0], [0]], [[0]], [[-2, 0]], {"g": [4, 0]},
    ),
    "u^2 with u >= b = 1 against the bound": Case(
        [1], [([-1, 0], [1, 0, 0])], [[0], [0]], [[0]], [[2, 100]],
    ),
    "-u_0 - 2 u_1 with u_0 + u_1 <= b = 2 and bounds: a corner without curvature": Case(
        [2], [([1, 1], [-1, 0, 0])], [[0], [0]], [[0]], [[-1, 0]], {"q": [0, 0], "g": [1, 2]},
    ),
    "-u_0 - 2 u_1 with u_0 + u_1 <= 4 - b = 2, where only the side of growth moves": Case(
        [2], [([1, 1], [1, 0, 0])], [[-1], [0]], [[0]], [[0, 1]], {"q": [0, 0], "g": [1, 2],
                                                                  "o": [-4, -1, -1]},
    ),
    "u^2 with u >= b = 0.5, twice: no kink, though multipliers are not unique": Case(
        [0.5], [([-1, 0], [1, 0, 0])] * 2, [[1], [0]], [[2]], [[1, 1]],
    ),
}  # fmt: skip


def solved(case, solver):
    """The controller and its solution."""
    A, S, o = np.zeros((3, 2)), np.zeros((3, 3)), -np.ones(3)
    for k, row in enumerate(case.rows):
        (A[k], S[k]), o[k] = row, 0.0
    nmpc, theta = Nmpc(PROBLEM, solver=solver), np.zeros(3)
    theta[: len(case.b)] = case.b
    data = {"A": A, "S": S, "o": o} | {name: np.array(one) for name, one in case.cost.items()}
    return nmpc, nmpc.solve(np.zeros(2), theta, data=data)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("name", CASES)
def test_at_a_kink_derivatives_are_those_of_the_side_where_theta_grows(name, solver):
    case = CASES[name]
    nmpc, one = solved(case, solver)
    used = len(case.b)
    for slope, (below, above) in zip(one.features, case.slopes, strict=False):
        assert below - 1e-3 <= slope <= above + 1e-3
    np.testing.assert_allclose(nmpc.policy_jacobian(one)[:, :used], case.policy, atol=1e-5)
    np.testing.assert_allclose(nmpc.value_hessian(one)[:used, :used], case.hessian, atol=1e-4)
    for k in range(used):
        found = nmpc.value_hessian_times(one, np.eye(3)[k])[:used]
        np.testing.assert_allclose(found, case.hessian[k], atol=1e-4)


@pytest.mark.parametrize("solver", SOLVERS)
def test_without_a_derivative_the_error_is_that_of_a_solve(solver):
    """The cost pulls at u_0 in proportion to b_0, which is 0, and nothing but bounds holds it."""
    pulled = {"q": [0, 2], "P": [[1, 0], [0, 0], [0, 0]]}
    nmpc, one = solved(Case([0], [], [], [], [], pulled), solver)
    for ask in (
        nmpc.value_hessian, nmpc.policy_jacobian,
        lambda at: nmpc.value_hessian_times(at, np.ones(3)),
    ):  # fmt: skip
        with pytest.raises(SolverError, match="no curvature"):
            ask(one)
    nmpc, one = solved(Case([0], [], [], [], [], {"q": [0, 2]}), solver)
    np.testing.assert_allclose(nmpc.policy_jacobian(one), 0, atol=1e-6)  # nothing pulls at it


@pytest.mark.parametrize("solver", SOLVERS)
def test_between_two_discs_the_hessian_is_the_slope_of_the_gradient_where_theta_grows(solver):
    """Of the robot at the end of a gap, where rows of many stages depend on one another."""
    nmpc, rng, side = paper.nmpc(JUDGE["J002"], solver=solver), np.random.default_rng(0), 1e-5
    theta = np.array([1.5332, 0.9758, 0.0499, 0.0497, 0.05, 1.0375, 0.9992, 0.1, 0.1834])
    grown = np.linspace(1, 2, theta.size)
    asked = 0
    for state in rng.normal([0.7531, 1.1584, -0.7766], [0.02, 0.02, 0.05], (12, 3)):
        try:
            one = nmpc.solve(state, theta)
        except SolverError:
            continue
        expected = nmpc.value_hessian_times(one, grown)
        near, far = (nmpc.solve(state, theta + k * side * grown, one).features for k in (1, 2))
        allowed = 0.03 * np.abs(expected).max()
        np.testing.assert_allclose((far - near) / side, expected, rtol=0, atol=allowed)
        asked += 1
    assert asked > 8

"""Weights of rows and bounds of inputs that are parameters, beside the same ones as numbers."""

import casadi as ca
import numpy as np
import pytest
from small_problems import pendulum

from nmpcrl.control import Hard, Nmpc, Soft

pytestmark = pytest.mark.usefixtures("interpreted")
STATES = np.array([[1.1, 0.9], [-1.0, -0.8]])  # plans from both violate rows and reach bounds


def learned(**theta) -> dict:
    return {"theta": {"rate": 1.3, "damping": 0.2, "Q": np.eye(2), "r": 0.2, "limit": [0.2, 0.9],
                      "offset": 0.5} | theta}  # fmt: skip


def row(x, u, th, d):
    return [x[1] - th["limit"][0], -x[1] - th["limit"][0]]


def bound(x, u, th, d):
    return ca.vertcat(u - th["most"], -u - th["most"])


PAIRS = {  # parameter: the problem with it, and without
    "price": (
        {"soft": Soft(row, weight=lambda th: th["price"] ** 2)} | learned(price=2.0),
        {"soft": Soft(row, weight=4.0)} | learned(),
    ),
    "most": (
        {"hard": Hard(bound), "soft": ()} | learned(most=0.6),
        {"lower": -0.6, "upper": 0.6, "soft": ()} | learned(),
    ),
}


@pytest.mark.parametrize("solver", ["riccati", "fatrop"])
@pytest.mark.parametrize("name", PAIRS)
def test_a_learned_number_does_what_the_number_does_and_has_its_gradient(name, solver):
    free, given = (Nmpc(pendulum(**fields), solver=solver) for fields in PAIRS[name])
    theta = free.problem.theta
    for state in STATES:
        solution, known = free.solve(state, theta), given.solve(state, given.problem.theta)
        assert solution.value == pytest.approx(known.value, rel=1e-6)
        np.testing.assert_allclose(solution.inputs, known.inputs, atol=1e-4)
        step = 1e-4 * free.problem.names.filled(0 * theta, {name: 1.0})
        ahead, behind = (free.solve(state, theta + k * step, solution).value for k in (1, -1))
        slope = free.problem.split(solution.features)[name]
        assert slope == pytest.approx((ahead - behind) / 2e-4, rel=1e-3)
        assert abs(slope) > 0.01


def test_the_cost_of_a_stage_has_the_learned_price():
    problem = pendulum(**PAIRS["price"][0])
    dearer = problem.cost([0, 0.5], [0], problem.vector(price=3.0)) - problem.cost([0, 0.5], [0])
    assert dearer == pytest.approx((9 - 4) * 0.3)

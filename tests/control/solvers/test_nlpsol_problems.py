"""CasADi's solvers on problems that tempt them to stop early: each has its plan in closed form."""

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Nmpc, Problem, Soft, Status

of_casadi = pytest.mark.parametrize("solver", ["fatrop", "ipopt"])


def store(act, soft=()):
    """A store that leaks half and is charged by act(u); wherever it is, a step fills it."""
    return Problem(
        states=1, inputs=1, horizon=3, gamma=0.9, theta={"target": 2.0},
        model=lambda x, u, th: 0.5 * x + act(u), stage=lambda x, u, th: (x - th["target"]) ** 2,
        terminal=lambda x, th: (x - th["target"]) ** 2, lower=-3.0, upper=3.0, soft=soft,
    )  # fmt: skip


@of_casadi
@pytest.mark.parametrize("act", [ca.fabs, lambda u: u**2, lambda u: 2 - 2 * ca.cos(u)])
@pytest.mark.parametrize("soft", [(), [Soft(lambda x, u, th: x - 50.0)]])
def test_no_plan_stays_at_a_maximum(solver, act, soft):
    """At u = 0 nothing changes the store to first order; the value there is 13.76."""
    nmpc = Nmpc(store(act, soft), solver=solver)
    empty = nmpc.solve(np.zeros(1), np.zeros(1))
    assert empty.value == pytest.approx(0.0, abs=1e-6)
    for warm_start in (None, empty):
        assert nmpc.solve(np.zeros(1), np.full(1, 2.0), warm_start).value == pytest.approx(4.0)


@of_casadi
@pytest.mark.parametrize(
    ("cost", "price"), [(1, 0.5), (1, 2.5), *((1, 10.0**k) for k in range(3, 13)), (1e-9, 1e-9),
                        (1e-9, 1.0), (1e-6, 1e-3), (1e6, 1e9), (1e9, 1e9)]
)  # fmt: skip
def test_prices_and_costs_may_be_of_any_size(solver, cost, price):
    """min cost (u - 2)^2 + price max(0, u - 1): up to 1 costs no more than 2 cost a unit."""
    problem = Problem(
        states=1, inputs=1, horizon=1, theta={"goal": 2.0, "most": 1.0},
        model=lambda x, u, th: u, stage=lambda x, u, th: cost * (u - th["goal"]) ** 2,
        soft=[Soft(lambda x, u, th: x - th["most"], weight=price, stages=-1)], lower=-5, upper=5,
    )  # fmt: skip
    u = max(1.0, 2 - price / cost / 2)
    one = Nmpc(problem, solver=solver).solve(np.zeros(1), problem.theta)
    np.testing.assert_allclose(one.action, u, atol=1e-6)
    assert one.value == pytest.approx(cost * (u - 2) ** 2 + price * (u - 1), rel=1e-6)
    slope = 2 * cost * (2 - u)
    np.testing.assert_allclose(one.features, [slope, -slope], rtol=1e-5)


def test_where_fatrop_finds_no_plan_ipopt_takes_over_and_is_named():
    """From -2 fatrop makes 27 iterations, the last 16 of them at the optimum."""
    problem = Problem(
        states=1, inputs=1, horizon=1, gamma=0.7, theta={"a": 0.8, "least": 0.2},
        model=lambda x, u, th: th["a"] * x + ca.sin(u), terminal=lambda x, th: 5 * x**2,
        stage=lambda x, u, th: x**2 + (0.3 * u + 0.1) * u, lower=-1.5, upper=1.0,
        soft=[Soft(lambda x, u, th: th["least"] - x, weight=2.0),
              Soft(lambda x, u, th: u - 0.4 + x * th["least"], weight=3.0, stages=0)],
    )  # fmt: skip
    fatrop, ipopt = (Nmpc(problem, solver=name) for name in ("fatrop", "ipopt"))
    taken_over = 0
    for state in np.linspace(-2.0, 2.0, 21):
        one, other = (nmpc.solve(np.array([state]), problem.theta) for nmpc in (fatrop, ipopt))
        assert one.value == pytest.approx(other.value, rel=1e-6)
        assert one.status == (Status.SOLVED if one.solver == "fatrop" else Status.TAKEN_OVER)
        taken_over += one.solver == "ipopt"
    assert 0 < taken_over < 21

"""No plan depends on its units: pascals, micrometres and kelvins are solved as numbers near 1."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from small_problems import tank

from nmpcrl.control import Fatrop, Ipopt, Nmpc, Problem, Riccati, Soft

pytestmark = pytest.mark.usefixtures("interpreted")

STATE, SOLVERS = np.array([0.5, 1.0]), (Riccati(1e-10), Fatrop(1e-9), Ipopt(1e-10))
each = pytest.mark.parametrize("solver", SOLVERS, ids=lambda one: one.name)


def numbers(nmpc: Nmpc, unit: float, row: float, cost: float) -> dict[str, np.ndarray]:
    """All that a controller of a tank says, in parts of its units."""
    theta = nmpc.problem.theta
    first = nmpc.solve(STATE * unit, theta)
    given = nmpc.solve(STATE * unit, theta, first, np.array([0.7 * unit]))
    later = nmpc.solve(given.states[1], theta, given)
    above = nmpc.solve(np.array([1.5, 1.0]) * unit, theta, first)  # beyond the row
    assert above.slacks[1, 0] > 0.01 * row
    found = {}
    for name, one in (("first", first), ("given", given), ("later", later), ("above", above)):
        m, force = one.multipliers, unit / cost
        product = nmpc.value_hessian_times(one, np.array([1.0, 0.5, -1.0]))
        parts = {
            "value": one.value / cost, "gradient": one.features / cost, "slacks": one.slacks / row,
            "states": one.states / unit, "inputs": one.inputs / unit,
            "costates": m.dynamics * force, "initial": m.initial * force,
            "bounds": m.inputs * force, "fixed": m.action * force, "rows": m.obstacles * row / cost,
            "policy": nmpc.policy_jacobian(one) / unit,
            "product": product / cost, "Hessian": nmpc.value_hessian(one) / cost,
        }  # fmt: skip
        found |= {f"{name} {part}": value for part, value in parts.items()}
        off = replace(one, point=1.01 * one.point)
        assert nmpc.kkt_residual(one, relative=True) < 1e-6 < nmpc.kkt_residual(off, relative=True)
    return found


@pytest.fixture(scope="module")
def plain() -> dict[str, dict[str, np.ndarray]]:
    """The numbers of the tank in units near 1, by solver; found once."""
    return {}


@each
@pytest.mark.parametrize(
    "units",
    [(1e5, 1, 1), (1e-6, 1, 1), (1e12, 1, 1), (1, 1e-3, 1), (1, 1e-8, 1), (1, 1e6, 1),
     (1, 1, 1e-9), (1, 1, 1e-6), (1, 1, 1e-3), (1, 1, 1e6)],
)  # fmt: skip
def test_the_plan_in_other_units_is_the_same_plan(solver, units, plain):
    """Units of states and inputs, of a row, whose price at 1e-8 takes digits, and of the costs."""
    if solver.name not in plain:
        plain[solver.name] = numbers(Nmpc(tank(1.0), solver=solver), 1.0, 1.0, 1.0)
    other = numbers(Nmpc(tank(*units), solver=solver), *units)
    allowed = {"rtol": 1e-4, "atol": 1e-5} if units[1] < 1 else {"rtol": 2e-5, "atol": 2e-6}
    for name, expected in plain[solver.name].items():
        np.testing.assert_allclose(other[name], expected, **allowed, err_msg=name)


def test_sizes_may_be_said_and_are_found_where_they_are_extreme():
    np.testing.assert_array_equal(tank(1.0).sizes[0], [1, 1])
    np.testing.assert_array_equal(tank(300.0).sizes[0], [1, 1])  # kelvins are solved as they are
    np.testing.assert_array_equal(tank(1e-6).sizes[0], [2.0**-22, 2.0**-22])
    np.testing.assert_array_equal(tank(1.0, scale=[2.0**-10, 1024]).sizes[0], [2.0**-10, 1024])
    plain, scaled = (Nmpc(tank(1.0, **said)) for said in ({}, {"scale": [3.0, 0.2]}))
    one, other = (nmpc.solve(STATE, nmpc.problem.theta) for nmpc in (plain, scaled))
    np.testing.assert_allclose(other.states, one.states, atol=1e-6)
    assert plain.key != scaled.key
    for wrong in ([1.0, 2.0, 3.0], 0.0, [1.0, np.inf], -1):
        with pytest.raises(ValueError, match=r"scale = .* must hold 2 positive numbers, one a st"):
            tank(1.0, scale=wrong)


@each
@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e-7, 1e5])
@pytest.mark.parametrize("of", ["a state of that unit", "a state", "an input"])
def test_on_which_side_of_a_row_a_start_lies_does_not_depend_on_its_unit(solver, unit, of):
    """dV/dm has the price where h is 1e-4 units; where it is 0, as `ties_active` says."""
    size, given = (unit if "that unit" in of else 1.0), of == "an input"
    problem = Problem(
        states=1, inputs=1, horizon=3, theta={"m": 0.5}, lower=-1.0, upper=1.0, scale=size,
        model=lambda x, u, th: x + size * u,
        stage=lambda x, u, th: ca.sumsqr(x / size) + ca.sumsqr(u),
        soft=[Soft(lambda x, u, th: unit * (th["m"] - (u if given else x / size)),
                   weight=10.0 / unit, stages=[0])],
    )  # fmt: skip
    nmpcs = [Nmpc(problem, solver=solver, ties_active=active) for active in (False, True)]
    for beyond, prices in ((1e-4, (10.0, 10.0)), (0.0, (0.0, 10.0)), (-1e-4, (0.0, 0.0))):
        start = np.array([0.5 - beyond])
        asked = size * start, problem.theta, None, start if given else None
        one, other = (nmpc.solve(*asked) for nmpc in nmpcs)
        assert one.value == other.value
        np.testing.assert_array_equal(one.primal, other.primal)
        for nmpc, found, price in zip(nmpcs, (one, other), prices, strict=True):
            assert found.features == pytest.approx(price)
            assert nmpc.kkt_residual(found, relative=True) < 1e-6

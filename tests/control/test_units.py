"""No plan depends on its units: pascals, micrometres and kelvins are solved as numbers near 1."""

import pickle
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from small_problems import tank

from nmpcrl.control import Fatrop, Ipopt, Nmpc, Problem, Riccati, Soft, SolverError
from nmpcrl.control.solvers import stages

pytestmark = pytest.mark.usefixtures("interpreted")

STATE, SOLVERS = np.array([0.5, 1.0]), (Riccati(1e-10), Fatrop(1e-9), Ipopt(1e-10))
each = pytest.mark.parametrize("solver", SOLVERS, ids=lambda one: one.name)


def numbers(nmpc: Nmpc, unit: float) -> dict[str, np.ndarray]:
    """All that a controller says of a problem, in parts of the unit."""
    theta = nmpc.problem.theta
    first = nmpc.solve(STATE * unit, theta)
    given = nmpc.solve(STATE * unit, theta, first, np.array([0.7 * unit]))
    later = nmpc.solve(given.states[1], theta, given)
    found = {}
    for name, one in (("first", first), ("given", given), ("later", later)):
        m, plan = one.multipliers, nmpc.plan_jacobian(one, 5)
        parts = {
            "value": one.value, "gradient": one.features, "slacks": one.slacks,
            "states": one.states / unit, "inputs": one.inputs / unit,
            "costates": m.dynamics * unit, "initial": m.initial * unit, "rows": m.obstacles,
            "bounds": m.inputs * unit, "fixed": m.action * unit,
            "policy": nmpc.policy_jacobian(one) / unit,
            "plan": plan.states / unit, "plan of inputs": plan.inputs / unit,
            "curvature": nmpc.value_hessian_times(one, np.array([1.0, 0.5, -1.0])),
        }  # fmt: skip
        found |= {f"{name} {part}": value for part, value in parts.items()}
        assert nmpc.kkt_residual(one, relative=True) < 1e-6
    return found


@each
@pytest.mark.parametrize("unit", [1e5, 1e-6, 1e12])
def test_the_plan_in_other_units_is_the_same_plan(solver, unit):
    plain = numbers(Nmpc(tank(1.0), solver=solver), 1.0)
    other = numbers(Nmpc(tank(unit), solver=solver), unit)
    for name, expected in plain.items():
        np.testing.assert_allclose(other[name], expected, rtol=2e-5, atol=2e-6, err_msg=name)


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


def test_a_copy_of_a_problem_in_extreme_units_solves_alike():
    nmpc = Nmpc(tank(1e-6))
    copied = pickle.loads(pickle.dumps(nmpc))
    one, other = (each.solve(STATE * 1e-6, nmpc.problem.theta) for each in (nmpc, copied))
    np.testing.assert_array_equal(one.point, other.point)
    warm = copied.solve(STATE * 1e-6, nmpc.problem.theta, one)
    assert warm.value == pytest.approx(one.value, rel=1e-7)


def test_an_error_names_the_state_in_its_own_units():
    stage = {"stage": lambda x, u, th: th["k"] * ca.log(x[0] - 1e9) + 1e-10 * u**2}
    nmpc = Nmpc(tank(1e5, **stage), solver="ipopt")
    with pytest.raises(SolverError, match=r"in state \[ 50000. 100000.\]"):
        nmpc.solve(STATE * 1e5, nmpc.problem.theta)


def test_a_parameter_may_be_as_large_as_it_starts():
    """The frequency of an Arrhenius law is 7.2e10 a minute."""
    problem = tank(
        1.0,
        theta={"k": 7.2e10, "target": np.array([1.3, 1.2])},
        stage=lambda x, u, th: ca.sumsqr(x - th["k"] / 7.2e10) + ca.sumsqr(u),
        model=lambda x, u, th: x + 0.1 * ca.vertcat(u - th["k"] * ca.exp(-25.0) * x[0], -x[1]),
        terminal=None,
    )
    assert Nmpc(problem).solve(STATE, problem.theta).value > 0
    with pytest.raises(ValueError, match=r"theta .* of size at most 7.2e\+13"):
        Nmpc(problem).solve(STATE, problem.theta * 1e4)


@each
@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e-7, 1e5])
@pytest.mark.parametrize("of", ["a state of that unit", "a state", "an input"])
def test_on_which_side_of_a_row_a_start_lies_does_not_depend_on_its_unit(solver, unit, of):
    """dV/dm has the price where h is 0.4 units; where it is 0, as `ties_active` says."""
    size, given = (unit if "that unit" in of else 1.0), of == "an input"
    problem = Problem(
        states=1, inputs=1, horizon=3, theta={"m": 0.5}, lower=-1.0, upper=1.0, scale=size,
        model=lambda x, u, th: x + size * u,
        stage=lambda x, u, th: ca.sumsqr(x / size) + ca.sumsqr(u),
        soft=[Soft(lambda x, u, th: unit * (th["m"] - (u if given else x / size)),
                   weight=10.0 / unit, stages=[0])],
    )  # fmt: skip
    for active in (False, True):
        nmpc = Nmpc(problem, solver=solver, ties_active=active)
        for beyond, price in ((0.4, 10.0), (0.0, 10.0 * active), (-0.4, 0.0)):
            start = np.array([0.5 - beyond])
            found = nmpc.solve(size * start, problem.theta, action=start if given else None)
            assert found.features == pytest.approx(price)


@each
@pytest.mark.parametrize("unit", [1e-3, 1e-7, 1e6])
def test_rows_of_any_unit_are_solved_alike(solver, unit):
    """A tolerance of 1e-8 is nothing to a row of metres, and all that there is to one of 1e-7."""

    def solved(unit):
        problem = Problem(
            states=1, inputs=1, horizon=3, theta={"m": 0.5}, lower=-1.0, upper=1.0,
            model=lambda x, u, th: x + u, stage=lambda x, u, th: ca.sumsqr(x) + ca.sumsqr(u),
            soft=Soft(lambda x, u, th: unit * (th["m"] - x[0]), weight=10.0 / unit),
        )  # fmt: skip
        nmpc = Nmpc(problem, solver=solver)
        for state in ([0.1], [-0.7]):
            one = nmpc.solve(np.array(state), problem.theta)
            yield one.value, one.features, nmpc.value_hessian(one), nmpc.policy_jacobian(one)
            yield one.states, one.slacks / unit, one.multipliers.obstacles * unit
            assert nmpc.kkt_residual(one) < 1e-4

    for one, other in zip(solved(1.0), solved(unit), strict=True):
        for expected, found in zip(one, other, strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)


@each
@pytest.mark.parametrize("unit", [1e-9, 1e-6, 1e-3, 1e6])
def test_derivatives_do_not_depend_on_the_unit_of_the_cost(solver, unit):
    """Of a cart that reaches its bounds and a row, or neither."""

    def charged(unit):
        problem = Problem(
            states=2, inputs=1, horizon=30, theta={"q": np.ones(2), "r": 0.3, "wind": 0.1},
            model=lambda x, u, th, d: ca.vertcat(
                x[0] + 0.1 * x[1], x[1] + 0.1 * u + 0.01 * th["wind"]
            ),
            stage=lambda x, u, th, d: d["unit"] * (
                ca.sumsqr(th["q"] * (x - 1)) + th["r"] * ca.sumsqr(u)
            ),
            terminal=lambda x, th, d: d["unit"] * 10 * ca.sumsqr(x - 1),
            soft=[Soft(lambda x, u, th, d: x[1] - 0.6, weight=5.0 * unit)],
            lower=-1.0, upper=1.0, data={"unit": unit},
        )  # fmt: skip
        return Nmpc(problem, solver=solver)

    one, nmpc = charged(1.0), charged(unit)
    for state in ([0.0, 0.0], [0.9, 0.2]):
        plan, found = (each.solve(state, each.problem.theta) for each in (one, nmpc))
        assert found.value == pytest.approx(unit * plan.value, rel=1e-6)
        dense = one.value_hessian(plan)
        for asked, at, share in ((one, plan, 1.0), (nmpc, found, 1 / unit)):
            products = [asked.value_hessian_times(at, k) for k in np.eye(4)]
            for bends in (asked.value_hessian(at), np.array(products)):
                np.testing.assert_allclose(share * bends, dense, atol=1e-3 * np.abs(dense).max())
        policy = one.policy_jacobian(plan)
        np.testing.assert_allclose(nmpc.policy_jacobian(found), policy, rtol=1e-3, atol=1e-5)
        off = replace(found, point=1.01 * found.point)
        assert nmpc.kkt_residual(found, relative=True) < 1e-6
        assert nmpc.kkt_residual(off, relative=True) > 1e-6


def test_another_horizon_or_discount_takes_no_other_code():
    first, *others = (
        stages.write(tank(1e-6, horizon=horizon, gamma=gamma).solved)
        for horizon, gamma in ((8, 0.95), (40, 0.95), (40, 0.5), (1, 1.0))
    )
    assert others == 3 * [first]

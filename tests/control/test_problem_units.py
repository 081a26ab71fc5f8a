"""No plan depends on its units: pascals, micrometres and kelvins are solved as numbers near 1."""

import pickle
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Fatrop, Ipopt, Nmpc, Problem, Riccati, Soft, SolverError
from nmpcrl.control.solvers import problem_stages

pytestmark = pytest.mark.usefixtures("interpreted")

STATE, UNITS = np.array([0.5, 1.0]), (1e5, 1e-6, 1e12)
SOLVERS = (Riccati(1e-10), Fatrop(1e-9), Ipopt(1e-10))


def tank(unit: float, **changes) -> Problem:
    """A pressure and a temperature in any unit; the costs and rows have none."""

    def model(x, u, th):
        pressure = x[0] + 0.1 * (-th["k"] * x[0] + u + 0.1 * unit * ca.sin(x[1] / unit))
        return ca.vertcat(pressure, x[1] + 0.1 * (0.2 * x[0] - (x[1] - unit)))

    def away(x, th):
        return ca.sumsqr(x / unit - th["target"])

    fields = {
        "states": 2,
        "inputs": 1,
        "horizon": 8,
        "gamma": 0.95,
        "theta": {"k": 0.3, "target": np.array([1.3, 1.2])},
        "model": model,
        "stage": lambda x, u, th: away(x, th) + 0.01 * ca.sumsqr(u / unit),
        "terminal": lambda x, th: 5 * away(x, th),
        "soft": [Soft(lambda x, u, th: x[0] / unit - 1.2, weight=2.0)],
        "lower": -unit,
        "upper": 2 * unit,
    }
    return Problem(**fields | changes)


def numbers(nmpc: Nmpc, unit: float) -> dict[str, np.ndarray]:
    """All that a controller says of a problem, in parts of the unit."""
    theta = nmpc.problem.theta
    first = nmpc.solve(STATE * unit, theta)
    given = nmpc.solve(STATE * unit, theta, first, np.array([0.7 * unit]))
    later = nmpc.solve(given.states[1], theta, given)
    found = {}
    for name, one in (("first", first), ("given", given), ("later", later)):
        m, plan = one.multipliers, nmpc.plan_jacobian(one, 5)
        found |= {
            f"{name} value": one.value,
            f"{name} gradient": one.features,
            f"{name} states": one.states / unit,
            f"{name} inputs": one.inputs / unit,
            f"{name} slacks": one.slacks,
            f"{name} costates": m.dynamics * unit,
            f"{name} multipliers": m.obstacles,
            f"{name} bounds": m.inputs * unit,
            f"{name} fixed": m.action * unit,
            f"{name} initial": m.initial * unit,
            f"{name} policy": nmpc.policy_jacobian(one) / unit,
            f"{name} plan": plan.states / unit,
            f"{name} plan of inputs": plan.inputs / unit,
            f"{name} curvature": nmpc.value_hessian_times(one, np.array([1.0, 0.5, -1.0])),
        }
        assert nmpc.kkt_residual(one, relative=True) < 1e-6
    return found


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda one: one.name)
@pytest.mark.parametrize("unit", UNITS)
def test_the_plan_in_other_units_is_the_same_plan(solver, unit):
    plain = numbers(Nmpc(tank(1.0), solver=solver), 1.0)
    other = numbers(Nmpc(tank(unit), solver=solver), unit)
    for name, expected in plain.items():
        np.testing.assert_allclose(other[name], expected, rtol=2e-5, atol=2e-6, err_msg=name)


@pytest.mark.parametrize("unit", UNITS)
def test_derivatives_in_other_units_are_finite_differences(unit):
    nmpc = Nmpc(tank(unit), solver=Riccati(1e-11))
    theta, state = nmpc.problem.theta, STATE * unit
    solution, step = nmpc.solve(state, theta), 1e-5
    sides = [
        [nmpc.solve(state, theta + sign * step * e, solution) for sign in (1, -1)]
        for e in np.eye(theta.size)
    ]
    slope = [(a.value - b.value) / (2 * step) for a, b in sides]
    np.testing.assert_allclose(solution.features, slope, rtol=1e-5, atol=1e-6)
    states = [(a.states[6] - b.states[6]) / (2 * step) for a, b in sides]
    jacobian = nmpc.plan_jacobian(solution, 6)
    np.testing.assert_allclose(jacobian.states, np.transpose(states), atol=1e-4 * unit)


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
    nmpc = Nmpc(
        tank(1e5, stage=lambda x, u, th: th["k"] * ca.log(x[0] - 1e9) + 1e-10 * u**2),
        solver="ipopt",
    )
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


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda one: one.name)
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


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda one: one.name)
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


@pytest.fixture(scope="module", params=SOLVERS, ids=lambda one: one.name)
def charged(request):
    """A cart that reaches its bounds and a row, and the same of costs in any unit."""

    def controller(unit):
        problem = Problem(
            states=2, inputs=1, horizon=60, theta={"q": np.ones(2), "r": 0.3, "wind": 0.1},
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
        return Nmpc(problem, solver=request.param)

    return controller


@pytest.mark.parametrize("unit", [1e-9, 1e-6, 1e-3, 1e6])
@pytest.mark.parametrize("state", [(0.0, 0.0), (0.9, 0.2)])
def test_derivatives_do_not_depend_on_the_unit_of_the_cost(charged, unit, state):
    (one, plan), (nmpc, found) = (
        (each, each.solve(state, each.problem.theta)) for each in (charged(1.0), charged(unit))
    )
    size = np.abs(one.value_hessian(plan)).max()
    for asked, share in ((one, 1.0), (nmpc, 1 / unit)):
        at = plan if asked is one else found
        many = [asked.value_hessian_times(at, k) for k in np.eye(4)]
        for bends in (asked.value_hessian(at), many):
            np.testing.assert_allclose(
                share * np.array(bends), one.value_hessian(plan), atol=1e-3 * size
            )
    np.testing.assert_allclose(
        nmpc.policy_jacobian(found), one.policy_jacobian(plan), rtol=1e-3, atol=1e-5
    )
    off = replace(found, point=1.01 * found.point)
    assert nmpc.kkt_residual(found, relative=True) < 1e-6 < nmpc.kkt_residual(off, relative=True)


def test_another_horizon_or_discount_takes_no_other_code():
    first, *others = (
        problem_stages.write(tank(1e-6, horizon=horizon, gamma=gamma).solved)
        for horizon, gamma in ((8, 0.95), (40, 0.95), (40, 0.5), (1, 1.0))
    )
    assert others == 3 * [first]

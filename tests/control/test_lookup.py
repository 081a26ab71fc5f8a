"""Tables in a model: `lookup` against CasADi's own interpolation, and in a plan."""

import pickle

import casadi as ca
import numpy as np
import pytest
from differences import agrees

from nmpcrl.control import Ipopt, Nmpc, Problem, Riccati, lookup

POINTS = np.array([0.0, 0.4, 1.0, 1.5, 2.5, 3.0, 4.0])
VALUES = np.array([1.0, 1.6, 1.1, 0.4, 0.9, 2.0, 2.2])
GENTLE = np.array([0.2, 0.25, 0.35, 0.4, 0.55, 0.6, 0.8])


def written(cubic: bool) -> ca.Function:
    x = ca.SX.sym("x")
    table = lookup(POINTS, VALUES, x, cubic=cubic)
    return ca.Function("table", [x], [table, ca.jacobian(table, x)])


@pytest.mark.parametrize(("cubic", "kind"), [(False, "linear"), (True, "bspline")])
def test_values_and_slopes_are_those_of_casadis_interpolant(cubic, kind):
    theirs, ours = ca.interpolant("theirs", kind, [POINTS], VALUES), written(cubic)
    slope = theirs.jacobian()
    for x in np.random.default_rng(1).uniform(0, 4, 200):
        value, slopes = (float(one) for one in ours(x))
        assert value == pytest.approx(float(theirs(x)), abs=1e-10)
        assert slopes == pytest.approx(float(slope(x, 0)), abs=1e-8)


def test_the_last_piece_of_a_line_goes_on():
    value, slope = written(cubic=False)(6.0)
    assert float(slope) == pytest.approx(0.2)
    assert float(value) == pytest.approx(2.6)


def heater(table, **parameters) -> Problem:
    """A temperature whose losses stand in a table."""
    return Problem(
        states=1, inputs=1, horizon=6, theta={"gain": 0.8, **parameters}, lower=-1.0, upper=5.0,
        model=lambda x, u, th: x + 0.2 * (th["gain"] * u - table(x, th)),
        stage=lambda x, u, th: (x - 2) ** 2 + 0.1 * u**2,
        terminal=lambda x, th: 4 * (x - 2) ** 2,
    )  # fmt: skip


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize(
    "problem",
    [
        heater(lambda x, th: lookup(POINTS, VALUES, x, cubic=True)),
        heater(lambda x, th: lookup(POINTS, GENTLE, x)),
        heater(lambda x, th: lookup(POINTS, th["losses"], x), losses=GENTLE),
    ],
    ids=["cubic", "linear", "learned"],
)
def test_a_plan_through_a_table_has_all_its_derivatives(problem):
    riccati, ipopt = (Nmpc(problem, solver=how) for how in (Riccati(1e-11), Ipopt(1e-10)))
    ours, theirs = (one.solve(np.array([0.7]), problem.theta) for one in (riccati, ipopt))
    assert ours.value == pytest.approx(theirs.value, abs=1e-6)
    assert agrees(riccati, ours, 1e-4)


def test_what_is_no_table_is_refused():
    x = ca.SX.sym("x")
    for points, values in (([0, 0], [1, 2]), ([0], [1]), ([0, 1], [1, 2, 3]), ([1, 0], [0, 1])):
        with pytest.raises(ValueError, match="a table must have 2 ascending points or more"):
            lookup(points, values, x)
    with pytest.raises(ValueError, match="a table must have 4 ascending points"):
        lookup([0, 1, 2], [0, 1, 0], x, cubic=True)


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize(("cubic", "kind"), [(False, "linear"), (True, "bspline")])
def test_casadis_interpolant_is_solved_by_fatrop_and_said_not_to_compile(cubic, kind):
    table = ca.interpolant("table", kind, [POINTS], GENTLE)
    state, problem = np.array([0.7]), heater(lambda x, th: table(x))
    with pytest.warns(
        UserWarning, match=r"write lookup\(points, values, x\): fatrop solves instead"
    ):
        slow = Nmpc(problem).solve(state, problem.theta)
    ours = heater(lambda x, th: lookup(POINTS, GENTLE, x, cubic=cubic))
    fast = Nmpc(ours).solve(state, ours.theta)
    assert fast.value == pytest.approx(slow.value, abs=1e-6)
    np.testing.assert_allclose(fast.states, slow.states, atol=1e-4)
    copied = pickle.loads(pickle.dumps(problem))
    assert copied.key == problem.key
    steep = ca.interpolant("table", kind, [POINTS], VALUES)
    assert heater(lambda x, th: steep(x)).key != problem.key

"""Tables in a model: CasADi's `pw_lin` compiles, and its `interpolant` does not."""

import pickle

import casadi as ca
import numpy as np
import pytest
from differences import agrees

from nmpcrl.control import Ipopt, Nmpc, Problem, Riccati

POINTS = np.array([0.0, 0.4, 1.0, 1.5, 2.5, 3.0, 4.0])
LOSSES = np.array([0.2, 0.25, 0.35, 0.4, 0.55, 0.6, 0.8])
STATE = np.array([0.7])

pytestmark = pytest.mark.usefixtures("interpreted")


def heater(table, **parameters) -> Problem:
    """A temperature whose losses stand in a table."""
    return Problem(
        states=1, inputs=1, horizon=6, theta={"gain": 0.8, **parameters}, lower=-1.0, upper=5.0,
        model=lambda x, u, th: x + 0.2 * (th["gain"] * u - table(x, th)),
        stage=lambda x, u, th: (x - 2) ** 2 + 0.1 * u**2,
        terminal=lambda x, th: 4 * (x - 2) ** 2,
    )  # fmt: skip


def test_a_learned_table_has_all_derivatives_and_casadis_interpolant_is_fatrops():
    problem = heater(lambda x, th: ca.pw_lin(x, POINTS, th["losses"]), losses=LOSSES)
    riccati, ipopt = (Nmpc(problem, solver=how) for how in (Riccati(1e-11), Ipopt(1e-10)))
    ours, theirs = (one.solve(STATE, problem.theta) for one in (riccati, ipopt))
    assert ours.value == pytest.approx(theirs.value, abs=1e-6)
    assert agrees(riccati, ours, 1e-4)
    table = ca.interpolant("table", "linear", [POINTS], LOSSES)
    problem = heater(lambda x, th: table(x))
    with pytest.warns(UserWarning, match=r"write ca.pw_lin\(x, .*\): fatrop solves instead"):
        slow = Nmpc(problem).solve(STATE, problem.theta)
    written = heater(lambda x, th: ca.pw_lin(x, POINTS, LOSSES))
    fast = Nmpc(written).solve(STATE, written.theta)
    assert fast.value == pytest.approx(slow.value, abs=1e-6)
    np.testing.assert_allclose(fast.states, slow.states, atol=1e-4)
    assert pickle.loads(pickle.dumps(problem)).key == problem.key
    steep = ca.interpolant("table", "linear", [POINTS], 2 * LOSSES)
    assert heater(lambda x, th: steep(x)).key != problem.key

"""A solver is a value: its options are checked, its name finds it, and it can be compared."""

import numpy as np
import pytest

from nmpcrl.control import Fatrop, Ipopt, Nmpc, Riccati, differential_drive
from nmpcrl.control.solvers import SOLVERS, TOLERANCE, solver_of
from nmpcrl.study import paper


@pytest.mark.parametrize("kind", SOLVERS.values())
@pytest.mark.parametrize("tolerance", [0.0, -1e-8, 9e-13, 0.011, np.nan])
def test_a_tolerance_out_of_range_is_refused_by_every_solver(kind, tolerance):
    allowed = r"must lie in \[1e-12, 0.01\]$"
    with pytest.raises(ValueError, match=f"^tolerance = {tolerance} {allowed}"):
        kind(tolerance=tolerance)


def test_a_name_stands_for_the_solver_with_its_defaults():
    named = {name: solver_of(name) for name in SOLVERS}
    assert named == {"riccati": Riccati(), "fatrop": Fatrop(), "ipopt": Ipopt()}
    assert {solver.tolerance for solver in named.values()} == {TOLERANCE}
    assert all(solver.name == name for name, solver in named.items())


def test_a_solver_that_is_given_is_taken_as_it_is():
    solver = Ipopt(tolerance=1e-5)
    assert Nmpc(differential_drive(), paper.task(), solver=solver).solver is solver
    assert solver != Ipopt()
    assert solver != Fatrop(tolerance=1e-5)


def test_the_default_is_the_solver_of_this_package():
    assert Nmpc(differential_drive(), paper.task()).solver == Riccati()


@pytest.mark.parametrize("unknown", ["acados", "Riccati", "", None, 3])
def test_an_unknown_solver_is_refused_with_what_is_allowed(unknown):
    with pytest.raises(ValueError, match=r"^solver = .* must be one of riccati, fatrop, ipopt$"):
        Nmpc(differential_drive(), paper.task(), solver=unknown)

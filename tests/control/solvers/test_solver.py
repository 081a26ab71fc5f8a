"""A solver is a value: its options are checked, its name finds it, and it can be compared."""

import numpy as np
import pytest

from nmpcrl.control import Fatrop, Ipopt, Riccati
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
    assert paper.nmpc().solver == Riccati()
    solver = Ipopt(tolerance=1e-5)
    assert paper.nmpc(solver=solver).solver is solver
    assert solver not in (Ipopt(), Fatrop(tolerance=1e-5))

"""Time against the horizon: what is counted and fitted, never how fast this machine is."""

import numpy as np
import pandas as pd
import pytest

from nmpcrl.bench.scaling import exponents, time_horizons
from nmpcrl.control import Nmpc, SolverError
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
STATES = [np.array(paper.START), np.array([8.0, 2.0, 1.0])]


@pytest.fixture(scope="module")
def timings() -> pd.DataFrame:
    return time_horizons(STATES, THETA, horizons=(3, 5), repetitions=1)


def test_there_is_a_row_for_every_state_horizon_and_solver(timings):
    found = list(zip(timings.state, timings.horizon, timings.solver, strict=True))
    solvers = ("fatrop", "riccati")
    assert found == [(s, n, name) for s in (0, 1) for n in (3, 5) for name in solvers]


def test_the_solvers_find_the_same_values(timings):
    values = timings.pivot(index=["state", "horizon"], columns="solver", values="value")
    assert values.riccati.to_numpy() == pytest.approx(values.fatrop.to_numpy(), rel=1e-6)


def test_a_solve_is_its_iterations_times_the_time_of_each(timings):
    assert (timings.us_per_iteration * timings.iterations / 1e3).to_numpy() == pytest.approx(
        timings.ms.to_numpy()
    )


def test_a_solve_that_fails_leaves_a_row_without_numbers(monkeypatch):
    solve = Nmpc.solve

    def failing(self, state, theta):
        if self.solver.name == "fatrop" and state[0] > 0:
            raise SolverError("no", state, theta)
        return solve(self, state, theta)

    monkeypatch.setattr(Nmpc, "solve", failing)
    timings = time_horizons(STATES, THETA, horizons=(3,), repetitions=1)
    assert list(np.isnan(timings.ms)) == [False, False, True, False]


def test_growth_is_the_exponent_of_a_power_law_and_skips_what_is_missing():
    horizons = np.repeat([5, 10, 20], 2)
    law = {"riccati": 3.0 * horizons**1.0, "fatrop": 0.1 * horizons**1.5}
    timings = pd.concat(
        pd.DataFrame({"solver": name, "horizon": horizons, "ms": ms}) for name, ms in law.items()
    )
    timings.iloc[0, timings.columns.get_loc("ms")] = np.nan
    assert exponents(timings, "ms") == pytest.approx({"riccati": 1.0, "fatrop": 1.5})

"""The solver run by Python: the same iterates as machine code, seen from within."""

import numpy as np
import pytest
from small_problems import pendulum

from nmpcrl.control import Nmpc, Riccati
from nmpcrl.control.solvers import TOLERANCE
from nmpcrl.report.trace import trace
from nmpcrl.study import paper
from nmpcrl.study.problems import gros_zanon

BUSY = np.array([-0.6, 1.4, -0.4])  # in front of an obstacle
NMPC, THETA = paper.nmpc(solver=Riccati(starts=1)), np.array(paper.THETA_INIT)


@pytest.mark.parametrize("state", [BUSY, [-2.5, 1.5, 0.0], [0.5, 1.5, 0.0]], ids=str)
@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_the_last_iterate_is_the_solution_of_the_machine_code(state, factor):
    """In a scaled problem and inside an obstacle too."""
    last_is_the_solution(NMPC, np.array(state), np.append(factor * THETA[:8], THETA[8]))


def last_is_the_solution(nmpc, state, theta, data=None):
    """Hold a trace to a solve, and return both."""
    solution = nmpc.solve(state, theta, data=data)
    iterates = trace(nmpc.ocp, state, theta, data=nmpc.problem.stage_data(data))
    assert solution.restarts == 0
    assert len(iterates) == solution.iterations + 1
    assert iterates.value.iloc[-1] == pytest.approx(solution.value, rel=1e-9)
    assert iterates.error.iloc[-1] < TOLERANCE < iterates.error.iloc[0]
    return solution, iterates


def test_mu_falls_and_the_error_reaches_the_tolerance_later_without_curvature():
    cold = trace(NMPC.ocp, BUSY, THETA)
    assert (np.diff(cold.mu) <= 0).all()
    assert (cold.error >= cold.mu).all()
    assert (cold.error <= TOLERANCE).tolist() == [False] * (len(cold) - 1) + [True]
    assert np.isnan(cold.delta).tolist() == [False] * (len(cold) - 1) + [True]
    assert cold.delta.max() > 0  # which some first step needs, and the last does not
    assert cold.delta.iloc[-2] == 0
    cold, straight = (trace(NMPC.ocp, BUSY, THETA, curvature=how) for how in (True, False))
    assert straight.delta.max() == 0
    assert len(straight) > 3 * len(cold)
    if straight.error.iloc[-1] <= TOLERANCE:
        assert straight.value.iloc[-1] == pytest.approx(cold.value.iloc[-1], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "state", "data", "curved"),
    [
        (pendulum(scale=1e-4), [1.0, 0.8], {"wind": -0.1}, True),
        (gros_zanon.problem(), [-0.1, 0.2], {"undiscounted": np.ones(11)}, False),
    ],
    ids=["pendulum in units, with a cost of the state alone", "Gros and Zanon"],
)
def test_any_problem_is_traced(problem, state, data, curved):
    nmpc, state, theta = Nmpc(problem, solver=Riccati(starts=1)), np.array(state), problem.theta
    solution, iterates = last_is_the_solution(nmpc, state, theta, data)
    known = problem.stage_data(data)
    straight = trace(nmpc.ocp, state, theta, data=known, curvature=False)
    assert straight.value.iloc[-1] == pytest.approx(solution.value, rel=1e-6)
    assert np.allclose(straight.value[2], iterates.value[2], rtol=1e-9) != curved
    assert len(trace(nmpc.ocp, state, theta, solution, data=known)) < len(iterates)

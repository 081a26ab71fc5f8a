"""The solver run by Python: the same iterates as machine code, seen from within."""

import numpy as np
import pytest

from nmpcrl.control import Nmpc, Problem, Soft
from nmpcrl.control.solvers import TOLERANCE
from nmpcrl.control.solvers.codes import End
from nmpcrl.control.solvers.riccati import InteriorPoint, machine_code
from nmpcrl.control.solvers.trace import interpreted, trace
from nmpcrl.study import paper
from nmpcrl.study.problems import gros_zanon

BUSY = np.array([-0.6, 1.4, -0.4])  # in front of an obstacle


@pytest.fixture(scope="module")
def nmpc():
    return paper.nmpc()


@pytest.fixture(scope="module")
def theta():
    return np.array(paper.THETA_INIT)


@pytest.fixture(scope="module")
def cold(nmpc, theta):
    return trace(nmpc.ocp, BUSY, theta)


def stopped(nmpc, state, theta, limit: int) -> tuple[float, float]:
    """Value and error of the machine code's cold start after so many iterations."""
    reached, code = [], machine_code(nmpc.plant)

    def limited(*arguments):
        *most, start, _, tolerance, point, out = arguments
        value, iterations, _, violation, error = code.solve(
            *most, start, limit, tolerance, point, out
        )
        reached.append((value, error))
        return value, iterations, End.SOLVED, violation, error

    InteriorPoint(nmpc.ocp, code._replace(solve=limited)).solve(state, theta, None, began=0.0)
    return reached[0]


def test_python_and_machine_code_take_the_same_iterates(nmpc, theta, cold):
    for k in range(len(cold)):
        value, error = stopped(nmpc, BUSY, theta, limit=k)
        assert cold.value[k] == pytest.approx(value, rel=1e-7)
        assert cold.error[k] == pytest.approx(error, rel=1e-3, abs=1e-9)


@pytest.mark.parametrize("state", [BUSY, [-2.5, 1.5, 0.0], [0.5, 1.5, 0.0]], ids=str)
@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_the_last_iterate_is_the_solution_in_a_scaled_problem_and_inside_an_obstacle_too(
    nmpc, theta, state, factor
):
    weighed = np.append(factor * theta[:8], theta[8])
    solution = nmpc.solve(np.array(state), weighed)
    iterates = trace(nmpc.ocp, np.array(state), weighed)
    assert solution.restarts == 0
    assert len(iterates) == solution.iterations + 1
    assert iterates.value.iloc[-1] == pytest.approx(solution.value, rel=1e-9)


def test_mu_falls_from_iterate_to_iterate_and_the_error_reaches_the_tolerance(cold):
    assert (np.diff(cold.mu) <= 0).all()
    assert (cold.error >= cold.mu).all()
    assert (cold.error <= TOLERANCE).tolist() == [False] * (len(cold) - 1) + [True]


def test_the_last_row_takes_no_step_and_some_first_one_needs_a_delta(cold):
    assert np.isnan(cold.delta).tolist() == [False] * (len(cold) - 1) + [True]
    assert cold.delta.max() > 0
    assert cold.delta.iloc[-2] == 0


def test_a_warm_start_begins_with_a_smaller_mu_and_takes_fewer_iterations(nmpc, theta, cold):
    first = nmpc.solve(BUSY, theta)
    shifted = trace(nmpc.ocp, nmpc.plant.step(BUSY, first.action), theta, first)
    same = trace(nmpc.ocp, BUSY, theta + 1e-4, first)
    assert cold.mu[0] > shifted.mu[0] > same.mu[0]
    assert len(cold) > len(shifted) > len(same)


def test_gauss_newton_needs_no_delta_and_more_iterations(nmpc, theta, cold):
    straight = trace(nmpc.ocp, BUSY, theta, curvature=False)
    assert straight.delta.max() == 0
    assert len(straight) > 3 * len(cold)
    if straight.error.iloc[-1] <= TOLERANCE:
        assert straight.value.iloc[-1] == pytest.approx(cold.value.iloc[-1], rel=1e-6)


def test_a_function_that_is_replaced_is_called_by_the_others_of_its_copy_only(nmpc):
    plain, other = interpreted(nmpc.plant), interpreted(nmpc.plant)
    plain.row_residuals = lambda *_: 9.0
    assert plain.residuals.__globals__["row_residuals"]() == 9.0
    assert other.residuals.__globals__["row_residuals"] is other.row_residuals
    assert other.row_residuals is not plain.row_residuals


def pendulum(unit: float) -> Problem:
    """In its own units, with a row that the start violates, and a cost of the state alone."""
    return Problem(
        states=2,
        inputs=1,
        horizon=6,
        theta={"stiff": 1.0, "V0": 0.5},
        model=lambda x, u, th, d: [
            x[0] + 0.2 * x[1],
            x[1] + 0.2 * unit * (u / unit - th["stiff"] * np.sin(x[0] / unit) + d["wind"]),
        ],
        stage=lambda x, u, th, d: (x.T @ x + 0.1 * u**2) / unit**2,
        initial=lambda x, th, d: th["V0"],
        soft=[Soft(lambda x, u, th, d: x[1] / unit - 0.3, weight=4.0)],
        lower=-unit,
        upper=unit,
        data={"wind": 0.1},
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "state", "data", "curved"),
    [
        (pendulum(1e-4), [1.2e-4, 0.5e-4], {"wind": -0.2}, True),
        (gros_zanon.problem(), [-0.1, 0.2], {"undiscounted": np.ones(11)}, False),
    ],
    ids=["pendulum", "Gros and Zanon"],
)
def test_a_problem_is_traced_as_a_plant_is(problem, state, data, curved):
    nmpc, state, theta = Nmpc(problem), np.array(state), problem.theta
    for given in (None, data):
        solution = nmpc.solve(state, theta, data=given)
        known = problem.stage_data(given)
        iterates = trace(nmpc.ocp, state, theta, data=known)
        assert len(iterates) == solution.iterations + 1
        assert iterates.value.iloc[-1] == pytest.approx(solution.value, rel=1e-9)
        assert iterates.error.iloc[-1] < TOLERANCE < iterates.error.iloc[0]
        straight = trace(nmpc.ocp, state, theta, data=known, curvature=False)
        assert straight.value.iloc[-1] == pytest.approx(solution.value, rel=1e-6)
        assert np.allclose(straight.value[2], iterates.value[2], rtol=1e-9) != curved
        again = trace(nmpc.ocp, state, theta, solution, data=known)
        assert len(again) < len(iterates)

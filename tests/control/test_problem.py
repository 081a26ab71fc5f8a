"""What a `Problem` gives by name: theta, its gradient, and data of one stage or of all."""

import math

import numpy as np
import pytest
from small_problems import pendulum

from nmpcrl.control import Nmpc, Problem
from nmpcrl.control.solvers import SOLVERS

pytestmark = pytest.mark.usefixtures("interpreted")


@pytest.fixture(scope="module")
def problem() -> Problem:
    return pendulum()


@pytest.fixture(scope="module")
def solvers(problem) -> dict[str, Nmpc]:
    return {name: Nmpc(problem, solver=name) for name in SOLVERS}


def test_the_gradient_has_names(problem, solvers):
    solution = solvers["riccati"].solve(np.array([0.4, 0.1]), problem.theta)
    by_name = problem.split(solution.features)
    assert by_name["Q"].shape == (2, 2)
    assert isinstance(by_name["rate"], float)
    flat = np.concatenate([np.ravel(by_name[name]) for name in problem.names])
    np.testing.assert_array_equal(flat, solution.features)
    assert by_name["offset"] == pytest.approx(2 * 0.5 * math.cos(0.4))


def test_a_row_of_stage_zero_that_no_plan_changes_counts_once_it_is_violated(problem, solvers):
    """h(s) > 0 costs W h(s), and its slope in theta is W h_theta: on the boundary it is 0."""
    for name, nmpc in solvers.items():
        limit = problem.split(problem.theta)["limit"][0]
        above = nmpc.solve(np.array([0.0, limit + 0.1]), problem.theta)
        assert above.slacks[0, 0] == pytest.approx(0.1)
        assert above.multipliers.obstacles[0, 0] == pytest.approx(4.0)
        tie = nmpc.solve(np.array([0.0, limit]), problem.theta)
        assert tie.multipliers.obstacles[0, 0] == 0.0, name


def test_data_are_given_once_or_stage_by_stage(problem, solvers):
    nmpc, state = solvers["riccati"], np.array([0.3, -0.2])
    once = nmpc.solve(state, problem.theta, data={"target": [0.2, 0.1]})
    each = nmpc.solve(state, problem.theta, data={"target": np.tile([0.2, 0.1], (7, 1))})
    assert once.value == each.value
    assert nmpc.solve(state, problem.theta).value != once.value
    late = np.zeros((7, 2))
    late[6] = 1.0
    assert nmpc.solve(state, problem.theta, data={"target": late}).value > once.value
    with pytest.raises(ValueError, match=r"data has no 'targt'; did you mean 'target'\?"):
        nmpc.solve(state, problem.theta, data={"targt": 0.0})
    with pytest.raises(
        ValueError, match=r"data 'target' has shape \(3,\); it must be \(2,\) or \(7, 2\)"
    ):
        nmpc.solve(state, problem.theta, data={"target": np.zeros(3)})


def test_a_vector_and_its_names_are_the_same(problem):
    theta = problem.vector(Q=[[1.0, 2.0], [3.0, 4.0]], r=7.0)
    parts = problem.split(theta)
    np.testing.assert_array_equal(parts["Q"], [[1, 2], [3, 4]])
    assert (parts["r"], parts["rate"]) == (7.0, 1.3)
    assert problem.split(problem.theta_lower)["damping"] == 0.0
    assert problem.split(problem.theta_upper)["rate"] == np.inf
    with pytest.raises(ValueError, match="theta has no 'q'"):
        problem.vector(q=1.0)
    with pytest.raises(ValueError, match=r"theta 'Q' has shape \(4,\); it must be \(2, 2\)"):
        problem.vector(Q=np.ones(4))

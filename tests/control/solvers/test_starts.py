"""Cold solves from several starts: the best of the plans is kept."""

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from nmpcrl.control import Nmpc, Obstacle, Problem, Riccati, Soft, Task, differential_drive
from nmpcrl.control.solvers.starts import MOST, cold_inputs
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
BEFORE = np.array([0.0, 0.0, 0.0])  # a wall stands between here and the target


def before_a_wall(starts: int) -> Nmpc:
    """A robot that faces a wall of three obstacles."""
    task = Task(
        start=BEFORE,
        target=np.array([6.0, 0.0, 0.0]),
        lower=np.array([-3.0, -3.0, -np.inf]),
        upper=np.array([9.0, 9.0, np.inf]),
        obstacles=tuple(Obstacle(1.8, y) for y in (-1.2, 0.0, 1.2)),
    )
    return Nmpc(differential_drive(), task, horizon=40, gamma=1.0, solver=Riccati(starts=starts))


def test_one_start_stands_before_a_wall_and_nine_drive_around_it():
    one, nine = (before_a_wall(k).solve(BEFORE, THETA) for k in (1, 9))
    assert nine.value < 0.97 * one.value
    assert one.states[:, 0].max() < 1.8 < nine.states[:, 0].max()
    assert before_a_wall(9).kkt_residual(nine, relative=True) < 1e-6


def test_of_equal_plans_the_first_is_kept():
    free = np.array([-2.5, 1.5, 0.0])
    one = paper.nmpc(solver=Riccati(starts=1)).solve(free, THETA)
    nine = paper.nmpc(solver=Riccati(starts=9)).solve(free, THETA)
    assert_array_equal(one.point, nine.point)
    assert nine.restarts == 0


def test_a_warm_solve_is_the_same_whatever_the_number_of_starts():
    one, nine = (paper.nmpc(solver=Riccati(starts=k)) for k in (1, 9))
    warm = one.solve(BEFORE, THETA)
    nearby = BEFORE + 0.01
    assert_array_equal(one.solve(nearby, THETA, warm).point, nine.solve(nearby, THETA, warm).point)


@pytest.mark.usefixtures("interpreted")
def test_a_problem_with_rows_has_several_starts_of_itself():
    """Two wells, at 1 and a deeper one at -1: from rest near 1 a plan stays there."""
    problem = Problem(
        states=1,
        inputs=1,
        horizon=8,
        theta={"tilt": 0.3},
        model=lambda x, u, th: x + u,
        stage=lambda x, u, th: (x**2 - 1) ** 2 + th["tilt"] * x,
        terminal=lambda x, th: (x**2 - 1) ** 2 + th["tilt"] * x,
        soft=[Soft(lambda x, u, th: x - 5.0, weight=10.0)],
        lower=[-0.5],
        upper=[0.5],
    )
    state = np.array([0.9])
    one = Nmpc(problem, solver=Riccati(starts=1)).solve(state, problem.theta)
    several = Nmpc(problem).solve(state, problem.theta)
    assert one.states[-1] == pytest.approx(0.96, abs=0.02)
    assert several.states[-1] == pytest.approx(-1.04, abs=0.02)
    assert several.value < one.value


@pytest.mark.parametrize("starts", [0, -1, 1.5, MOST + 1, "many"])
def test_a_number_of_starts_that_is_none_is_refused(starts):
    with pytest.raises(ValueError, match=rf"starts = '?{starts}'? must"):
        Riccati(starts=starts)


def test_all_starts_that_can_be_asked_for_lie_within_the_bounds_and_differ():
    robot = differential_drive()
    found = cold_inputs(robot, 10, MOST - 1)
    assert len(found) == MOST - 1
    assert all(((robot.lower <= u) & (u <= robot.upper)).all() for u in found)
    assert len({u.tobytes() for u in found}) == len(found)


@pytest.mark.parametrize(
    ("lower", "upper", "held"),
    [
        (-np.inf, np.inf, [0.4, -0.4, 1.0, -1.0]),
        (-1.6, 1e3, [0.4, -0.4, 1.0, -1.0]),
        (-0.5, 5.0, [2.0, -0.2, 5.0, -0.5]),
        (3.0, 20.0, [8.0, 3.0, 20.0, 3.0]),
    ],
)
def test_an_input_is_held_near_its_bounds_where_these_are_wide_and_else_within_one(
    lower, upper, held
):
    problem = Problem(
        states=1,
        inputs=1,
        horizon=2,
        theta={"a": 1.0},
        model=lambda x, u, th: th["a"] * x + u,
        stage=lambda x, u, th: ca.sumsqr(x) + ca.sumsqr(u),
        lower=lower,
        upper=upper,
    )
    assert [u[0, 0] for u in cold_inputs(problem, 2, 4)] == held

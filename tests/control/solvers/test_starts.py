"""Options of solvers, and cold solves from several starts: the best of the plans is kept."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from nmpcrl.control import Nmpc, Obstacle, Problem, Riccati, Soft, Task, differential_drive
from nmpcrl.control.solvers import SOLVERS
from nmpcrl.control.solvers.starts import MOST
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
BEFORE = np.array([0.0, 0.0, 0.0])  # a wall stands between here and the target


@pytest.mark.parametrize(
    ("kind", "option", "value", "allowed"),
    [
        *((kind, "tolerance", value, r"lie in \[1e-12, 0.01\]$")
          for kind in SOLVERS.values() for value in (-1e-8, 9e-13, 0.011, np.nan)),
        (Riccati, "starts", 0, "be a whole number, 1 or more"),
        (Riccati, "starts", 1.5, "be a whole number, 1 or more"),
        (Riccati, "starts", MOST + 1, f"be at most {MOST}"),
    ],
)  # fmt: skip
def test_an_option_out_of_range_is_refused(kind, option, value, allowed):
    with pytest.raises(ValueError, match=rf"^{option} = {value} must {allowed}"):
        kind(**{option: value})


def before_a_wall(starts: int) -> Nmpc:
    """A robot that faces a wall of three obstacles."""
    wall = tuple(Obstacle(1.8, y) for y in (-1.2, 0.0, 1.2))
    task = Task(BEFORE, [6, 0, 0], [-3, -3, -np.inf], [9, 9, np.inf], wall)
    return Nmpc(differential_drive(), task, horizon=40, gamma=1.0, solver=Riccati(starts=starts))


def test_nine_starts_drive_around_a_wall_and_of_equal_plans_the_first_is_kept():
    one, nine = (before_a_wall(k).solve(BEFORE, THETA) for k in (1, 9))
    assert nine.value < 0.97 * one.value
    assert one.states[:, 0].max() < 1.8 < nine.states[:, 0].max()
    assert before_a_wall(9).kkt_residual(nine, relative=True) < 1e-6
    free, near = np.array([-2.5, 1.5, 0.0]), BEFORE + 0.01
    nmpcs = [paper.nmpc(solver=Riccati(starts=k)) for k in (1, 9)]
    one, nine = (nmpc.solve(free, THETA) for nmpc in nmpcs)
    assert_array_equal(one.point, nine.point)
    assert nine.restarts == 0
    warm = nmpcs[0].solve(BEFORE, THETA)
    one, nine = (nmpc.solve(near, THETA, warm) for nmpc in nmpcs)
    assert_array_equal(one.point, nine.point)


def line(lower: float, upper: float, **changes) -> Problem:
    """A state that is moved by its input between two wells, a deeper one at -1."""
    fields = {
        "states": 1, "inputs": 1, "horizon": 8, "theta": {"tilt": 0.3},
        "model": lambda x, u, th: x + u, "lower": lower, "upper": upper,
        "stage": lambda x, u, th: (x**2 - 1) ** 2 + th["tilt"] * x,
        "terminal": lambda x, th: (x**2 - 1) ** 2 + th["tilt"] * x,
    }  # fmt: skip
    return Problem(**fields | changes)


@pytest.mark.usefixtures("interpreted")
def test_a_problem_with_rows_has_several_starts_of_itself():
    """From rest near 1 a plan stays there."""
    problem = line(-0.5, 0.5, soft=[Soft(lambda x, u, th: x - 5.0, weight=10.0)])
    one, several = (
        Nmpc(problem, solver=how).solve(np.array([0.9]), problem.theta)
        for how in (Riccati(starts=1), Riccati())
    )
    assert one.states[-1] == pytest.approx(0.96, abs=0.02)
    assert several.states[-1] == pytest.approx(-1.04, abs=0.02)
    assert several.value < one.value

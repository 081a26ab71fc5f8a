"""A problem's model and costs as functions of numbers."""

import casadi as ca
import numpy as np
import pytest
from small_problems import pendulum

from nmpcrl.control import Problem, Soft


def test_step_cost_and_plant_are_the_problem_s_with_numbers_and_each_line_has_its_price():
    """The pendulum by NumPy; its last soft rows hold at stage N alone, and cost nothing."""
    problem, rng = pendulum(), np.random.default_rng(0)
    for _ in range(200):
        x, u, rate = rng.normal(size=2), rng.normal(size=1), rng.uniform(1, 2)
        wind, target = rng.normal(), rng.normal(size=2)
        theta, data = problem.vector(rate=rate), {"wind": wind, "target": target}
        force = -rate * np.sin(x[0]) - 0.2 * x[1] ** 3 + u[0]
        later = [x[0] + 0.2 * x[1], x[1] + 0.2 * force + wind]
        away, rows = x - target, (x[1] - 0.7, x[1] * u[0] - 0.9 * np.cos(x[0]))
        cost = away @ np.diag([1.0, 0.3]) @ away + 0.2 * u[0] ** 2
        cost += 4 * max(rows[0], 0) + 2 * max(rows[1], 0)
        assert problem.step(x, u, theta, data=data) == pytest.approx(later, rel=1e-13, abs=1e-13)
        assert problem.cost(x, u, theta, data=data) == pytest.approx(cost, rel=1e-13)
    problem, x, u = pendulum(), [0.3, 0.9], [0.5]
    later, cost, end = problem.plant(rate=1.7)(np.array(x), np.array(u), None, 0, None)
    assert later.tolist() == problem.step(x, u, problem.vector(rate=1.7)).tolist()
    assert later.tolist() != problem.step(x, u).tolist()
    assert (cost, end) == (problem.cost(x, u), False)
    discs = np.array([[0.0, 1.0], [0.5, 0.2]])
    problem = Problem(
        states=1, inputs=1, horizon=2, theta={"w": 2.0}, data={"discs": discs},
        model=lambda x, u, th: x + u, stage=lambda x, u, th: th["w"] * ca.sumsqr(x),
        soft=[Soft(lambda x, u, th, d: d["discs"][1] - (x - d["discs"][0]), 3.0, each="discs")],
    )  # fmt: skip
    assert problem.cost(0.4, 0) == pytest.approx(2 * 0.16 + 3 * (0.6 + 0.3))
    assert problem.cost(0.4, 0, data={"discs": discs - 1}) == pytest.approx(0.32)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (([1.0, 2.0, 3.0], 0.0), r"x = \[1. 2. 3.\] must hold 2 numbers, one a state"),
        (([1.0, np.nan], 0.0), r"x = \[ 1. nan\] must hold 2 numbers"),
        (([1.0, 2.0], [1.0, 2.0]), r"u = \[1. 2.\] must hold 1 numbers, one an input"),
        (([1.0, 2.0], 0.0, np.ones(3)), "theta = .* must hold 10 numbers, one a parameter"),
    ],
)
def test_numbers_that_do_not_fit_are_refused(given, said):
    with pytest.raises(ValueError, match=said):
        pendulum().step(*given)

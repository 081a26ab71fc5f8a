"""Real-time iterations: so many, and in closed loop nearly as good as optimal plans."""

import numpy as np
import pytest
from small_problems import pendulum

from nmpcrl.control import Nmpc, real_time
from nmpcrl.learning import evaluate

pytestmark = pytest.mark.usefixtures("interpreted")
STATE = np.array([0.9, -0.4])


def test_a_warm_solve_makes_so_many_steps_and_a_closed_loop_costs_what_optimal_plans_do():
    problem = pendulum()
    nmpc, short, long = (
        Nmpc(problem, solver=solver) for solver in ("riccati", real_time(), real_time(40))
    )
    first = nmpc.solve(STATE, problem.theta)
    assert short.solve(STATE, problem.theta).value == first.value
    later = first.states[1] + [0.05, 0.05]
    known, few, many = (one.solve(later, problem.theta, first) for one in (nmpc, short, long))
    assert known.iterations > 1 == few.iterations
    assert many.value == known.value
    assert few.value == pytest.approx(known.value, rel=1e-2)
    assert few.action != known.action
    problem = pendulum()

    def plant(x, u, rng):
        return problem.step(x, u) + 0.02 * rng.normal(size=2), problem.cost(x, u), False

    costs = [
        evaluate(Nmpc(problem, solver=one), problem.theta, 15, plant=plant, start=STATE).cost
        for one in ("riccati", real_time())
    ]
    assert costs[1] == pytest.approx(costs[0], rel=1e-2)

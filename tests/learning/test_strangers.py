"""Five problems that stand in no page, from expression to learned theta in 40 lines each.

Each is written as by a reader of "Your problem": its model has one number wrong, which the plant
knows, and what is learned must come close to it and cost less than the first theta.
"""

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Hard, Nmpc, Parameter, Problem, Soft
from nmpcrl.learning import learn

pytestmark = pytest.mark.slow


def test_a_building_with_prices_and_hard_comfort():
    hours = np.arange(72)
    outside = 5 + 5 * np.sin(2 * np.pi * hours / 24)
    price = 1 + 0.5 * np.sign(np.sin(2 * np.pi * (hours - 6) / 24))

    def model(x, u, th, d):
        flow = 0.3 * (x[1] - x[0])  # from wall to room
        lost = th["leak"] * (x[1] - d["outside"])
        return ca.vertcat(x[0] + flow + 0.6 * u, x[1] - 0.1 * flow - lost)

    problem = Problem(
        states=2, inputs=1, horizon=24, gamma=0.8, lower=0, upper=8,
        theta={"leak": Parameter(0.01, 0.0, 0.2), "V0": 0.0},
        data={"outside": 5.0, "price": 1.0},
        model=model,
        stage=lambda x, u, th, d: d["price"] * u,
        initial=lambda x, th, d: th["V0"],
        hard=[Hard(lambda x, u, th, d: 20 - x[0], stages=slice(1, None))],
    )  # fmt: skip
    truth = problem.vector(leak=0.04)

    def plant(x, u, rng, t):
        known = {"outside": outside[t], "price": price[t]}
        return problem.step(x, u, truth, data=known), problem.cost(x, u, data=known), False

    world = {"plant": plant, "start": [21.0, 19.0], "data": {"outside": outside, "price": price}}
    world |= {
        "episodes": 6,
        "steps": 48,
        "deviation": 0.0,
    }  # noise could leave no plan that keeps 20
    result = learn(Nmpc(problem, solver="fatrop"), every=12, **world)
    assert result.theta["leak"] == pytest.approx(0.04, abs=0.004)
    assert (result.history["state"][1:48, 0] > 19.5).all()


def test_a_robot_among_moving_obstacles():
    t = np.arange(60)[:, None]
    walkers = np.stack([np.hstack([1.5 + 0 * t, 1.5 - 0.1 * t]), np.hstack([3 - 0.05 * t, 0 * t])],
                       axis=1)  # two, at each time: x, y  # fmt: skip

    problem = Problem(
        states=4, inputs=2, horizon=25, gamma=0.95, lower=-1, upper=1,
        theta={"drag": Parameter(0.3, 0.0, 2.0), "V0": 0.0},
        data={"walkers": walkers[0]},
        model=lambda x, u, th: ca.vertcat(
            x[:2] + 0.2 * x[2:], x[2:] + 0.2 * (2 * u - th["drag"] * x[2:])
        ),
        stage=lambda x, u, th: ca.sumsqr(x[:2] - [4, 0]) + 0.1 * ca.sumsqr(u),
        terminal=lambda x, th: 5 * ca.sumsqr(x[:2] - [4, 0]) + ca.sumsqr(x[2:]),
        initial=lambda x, th: th["V0"],
        soft=[Soft(lambda x, u, th, d: 0.5 - ca.norm_2(x[:2] - d["walkers"] + 1e-6), weight=50.0,
                   each="walkers")],
    )  # fmt: skip
    truth = problem.vector(drag=0.6)

    def plant(x, u, rng, t):
        known = {"walkers": walkers[t]}
        return problem.step(x, u, truth), problem.cost(x, u, data=known), False

    def start(rng):
        return [*rng.uniform(-0.5, 0.5, 2), 0, 0]

    world = {"plant": plant, "start": start, "data": {"walkers": walkers}}
    result = learn(
        Nmpc(problem, solver="fatrop"), episodes=8, steps=30, every=15, confirm=1, **world
    )
    assert result.theta["drag"] == pytest.approx(0.6, abs=0.1)
    assert result.costs[-1] < result.costs[0]

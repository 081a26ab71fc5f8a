"""Obstacles that move: closed forms of the motions, predictors, and the world's clock and bits."""

import numpy as np
import pytest

from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import moving, paper
from nmpcrl.study.moving import PREDICTORS, Straight, World, inside, known, still

SECONDS = np.linspace(-1, 30, 400)
THETA = np.array(paper.THETA_INIT)
LAYOUT = paper.LAYOUTS["A"]
MOVING = (Straight((2.0, 1.5), (0.1, 0.0)), *still(LAYOUT[1:]))
NMPC = moving.controller()
SWINGING = [moving.Sinusoidal((1.0, 2.0), (0.5, 0.0), period=8.0)]


def test_a_motion_is_an_oscillator_s_or_stays_on_its_graph_at_its_speed_and_turns():
    motion, h = moving.Sinusoidal((1.0, 2.0), (0.5, -0.25), period=8.0, phase=0.3), 1e-3
    before, now, after = (motion(SECONDS + k * h) for k in (-1, 0, 1))
    pull = -((2 * np.pi / 8) ** 2) * (now - [1.0, 2.0])
    np.testing.assert_allclose((after - 2 * now + before) / h**2, pull, atol=1e-6)
    motion = moving.Polynomial((1.0, 2.0), (0.0, 2.0), (0.1, 0.0, -0.4), speed=0.5, phase=0.2)
    x, y = (motion(SECONDS) - [1.0, 2.0]).T
    s = y / 2  # its axis points along y, and across it is -x
    np.testing.assert_allclose(x, -2 * (0.1 - 0.4 * s**2))
    assert (s.min(), s.max()) == pytest.approx((-1, 1), abs=0.02)
    assert np.median(np.abs(np.diff(y)) / np.diff(SECONDS)) == pytest.approx(0.5)
    assert motion(np.zeros(1))[0, 1] == pytest.approx(2 + 2 * 0.2)


def test_extrapolation_is_exact_where_the_velocity_is_constant_and_nowhere_else():
    straight = [Straight((1.0, 2.0), (0.3, -0.1)), Straight((4.0, 0.0))]
    at = [[(1 + 0.06 * t, 2 - 0.02 * t), (4, 0)] for t in 7 + np.arange(paper.HORIZON + 1)]
    for view in (known, moving.extrapolated):
        np.testing.assert_allclose(view(straight, 7), at, atol=1e-12)
    assert np.abs(moving.extrapolated(SWINGING, 7) - known(SWINGING, 7)).max() > 0.05


@pytest.mark.parametrize("name", PREDICTORS)
def test_every_predictor_knows_the_present_and_obstacles_that_stand_still(name):
    now = SWINGING[0](np.array([9 * moving.PERIOD]))
    np.testing.assert_array_equal(PREDICTORS[name](SWINGING, 9)[0], now)
    found = PREDICTORS[name](still(LAYOUT), 5)
    np.testing.assert_array_equal(found, np.broadcast_to(LAYOUT, (paper.HORIZON + 1, 4, 2)))


def test_the_charge_among_standing_obstacles_is_the_papers_to_the_last_bit():
    rng, task = np.random.default_rng(1), paper.task("A")
    states = rng.uniform((-3, -3, -4), (9, 9, 4), (500, 3))
    for state, action in zip(states, rng.uniform(-1, 1, (500, 2)), strict=True):
        assert moving.charge(state, action, np.array(LAYOUT)) == task.stage_cost(state, action)


@pytest.mark.parametrize("layout", ["A", "D"])
def test_the_problem_has_the_value_and_the_gradient_of_the_papers_controller(layout):
    np.testing.assert_array_equal(moving.problem().theta, paper.THETA_INIT)
    printed, data = paper.nmpc(layout), {"centres": np.array(paper.LAYOUTS[layout])}
    for state in ([-2.5, 1.5, 0.0], [0.0, 0.6, 0.4], [5.0, 1.4, -0.3], [8.0, 1.0, 1.0]):
        one = printed.solve(np.array(state), THETA)
        other = NMPC.solve(np.array(state), THETA, data=data)
        assert other.value == pytest.approx(one.value, rel=1e-6)
        np.testing.assert_allclose(other.features, one.features, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("name", PREDICTORS)
def test_an_obstacle_that_stands_still_gives_the_static_bits(name):
    task = paper.task("A")

    def plant(state, action, _):
        return moving.robot().step(state, action), task.stage_cost(state, action), False

    static = evaluate(NMPC, THETA, 40, plant=plant, start=task.start,
                      data=lambda _: {"centres": np.array(LAYOUT)})  # fmt: skip
    found = evaluate(NMPC, THETA, 40, **World(still(LAYOUT), PREDICTORS[name]).environment)
    np.testing.assert_array_equal(static.states, found.states)
    np.testing.assert_array_equal(static.costs, found.costs)


def test_the_clock_begins_anew_and_plans_and_overlaps_are_of_their_own_steps():
    world = World(MOVING)
    first, again = (evaluate(NMPC, THETA, 20, **world.environment) for _ in range(2))
    np.testing.assert_array_equal(first.states, again.states)
    np.testing.assert_array_equal(world.data(3)["centres"], known(MOVING, 3))
    assert not np.array_equal(world.data(3)["centres"][1:], moving.frozen(MOVING, 3)[1:])
    motions = [Straight((0.0, 0.0), (1.0, 0.0))]  # 0.2 m a step
    states = np.array([[0.0, 1.2, 0.0], [1.46, 0.0, 0.0], [0.4, 1.26, 0.0]])
    assert inside(states, motions)[:, 0].tolist() == [True, False, False]

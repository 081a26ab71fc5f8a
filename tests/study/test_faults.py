"""Faults of the plant: each against its closed form."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from nmpcrl.studies.worlds_run import controller
from nmpcrl.study.faults import BASE, FAULTS, NONE, Fault, robot
from nmpcrl.study.moving import World, still
from nmpcrl.study.parameters import ParameterError

STATE, ACTION = np.array([1.0, 2.0, 0.0]), np.array([0.5, 0.0])
RNG = np.random.default_rng


def stepped(fault, state=STATE, action=ACTION):
    return fault.step(state, fault.gain(RNG(0)) @ action)


def test_without_a_fault_a_plant_moves_as_the_robot_to_the_last_bit():
    rng = RNG(1)
    for _ in range(100):
        state, action = rng.uniform(-3, 9, 3), rng.uniform(-1, 1, 2)
        assert (stepped(NONE, state, action) == robot().step(state, action)).all()
        assert NONE.measure(state, rng) is state


@pytest.mark.parametrize(
    ("fault", "moved"),
    [(Fault(grip=0.8), [0.08, 0.0, 0.0]),
     (Fault(drift=(0.0, 0.1)), [0.1, 0.02, 0.0]),
     (Fault(bias=0.1), [*(robot().step(STATE, [0.5, 0.1]) - STATE)[:2], 0.02]),
     (Fault(noise=(0.1, 0.2, 0.0)), [0.1, 0.0, 0.0])],
)  # fmt: skip
def test_a_step_straight_ahead(fault, moved):
    np.testing.assert_allclose(stepped(fault) - STATE, moved, atol=1e-12)


def test_a_lag_follows_the_input_as_a_first_order_system_does_in_each_episode():
    world = World(still([(99.0, 99.0)]), fault=Fault(lag=0.4))
    for _ in range(2):
        world.begin(RNG(0))
        for _ in range(6):
            world.step(STATE, ACTION, RNG(0))
        speeds = np.diff(world.states, axis=0)[:, 0] / robot().period
        times = robot().period * np.arange(1, 7)
        np.testing.assert_allclose(speeds, 0.5 * (1 - np.exp(-times / 0.4)))


@pytest.mark.parametrize(
    ("lost", "speed", "turn"), [((0.3, 0.3), 0.28, 0.0), ((0.0, 0.5), 0.3, (0.4 - 0.2) / BASE)]
)
def test_wheels_that_slip_alike_lose_speed_and_one_alone_turns_the_robot(lost, speed, turn):
    draws = SimpleNamespace(uniform=lambda *_: np.array(lost))
    assert Fault(slip=0.5).gain(draws) @ [0.4, 0.0] == pytest.approx((speed, turn))


def test_slip_and_noise_are_drawn_and_an_oracle_knows_the_mean_of_slip():
    rng, fault = RNG(3), FAULTS["slip"]
    drawn = np.array([fault.gain(rng) for _ in range(4000)])
    assert drawn.std(axis=0).min() > 0.01
    np.testing.assert_allclose(drawn.mean(axis=0), fault.model["gain"], atol=0.01)
    fault, rng = Fault(noise=(0.1, 0.2, 0.0)), RNG(1)
    measured = np.array([fault.measure(STATE, rng) for _ in range(4000)])
    np.testing.assert_allclose(measured.std(axis=0), [0.1, 0.2, 0.0], atol=0.01)


@pytest.mark.parametrize("wrong", [{"grip": 1.1}, {"slip": -0.1}, {"lag": -1.0}])
def test_nonsense_is_refused(wrong):
    with pytest.raises(ParameterError, match="must"):
        Fault(**wrong)


def test_an_oracle_s_model_is_the_plant():
    fault, nmpc = Fault(grip=0.8, bias=0.15, drift=(0.02, 0.08)), controller("model")
    e = nmpc.problem.expressions
    model = ca.Function("model", [e.x, e.u, e.theta, e.d], [e.next_x])
    rng, theta = RNG(0), nmpc.problem.vector(**fault.model)
    for _ in range(20):
        state, action = rng.uniform(-3, 9, 3), rng.uniform(-0.6, 0.6, 2)
        foretold = model(state, action, theta, np.zeros(8)).full().ravel()
        np.testing.assert_allclose(foretold, stepped(fault, state, action), atol=1e-12)

"""Bodies that are not the model: each fault against its closed form."""

import casadi as ca
import numpy as np
import pytest

from nmpcrl.studies.worlds_problems import oracle, problem
from nmpcrl.study.faults import BASE, FAULTS, NONE, Fault, robot, wheels
from nmpcrl.study.parameters import ParameterError

STATE, ACTION = np.array([1.0, 2.0, 0.0]), np.array([0.5, 0.0])
RNG = np.random.default_rng


def test_a_body_without_faults_moves_as_the_robot_to_the_last_bit():
    body, rng = NONE.draw(RNG(0)), RNG(1)
    for _ in range(100):
        state, action = rng.uniform(-3, 9, 3), rng.uniform(-1, 1, 2)
        assert (body.step(state, action) == robot().step(state, action)).all()
        assert body.measure(state, rng) is state


@pytest.mark.parametrize(
    ("fault", "moved"),
    [
        (Fault(grip=0.8), [0.08, 0.0, 0.0]),
        (Fault(drift=(0.0, 0.1)), [0.1, 0.02, 0.0]),
    ],
)
def test_a_step_straight_ahead(fault, moved):
    np.testing.assert_allclose(fault.draw(RNG(0)).step(STATE, ACTION) - STATE, moved, atol=1e-12)
    assert Fault(bias=0.1).draw(RNG(0)).step(STATE, ACTION)[2] == pytest.approx(
        0.1 * robot().period
    )


def test_a_lag_follows_the_input_as_a_first_order_system_does():
    body, state, speeds = Fault(lag=0.4).draw(RNG(0)), STATE, []
    for _ in range(6):
        later = body.step(state, ACTION)
        speeds.append((later - state)[0] / robot().period)
        state = later
    times = robot().period * np.arange(1, 7)
    np.testing.assert_allclose(speeds, 0.5 * (1 - np.exp(-times / 0.4)))


def test_wheels_that_slip_alike_lose_speed_and_one_alone_turns_the_robot():
    np.testing.assert_allclose(wheels(0.7, 0.7), 0.7 * np.eye(2))
    speed, turn = wheels(1.0, 0.5) @ [0.4, 0.0]
    assert (speed, turn) == pytest.approx((0.3, (0.4 - 0.2) / BASE))
    np.testing.assert_array_equal(wheels(1.0, 1.0), np.eye(2))


def test_slip_is_drawn_anew_for_each_episode_and_its_mean_is_what_an_oracle_knows():
    rng, fault = RNG(3), FAULTS["slip"]
    drawn = np.array([fault.draw(rng)._gain for _ in range(4000)])
    assert drawn.std(axis=0).min() > 0.01
    np.testing.assert_allclose(drawn.mean(axis=0), fault.model["gain"], atol=0.01)


def test_noise_is_measured_and_moves_nothing():
    body, rng = Fault(noise=(0.1, 0.2, 0.0)).draw(RNG(0)), RNG(1)
    np.testing.assert_array_equal(body.step(STATE, ACTION), robot().step(STATE, ACTION))
    measured = np.array([body.measure(STATE, rng) for _ in range(4000)])
    np.testing.assert_allclose(measured.std(axis=0), [0.1, 0.2, 0.0], atol=0.01)


@pytest.mark.parametrize("wrong", [{"grip": 1.1}, {"slip": -0.1}, {"lag": -1.0}])
def test_nonsense_is_refused(wrong):
    with pytest.raises(ParameterError, match="must"):
        Fault(**wrong)


def test_an_oracle_s_model_is_the_body():
    fault = Fault(grip=0.8, bias=0.15, drift=(0.02, 0.08))
    e = problem(learned_model=True).expressions
    model = ca.Function("model", [e.x, e.u, e.theta, e.d], [e.next_x])
    rng = RNG(0)
    for _ in range(20):
        state, action = rng.uniform(-3, 9, 3), rng.uniform(-0.6, 0.6, 2)
        foretold = model(state, action, oracle(fault), np.zeros(8)).full().ravel()
        np.testing.assert_allclose(foretold, fault.draw(rng).step(state, action), atol=1e-12)

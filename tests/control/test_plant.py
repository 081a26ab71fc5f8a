"""The plant against the arc that it follows exactly."""

import numpy as np
import pytest
from small_problems import plant, point_mass

from nmpcrl.control import Nmpc, Task, differential_drive


def arc(state, speed, turn_rate, time):
    """Where a unicycle is after following a circle for `time` seconds: the integral of Eq. (17)."""
    x, y, heading = state
    later = heading + turn_rate * time
    radius = speed / turn_rate
    along, across = np.sin(later) - np.sin(heading), np.cos(later) - np.cos(heading)
    return np.array([x + radius * along, y - radius * across, later])


def test_a_step_is_the_exponentials_series_and_lies_on_an_arc_a_line_or_a_parabola():
    """On x' = a x every one of the four slopes differs; the step must be 1 + z + ... + z^4 / 24."""
    growth = plant(dynamics=lambda state, action: action * state, period=0.5)
    z = 0.5 * 0.8
    series = 1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24
    np.testing.assert_allclose(growth.step([1.0, -2.0], [0.8]), [series, -2 * series])
    state, action = np.array([1.0, 2.0, -0.7]), np.array([0.5, -1.0])
    stepped = differential_drive().step(state, action)
    np.testing.assert_allclose(stepped, arc(state, *action, 0.2), atol=1e-6)
    straight = differential_drive().step(np.array([1.0, 2.0, np.pi / 2]), np.array([0.5, 0.0]))
    np.testing.assert_allclose(straight, [1.0, 2.1, np.pi / 2], atol=1e-15)
    state, push = np.array([1.0, 2.0, 3.0, -1.0]), np.array([0.5, 2.0])
    exact = [*(state[:2] + 0.2 * state[2:] + 0.2**2 / 2 * push), *(state[2:] + 0.2 * push)]
    np.testing.assert_allclose(point_mass().step(state, push), exact, atol=1e-14)
    robot = differential_drive()
    np.testing.assert_array_equal(robot.clip(np.array([1.6, -0.1])), [0.6, -0.1])
    np.testing.assert_array_equal(robot.clip(np.array([-9.0, 9.0])), [-0.6, np.pi / 2])


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("solver", ["riccati", "fatrop"])
def test_a_plant_may_have_one_state_and_a_task_no_obstacle(solver):
    tank = plant(dynamics=lambda s, a: a - 0.1 * s, state_names=("level",))
    np.testing.assert_allclose(tank.step(np.array([1.0]), np.array([0.0])), [np.exp(-0.02)])
    task = Task([0.0], [0.5], [-1.0], [1.0], weights=[1.0])
    nmpc = Nmpc(tank, task, horizon=5, solver=solver)
    solution = nmpc.solve(np.array([0.0]), np.array([1.0, 0.1, 1.0, 0.0]))
    assert solution.states.shape == (6, 1)
    assert 0.3 < solution.states[-1, 0] <= 0.6
    assert nmpc.kkt_residual(solution) < 1e-5
    assert task.stage_cost(np.array([0.0]), np.array([0.0])) == pytest.approx(0.25)


def test_dynamics_faster_than_the_period_take_substeps():
    """Eq. (18) at 30 time constants a step is no motor; forty substeps are."""
    motor = {"dynamics": lambda s, a: (a - s) / 1e-3, "state_names": ("current",), "period": 0.03}
    assert abs(plant(**motor).step(np.array([1.0]), np.array([0.0]))[0]) > 1e3
    fine = plant(**motor, substeps=40)
    assert abs(fine.step(np.array([1.0]), np.array([0.0]))[0]) < 1e-9

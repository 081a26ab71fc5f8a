"""A world that moves: what stands still in it gives the static bits, and its clock is right."""

import numpy as np
import pytest

from nmpcrl.learning.rollout import evaluate
from nmpcrl.study import paper
from nmpcrl.study.motions import PREDICTORS, Straight, frozen, known, still
from nmpcrl.study.world import (
    TASK,
    TERMINALS,
    World,
    charge,
    controller,
    inside,
    problem,
    robot,
)

THETA = np.array(paper.THETA_INIT)
LAYOUT = paper.LAYOUTS["A"]
MOVING = (Straight((2.0, 1.5), (0.1, 0.0)), *still(LAYOUT[1:]))


@pytest.fixture(scope="module")
def nmpc():
    return controller(4)


@pytest.fixture
def states():
    """Some near the target and in obstacles, and actions."""
    rng = np.random.default_rng(1)
    return zip(
        rng.uniform((-3, -3, -4), (9, 9, 4), (500, 3)), rng.uniform(-1, 1, (500, 2)), strict=True
    )


def test_the_charge_among_obstacles_that_stand_is_the_paper_s_to_the_last_bit(states):
    task = paper.task("A")
    for state, action in states:
        assert charge(state, action, np.array(LAYOUT)) == task.stage_cost(state, action)


@pytest.mark.parametrize("layout", ["A", "D"])
def test_the_problem_has_the_value_and_the_gradient_of_the_paper_s_controller(nmpc, layout):
    printed, data = paper.nmpc(layout), {"centres": np.array(paper.LAYOUTS[layout])}
    for state in ([-2.5, 1.5, 0.0], [0.0, 0.6, 0.4], [5.0, 1.4, -0.3], [8.0, 1.0, 1.0]):
        one = printed.solve(np.array(state), THETA)
        other = nmpc.solve(np.array(state), THETA, data=data)
        assert other.value == pytest.approx(one.value, rel=1e-6)
        np.testing.assert_allclose(other.features, one.features, rtol=1e-4, atol=1e-3)


def test_the_order_of_theta_is_that_of_the_paper():
    np.testing.assert_array_equal(problem().theta, paper.THETA_INIT)
    np.testing.assert_array_equal(problem(learned_model=True).theta[:9], paper.THETA_INIT)


@pytest.mark.parametrize("name", PREDICTORS)
def test_an_obstacle_that_stands_still_gives_the_static_bits(nmpc, name):
    task = paper.task("A")

    def plant(state, action, _):
        return robot().step(state, action), task.stage_cost(state, action), False

    static = evaluate(nmpc, THETA, 40, plant=plant, start=task.start,
                      data=lambda _: {"centres": np.array(LAYOUT)})  # fmt: skip
    moving = evaluate(nmpc, THETA, 40, **World(still(LAYOUT), PREDICTORS[name]).environment)
    np.testing.assert_array_equal(static.states, moving.states)
    np.testing.assert_array_equal(static.costs, moving.costs)


def test_the_clock_begins_anew_and_a_plan_sees_its_own_stages(nmpc):
    world = World(MOVING)
    first, again = (evaluate(nmpc, THETA, 20, **world.environment) for _ in range(2))
    np.testing.assert_array_equal(first.states, again.states)
    np.testing.assert_array_equal(world.data(3)["centres"], known(MOVING, 3))
    assert not np.array_equal(world.data(3)["centres"][1:], frozen(MOVING, 3)[1:])


def test_what_the_controller_believes_changes_the_plan_and_not_the_charge(nmpc):
    far = still([(99.0, 99.0)] * 4)
    blind = evaluate(nmpc, THETA, 60, **World(MOVING, seen=far).environment)
    assert inside(blind.states, MOVING).any()
    assert blind.cost > evaluate(nmpc, THETA, 60, **World(far).environment).cost


def test_a_state_is_inside_where_the_overlap_of_its_own_step_is_positive():
    motions = [Straight((0.0, 0.0), (1.0, 0.0))]  # 0.2 m a step
    states = np.array([[0.0, 1.2, 0.0], [1.46, 0.0, 0.0], [0.4, 1.26, 0.0]])
    assert inside(states, motions)[:, 0].tolist() == [True, False, False]
    assert TASK.obstacles == ()


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.parametrize("terminal", TERMINALS[1:])
def test_a_richer_terminal_cost_begins_as_the_paper_s_and_can_become_another(nmpc, terminal):
    richer, data = controller(terminal=terminal), {"centres": np.array(LAYOUT)}
    theta, state = richer.nmpc.problem.theta, np.array([4.0, 1.4, -0.3])
    np.testing.assert_array_equal(theta[:9], THETA)
    printed, same = (one.solve(state, each, data=data)
                     for one, each in ((nmpc, THETA), (richer, theta)))  # fmt: skip
    assert same.value == pytest.approx(printed.value, rel=1e-9)
    for k in range(9, theta.size):
        step = 1e-5 * np.eye(theta.size)[k]
        ahead, behind = (
            richer.solve(state, one, data=data).value for one in (theta + step, theta - step)
        )
        assert same.features[k] == pytest.approx((ahead - behind) / 2e-5, rel=1e-3, abs=1e-4)
        assert same.features[k] != 0


def test_a_terminal_cost_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="terminal = 'cubic' is none of diagonal, full, learned"):
        problem(terminal="cubic")

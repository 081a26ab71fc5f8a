"""Eq. (2) term by term: what a plan costs, what it keeps to, and what the slacks of stage 0 add."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.control import Nmpc, differential_drive
from nmpcrl.control.task import Theta
from nmpcrl.study import paper

OMEGA, GAMMA = 100.0, 0.97


def beyond(nmpc, solution):
    """What rows must be: overlap of obstacles and, of a soft box, x and y outside; (N + 1, M)."""
    x, task = solution.states, nmpc.task
    rows = np.maximum(0, task.overlap(x) + solution.theta[-1])
    if not task.soft_box:
        return rows
    left = np.maximum(0, np.hstack([task.lower[:2] - x[:, :2], x[:, :2] - task.upper[:2]]))
    left[0] = 0  # x_0 is given, wherever it is
    return np.hstack([left, rows])


def cost_of_plan(nmpc, solution, slacks):
    """Eq. (2a) of a plan, by hand."""
    w, target = Theta.split(solution.theta, nmpc.plant.n, nmpc.plant.m), nmpc.task.target
    total = 0.0
    for i, x in enumerate(solution.states):
        weight = w.x if i < nmpc.horizon else w.f
        cost = ((weight * (x - target)) ** 2).sum()
        cost += ((w.u * solution.inputs[i]) ** 2).sum() if i < nmpc.horizon else 0
        total += nmpc.gamma**i * (cost + nmpc.slack_weight * slacks[i].sum())
    return total


def walled(omega, solver, *, soft_box=True):
    """The paper's controller with upper walls at 6 m, before the target, and another price."""
    box = np.array([6.0, 6.0, np.inf])
    task = replace(paper.task(), upper=box, soft_box=soft_box, target_may_lie_outside=True)
    return Nmpc(differential_drive(), task, horizon=6, slack_weight=omega, solver=solver)


def test_theta_is_split_in_the_papers_order():
    names = list(paper.THETA_NAMES)
    assert Theta.split(names, 3, 2) == (names[:3], names[3:5], names[5:8], names[8:])
    assert names == ["x", "y", "heading", "v", "nu", "x_f", "y_f", "heading_f", "c"]
    parts = paper.nmpc().problem.split(np.arange(9.0))
    assert {name: np.size(part) for name, part in parts.items()} == {"x": 3, "u": 2, "f": 3, "c": 1}
    np.testing.assert_array_equal(parts["f"], [5, 6, 7])


def test_a_plan_follows_the_plant_keeps_to_its_bounds_and_costs_what_the_value_says(robot, draw):
    active, overlapped = 0, 0
    for state, theta in draw(50, seed=4):
        solution = robot.solve(state, theta)
        cost, slacks = cost_of_plan(robot, solution, solution.slacks), beyond(robot, solution)
        assert solution.value == pytest.approx(cost, rel=1e-9)
        np.testing.assert_allclose(solution.states[0], state, atol=1e-8)
        planned = zip(solution.states[:-1], solution.inputs, strict=True)
        stepped = [robot.plant.step(x, u) for x, u in planned]
        np.testing.assert_allclose(solution.states[1:], stepped, atol=1e-6)
        assert (np.abs(solution.inputs) <= robot.plant.upper).all()
        assert (robot.task.lower <= solution.states[1:]).all()
        assert (solution.states[1:] <= robot.task.upper).all()
        np.testing.assert_allclose(solution.slacks, slacks, atol=2e-6)
        active += (np.abs(solution.inputs) > robot.plant.upper - 1e-6).any()
        overlapped += (slacks > 0.01).any()
    assert active > 25  # or this test would show little
    assert overlapped > 4


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("omega", [3.0, 100.0])
def test_leaving_a_soft_box_costs_omega_a_metre(solver, omega):
    nmpc, rng, left = walled(omega, solver), np.random.default_rng(61), 0
    for _ in range(8):
        theta = np.array(paper.THETA_INIT) * rng.uniform(0.5, 2, 9)
        solution = nmpc.solve(rng.uniform([5.5, 0, -2], [6.5, 6.3, 3]), theta)
        slacks = beyond(nmpc, solution)
        assert solution.value == pytest.approx(cost_of_plan(nmpc, solution, slacks), rel=1e-6)
        np.testing.assert_allclose(solution.slacks, slacks, atol=1e-5)
        assert solution.violation == 0  # of hard rows, which there are none
        assert nmpc.kkt_residual(solution, relative=True) < 1e-5
        left += slacks[:, :4].max() > 1e-2
    assert left >= 4


@pytest.mark.usefixtures("interpreted")
def test_only_a_soft_box_is_left_for_a_target_behind_it(solver, theta):
    """The target lies 2.5 m behind the wall, and the walls' price is a tenth of the obstacles'."""
    state = np.array([5.9, 2.0, 0.0])
    kept, left = (walled(10.0, solver, soft_box=soft).solve(state, theta) for soft in (False, True))
    assert kept.states[:, 0].max() <= 6.0 + 1e-6
    assert left.states[:, 0].max() > 6.1
    assert left.value < kept.value


def test_bellmans_equation_ties_one_horizon_to_the_next(robot, draw, solver):
    """Q_N(s, a) = L(s, a) + omega sigma_0 + gamma V_{N-1}(f(s, a)), if the plans are the same."""
    shorter, same = paper.nmpc(horizon=robot.horizon - 1, solver=solver), 0
    rng = np.random.default_rng(5)
    for state, theta in draw(20, seed=5):
        action = rng.uniform(robot.plant.lower, robot.plant.upper) / 2
        after = robot.plant.step(state, action)
        if not ((robot.task.lower < after) & (after < robot.task.upper)).all():
            continue
        later = shorter.solve(after, theta)
        w = Theta.split(theta, 3, 2)
        now = ((w.x * (state - robot.task.target)) ** 2).sum() + (w.u**2) @ action**2
        now += OMEGA * np.maximum(0, robot.task.overlap(state) + theta[-1]).sum()
        whole = robot.solve(state, theta, action=action).value
        same += whole == pytest.approx(now + GAMMA * later.value, rel=1e-6)
    assert same >= 15

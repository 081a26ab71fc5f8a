"""A box that may be left for a price: its sides are rows as the obstacles are."""

from dataclasses import replace

import numpy as np
import pytest

from nmpcrl.control import Nmpc, Solution, differential_drive
from nmpcrl.study import paper

THETA, SIDES = np.array(paper.THETA_INIT), 4  # of the box: the heading is free

pytestmark = pytest.mark.usefixtures("interpreted")


def walled(omega: float, upper: float, solver: str, *, soft_box: bool = True) -> Nmpc:
    """The paper's controller with another price and place of the upper walls."""
    box = np.array([upper, upper, np.inf])
    task = replace(paper.task(), upper=box, soft_box=soft_box, target_may_lie_outside=True)
    return Nmpc(differential_drive(), task, horizon=6, slack_weight=omega, solver=solver)


def beyond(nmpc: Nmpc, solution: Solution) -> np.ndarray:
    """How far x_1, ..., x_N leave each side, the lower ones first, shape (N, sides)."""
    later, task = solution.states[1:, :2], nmpc.task
    apart = np.hstack([task.lower[:2] - later, later - task.upper[:2]])
    return np.maximum(apart, 0)


@pytest.mark.parametrize("omega", [3.0, 100.0])
def test_the_value_is_what_the_plan_costs_and_what_leaving_the_box_costs(solver, omega):
    """Eq. (2a) along the plan, and omega gamma^i for every metre outside in stage i."""
    nmpc, rng, left = walled(omega, 6.0, solver), np.random.default_rng(61), 0
    for _ in range(8):
        theta = THETA * rng.uniform(0.5, 2, 9)
        solution = nmpc.solve(rng.uniform([5.5, 0, -2], [6.5, 6.3, 3]), theta)
        error, apart = solution.states - nmpc.task.target, beyond(nmpc, solution)
        costs = ((theta[:3] * error) ** 2).sum(axis=1)
        costs[:-1] += ((theta[3:5] * solution.inputs) ** 2).sum(axis=1)
        costs[-1] = ((theta[5:8] * error[-1]) ** 2).sum()
        costs += omega * np.maximum(nmpc.task.overlap(solution.states) + theta[8], 0).sum(axis=1)
        costs[1:] += omega * apart.sum(axis=1)
        assert solution.value == pytest.approx(nmpc.gamma ** np.arange(7) @ costs, rel=1e-6)
        np.testing.assert_allclose(solution.slacks[1:, :SIDES], apart, atol=1e-5)
        np.testing.assert_allclose(solution.slacks[0, :SIDES], 0, atol=1e-6)
        assert solution.violation == 0  # of hard rows, which there are none
        assert nmpc.kkt_residual(solution, relative=True) < 1e-5
        left += apart.max() > 1e-2
    assert left >= 4


def test_only_a_soft_box_is_left_for_a_target_behind_it(solver):
    """The target lies 2.5 m behind the wall, and the walls' price is a tenth of the obstacles'."""
    state = np.array([5.9, 2.0, 0.0])
    hard, priced = (walled(10.0, 6.0, solver, soft_box=soft) for soft in (False, True))
    kept, left = hard.solve(state, THETA), priced.solve(state, THETA)
    assert kept.states[:, 0].max() <= 6.0 + 1e-6
    assert left.states[:, 0].max() > 6.1
    assert left.value < kept.value


def test_inside_the_box_a_soft_one_is_a_hard_one(fatrop, draw):
    """Where the obstacles' columns and the sides' columns of slacks are told apart."""
    nmpc, inside = paper.nmpc(box="soft", solver="fatrop"), 0
    for state, theta in draw(15, seed=65):
        hard, solution = fatrop.solve(state, theta), nmpc.solve(state, theta)
        if solution.slacks[:, :SIDES].max() > 1e-6 or abs(solution.value / hard.value - 1) > 1e-3:
            continue  # out of the box, or another minimum
        inside += 1
        assert solution.value == pytest.approx(hard.value, rel=1e-6)
        np.testing.assert_allclose(solution.slacks[:, SIDES:], hard.slacks, atol=1e-5)
        np.testing.assert_allclose(solution.features, hard.features, rtol=1e-4, atol=1e-3)
    assert inside >= 10

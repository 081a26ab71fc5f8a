"""Dynamic programming: a finer grid changes little, and no plan costs less."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from nmpcrl.studies import dynamic_programming as grid
from nmpcrl.study.problems import gros_zanon as gz


def cost_of(policy, gamma=gz.GAMMA, episodes=60, steps=80) -> float:
    rng, total = np.random.default_rng(0), 0.0
    for _ in range(episodes):
        state = gz.START
        for t in range(steps):
            state, cost, _ = gz.plant(state, policy(state), rng)
            total += gamma**t * cost
    return total / episodes


@pytest.mark.slow
def test_the_value_is_what_the_policy_costs_and_a_finer_grid_has_the_same():
    coarse, fine = grid.best(points=61, inputs=41), grid.best(points=121, inputs=41)
    simulated = cost_of(fine.action)
    for found in (coarse, fine):
        value = RegularGridInterpolator(found.axes, found.value)(gz.START)
        assert value == pytest.approx(simulated, rel=0.1)
    for other in (lambda s: np.clip([-0.5 * s[0] - 2 * s[1]], -1, 1), lambda s: np.zeros(1)):
        assert simulated < cost_of(other)


def test_the_value_solves_bellmans_equation_where_a_successor_lies_on_the_grid():
    found = grid.best(points=41, inputs=41)
    value = found.value.ravel()
    interpolate = RegularGridInterpolator(found.axes, found.value)
    states = np.stack(np.meshgrid(*found.axes, indexing="ij"), -1).reshape(-1, 2)
    best = np.full(len(states), np.inf)
    low, high = gz.DISTURBANCE
    for a in np.linspace(-1, 1, 41):
        backed = np.zeros(len(states))
        for e in low + (np.arange(8) + 0.5) / 8 * (high - low):
            later = states @ gz.TRUE_A.T + a * gz.TRUE_B[:, 0] + [e, 0]
            inside = np.clip(later, grid.LEAST, grid.MOST)
            backed += interpolate(inside)
        costs = np.array([gz.cost(s, np.array([a])) for s in states])
        best = np.minimum(best, costs + gz.GAMMA * backed / 8)
    np.testing.assert_allclose(value, best, rtol=1e-6, atol=1e-8)

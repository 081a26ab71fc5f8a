"""The value solves Bellman's equation, and the policy costs what the published one does."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from nmpcrl.studies.other_problems import LEAST, MOST, OTHER_PROBLEMS, best, mean_cost, runs
from nmpcrl.study.problems import gros_zanon as gz


@pytest.mark.slow
def test_the_policy_of_a_coarse_grid_costs_nearly_what_the_published_one_does():
    known = runs(OTHER_PROBLEMS.table()).references["best_policy"]
    assert mean_cost(best(points=61, inputs=41).action) == pytest.approx(known, rel=0.05)


def test_the_value_solves_bellmans_equation_where_a_successor_lies_on_the_grid():
    found = best(points=41, inputs=41)
    value = found.value.ravel()
    interpolate = RegularGridInterpolator(found.axes, found.value)
    states = np.stack(np.meshgrid(*found.axes, indexing="ij"), -1).reshape(-1, 2)
    least = np.full(len(states), np.inf)
    low, high = gz.DISTURBANCE
    for a in np.linspace(-1, 1, 41):
        backed = np.zeros(len(states))
        for e in low + (np.arange(8) + 0.5) / 8 * (high - low):
            later = states @ gz.TRUE_A.T + a * gz.TRUE_B[:, 0] + [e, 0]
            backed += interpolate(np.clip(later, LEAST, MOST))
        costs = np.array([gz.cost(s, np.array([a])) for s in states])
        least = np.minimum(least, costs + gz.GAMMA * backed / 8)
    np.testing.assert_allclose(value, least, rtol=1e-6, atol=1e-8)

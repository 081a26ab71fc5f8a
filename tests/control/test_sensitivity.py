"""Derivatives in theta where differences say nothing: at bounds, at kinks, and of their algebra.

`test_derivatives` holds them to finite differences and to Ipopt.
"""

import numpy as np
import pytest
from small_problems import open_field, point_mass

from nmpcrl.control import Nmpc
from nmpcrl.study import paper

THETA, START = np.array(paper.THETA_INIT), np.array(paper.START)


@pytest.mark.parametrize("giver", ["fatrop", "ipopt"])
def test_the_solution_may_be_another_solvers(controllers, draw, giver):
    """CasADi's multiply by the dense Hessian."""
    riccati, casadi, rng = controllers["riccati"], controllers[giver], np.random.default_rng(53)
    for state, theta in draw(10, seed=53):
        solution, along = casadi.solve(state, theta), rng.normal(size=9) * theta
        dense = riccati.value_hessian(solution) @ along
        np.testing.assert_array_equal(casadi.value_hessian_times(solution, along), dense)
        product = riccati.value_hessian_times(solution, along)
        np.testing.assert_allclose(product, dense, atol=1e-4 * np.abs(dense).max())


def test_products_are_linear_and_the_hessian_behind_them_is_symmetric(controllers, draw):
    """u'Hv = v'Hu and H(u + t v) = Hu + t Hv, whatever is active and however weakly."""
    riccati, rng = controllers["riccati"], np.random.default_rng(54)
    for state, theta in draw(100, seed=54):
        solution = riccati.solve(state, theta)
        (u, v), times = rng.uniform(-1, 1, (2, 9)) * THETA, rng.uniform(-100, 100)
        before, vector = solution.point.copy(), u.copy()
        one, other, both = (riccati.value_hessian_times(solution, w) for w in (u, v, u + times * v))
        size = np.abs(u) @ np.abs(other) + np.abs(v) @ np.abs(one)
        assert v @ one == pytest.approx(u @ other, abs=1e-9 + 1e-6 * size)
        size = np.abs(one).max() + abs(times) * np.abs(other).max()
        np.testing.assert_allclose(both, one + times * other, atol=1e-10 + 1e-7 * size)
        np.testing.assert_array_equal(riccati.value_hessian_times(solution, 0 * u), 0)
        np.testing.assert_array_equal(solution.point, before)
        np.testing.assert_array_equal(u, vector)


def test_at_a_bound_that_is_just_reached_the_curvature_lies_between_its_sides():
    """An input free to follow theta bends V down; one that is held does not."""
    theta = np.array([1.2, 0.7, 0.3, 0.2, 0.4, 0.9, 1.5, 2.0, 0.6, 0.8, 0.0])
    state, along = np.array([0.9, -1.5, 0.0, 0.0]), np.linspace(0.5, 1.5, 11)

    def curvature(bound: float) -> float:
        nmpc = Nmpc(point_mass(bound), open_field(), horizon=1)
        return along @ nmpc.value_hessian_times(nmpc.solve(state, theta), along)

    wide = Nmpc(point_mass(), open_field(), horizon=1).solve(state, theta)
    reached = np.abs(wide.action).max()
    free, held = curvature(1.001 * reached), curvature(0.999 * reached)
    assert free < held - 1e-3 * abs(held)
    margin = 0.01 * (held - free)
    assert free - margin <= curvature(reached) <= held + margin


@pytest.mark.parametrize(
    ("field", "index", "by"),
    [
        ("primal", 3, 0.1),  # u_0: neither feasible nor stationary
        ("constraint_duals", 0, 1.0),
        ("bound_duals", 3, 1.0),
    ],
)
def test_the_kkt_residual_notices_what_is_not_a_solution(fatrop, field, index, by):
    solution = fatrop.solve(START, THETA)
    getattr(solution, field)[index] += by
    assert fatrop.kkt_residual(solution) > 1e-3
    assert field != "primal" or fatrop.kkt_residual(solution, relative=True) > 1e-3

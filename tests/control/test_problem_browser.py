"""A `Problem` as WebAssembly: solved in wasmtime as by the machine code."""

import casadi as ca
import numpy as np
import pytest
from small_problems import limited
from wasm_host import Controller, Module

from nmpcrl.control import Nmpc, Problem, Series, Soft
from nmpcrl.control.browser import texts
from nmpcrl.control.codegen.browser import from_texts


def walled() -> Problem:
    """The limited pendulum with a series and lines of data, in units of its own."""
    wall = Soft(lambda x, u, th, d: d["walls"][0] - x[1] + th["limit"][0], 9.0, each="walls")
    winds, walls = Series(0.05 * np.sin(np.arange(7))), np.array([[-1.0], [-0.8]])
    data = {"wind": winds, "target": np.zeros(2), "walls": walls}
    return limited(soft=wall, data=data, scale=[1000.0, 500.0])


@pytest.mark.slow
def test_values_gradients_and_slopes_are_those_of_the_machine_code():
    """Cold, warm and shifted; with u_0 free and given; and the model's step and cost."""
    problem = walled()
    data = from_texts(texts(problem))
    assert len(data) < 150_000
    nmpc = Nmpc(problem)
    module = Controller(Module(data), nmpc)
    rng, m = np.random.default_rng(3), problem.inputs
    e = problem.expressions
    both = ca.Function("both", [e.x, e.u, e.theta, e.d], [e.next_x, e.stage])
    warm = kept = None
    for k in range(30):
        theta = problem.theta * rng.uniform(0.97, 1.03, problem.theta.size)
        state, action = rng.uniform(-0.8, 0.8, 2), rng.uniform(-1, 1, m) if k % 3 == 2 else None
        if k % 5 == 4:
            state = warm.states[1]
        ours = nmpc.solve(state, theta, warm if k % 2 else None, action)
        theirs = module.solve(state, theta, kept if k % 2 else None, action)
        assert (theirs["iterations"], theirs["restarts"]) == (ours.iterations, ours.restarts)
        assert theirs["value"] == pytest.approx(ours.value, rel=1e-11, abs=1e-11)
        assert theirs["violation"] == pytest.approx(ours.violation, rel=1e-6, abs=1e-11)
        size = np.abs(ours.features).max()
        np.testing.assert_allclose(theirs["features"], ours.features, rtol=1e-11, atol=1e-11 * size)
        np.testing.assert_allclose(theirs["action"], ours.action, rtol=1e-9, atol=1e-9)
        warm, kept = ours, theirs
        if k % 6 == 0:
            along = rng.normal(size=theta.size)
            found = module.slopes(state, theta, theirs, along, action=action)
            product = nmpc.value_hessian_times(ours, along)
            np.testing.assert_allclose(found, product, atol=1e-5 * np.abs(product).max())
            found = module.slopes(state, theta, theirs, weights=np.eye(m)[0], action=action)
            policy = nmpc.policy_jacobian(ours)[0]
            np.testing.assert_allclose(found, policy, rtol=1e-5, atol=1e-7)
        later, cost = both(state, ours.action, theta, problem.own(problem.data[0]))
        found = module.step(state, ours.action, theta)
        np.testing.assert_allclose(found, later.full().ravel(), rtol=1e-12)
        found = module.stage_cost(state, ours.action, theta)
        assert found == pytest.approx(float(cost), rel=1e-12)

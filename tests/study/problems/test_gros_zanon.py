"""The example of Gros and Zanon against csnlp and mpcrl, whose plan shares no code with ours."""

import casadi as ca
import numpy as np
import pytest
from csnlp.wrappers import NlpSensitivity
from differences import active

from nmpcrl.control import Nmpc, Riccati
from nmpcrl.study.problems import gros_zanon as gz
from nmpcrl.study.problems import peers

PROBLEM = gz.problem()


@pytest.fixture(scope="module")
def agent():
    with peers.silent():
        return peers.agent(PROBLEM, peers.gros_zanon, "ipopt, exact")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["V", "Q"])
def test_values_and_their_gradients_are_csnlps(agent, kind):
    """V and Q to 1e-6, and the gradient wherever no kink is near."""
    ours = Nmpc(PROBLEM, solver=Riccati(1e-10))
    names = {name: np.asarray(one) for name, one in PROBLEM.split(PROBLEM.theta).items()}
    nlp = getattr(agent, kind).nlp
    in_order = ca.vvcat([nlp.parameters[name] for name in names])
    slope = NlpSensitivity(nlp, in_order).jacobian("L-p")
    gradient_of = ca.Function("g", [nlp.x, nlp.p, ca.vertcat(nlp.lam_g, nlp.lam_h)], [slope])
    compared, rng = 0, np.random.default_rng(7)
    for _ in range(50):
        theta = PROBLEM.theta + rng.normal(scale=0.05, size=PROBLEM.theta.size)
        state, action = rng.uniform([0.0, -1.0], [1.0, 1.0]), rng.uniform(-1.0, 1.0, 1)
        by_name = PROBLEM.split(theta)
        agent.learnable_parameters.update_values({name: by_name[name] for name in names})
        with peers.silent():
            asked = agent.action_value(state, action) if kind == "Q" else agent.state_value(state)
        found = asked if kind == "Q" else asked[1]
        assert found.success
        solution = ours.solve(state, theta, action=action if kind == "Q" else None)
        assert solution.value == pytest.approx(float(found.f), rel=1e-6, abs=1e-6)
        if active(solution):  # no kink is near
            flat = np.array(gradient_of(found.x, found.p, found.lam_g_and_h)).ravel()
            parts = np.split(flat, np.cumsum([one.size for one in names.values()])[:-1])
            by_columns = zip(parts, names.values(), strict=True)  # as csnlp has matrices
            gradient = np.hstack([p.reshape(one.shape, order="F").ravel() for p, one in by_columns])
            size = max(1.0, np.abs(gradient).max())
            np.testing.assert_allclose(solution.features, gradient, atol=1e-6 * size)
            compared += 1
    assert compared > 30


def test_the_plant_costs_what_mpcrls_example_says_and_an_informed_plan_knows_it():
    outside = gz.cost(np.array([-0.2, 1.5]), np.array([0.5]))
    assert outside == pytest.approx(0.5 * (0.04 + 2.25 + 0.5 * 0.25 + 100 * (0.2 + 0.5)))
    rng = np.random.default_rng(0)
    later, cost, end = gz.plant(gz.START, np.array([0.1]), rng)
    assert -0.1 <= later[0] - (0.35 * 0.15 + 0.00813) <= 0
    assert later[1] == pytest.approx(1.1 * 0.15 + 0.02)
    assert (cost, end) == (gz.cost(gz.START, np.array([0.1])), False)
    known = PROBLEM.split(gz.problem(informed=True).theta)
    np.testing.assert_array_equal(known["A"], gz.TRUE_A)
    np.testing.assert_allclose(known["b"], [-0.05, 0.0])

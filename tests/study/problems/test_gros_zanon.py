"""The example of Gros and Zanon against csnlp and mpcrl, whose plan shares no code with ours."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from csnlp.wrappers import NlpSensitivity

from nmpcrl.control import Nmpc, Riccati, Solution
from nmpcrl.study.problems import gros_zanon as gz
from nmpcrl.study.problems import peers

PROBLEM = gz.problem()
CLEAR = 1e-4  # from a change of the active rows


def draws(count: int):
    """States, thetas and actions."""
    rng = np.random.default_rng(7)
    for _ in range(count):
        theta = PROBLEM.theta + rng.normal(scale=0.05, size=PROBLEM.theta.size)
        yield rng.uniform([0.0, -1.0], [1.0, 1.0]), theta, rng.uniform(-1.0, 1.0, 1)


def strict(solution: Solution) -> bool:
    """Whether every row and bound is clearly active or clearly not: no kink is near."""
    m, ocp = solution.multipliers, solution.ocp
    shares = m.obstacles / np.outer(ocp.gamma ** np.arange(len(ocp.states)), ocp.slack_weights)
    nearest = np.minimum(shares, 1 - shares)
    doubtful = (nearest > 1e-7) & (nearest < CLEAR)
    weak = (np.abs(m.inputs) > 1e-7) & (np.abs(m.inputs) < CLEAR)
    between = (np.abs(np.abs(solution.inputs) - 1) < CLEAR) & (np.abs(m.inputs) < CLEAR)
    return not (doubtful.any() or weak.any() or between.any())


@cache
def agent():
    with peers.silent():
        return peers.agent(peers.gros_zanon_plan("ipopt, exact"))


@cache
def slopes(kind: str):
    """Functions of csnlp's solution: the gradient of the value, and the policy's."""
    nlp = getattr(agent(), kind).nlp
    theta = ca.vvcat([nlp.parameters[name] for name in peers.starts(gz.problem())])
    of = NlpSensitivity(nlp, theta)
    u0 = getattr(agent(), kind).first_actions["u"]
    kkt, of_theta = of.jacobian("K-y"), of.jacobian("K-p")
    pick = ca.jacobian(u0, nlp.primal_dual)
    return (
        ca.Function("g", [nlp.x, nlp.p, ca.vertcat(nlp.lam_g, nlp.lam_h)], [of.jacobian("L-p")]),
        ca.Function("k", [nlp.primal_dual, nlp.p], [kkt, of_theta, pick]),
    )


def theirs(kind: str, state, theta, action=None):
    """Value, gradient in the order of theta, and a function for the policy's slope, of csnlp."""
    by_name = PROBLEM.split(theta)
    values = {name: np.asarray(by_name[name], float) for name in peers.starts(gz.problem())}
    agent().learnable_parameters.update_values(values)
    with peers.silent():
        if kind == "V":
            _, found = agent().state_value(state, True)
        else:
            found = agent().action_value(state, action)
    assert found.success
    gradient, system = slopes(kind)
    flat = np.array(gradient(found.x, found.p, found.lam_g_and_h)).ravel()

    def policy():
        point = found.x_and_lam_and_p[: system.size1_in(0)]
        kkt, of_theta, pick = (np.array(one) for one in system(point, found.p))
        return by_columns(-pick @ np.linalg.lstsq(kkt, of_theta, rcond=None)[0])

    return float(found.f), by_columns(flat[None])[0], policy


def by_columns(rows):
    """Rows in csnlp's order of theta, matrices column by column, in ours."""
    result, at = [], 0
    for value in peers.starts(gz.problem()).values():
        part = rows[:, at : at + value.size]
        at += value.size
        order = np.arange(value.size).reshape(value.shape, order="F").ravel()
        result.append(part[:, order])
    return np.hstack(result)


@pytest.mark.slow
def test_values_and_their_gradients_are_csnlps():
    """V and Q to 1e-6, and both gradients wherever no kink is near."""
    ours = Nmpc(PROBLEM, solver=Riccati(1e-10))
    compared = 0
    for state, theta, action in draws(50):
        for kind, given in (("V", None), ("Q", action)):
            solution = ours.solve(state, theta, action=given)
            value, gradient, _ = theirs(kind, state, theta, given)
            assert solution.value == pytest.approx(value, rel=1e-6, abs=1e-6)
            if strict(solution):
                size = max(1.0, np.abs(gradient).max())
                np.testing.assert_allclose(solution.features, gradient, atol=1e-6 * size)
                compared += 1
    assert compared > 60


@pytest.mark.slow
def test_the_policys_sensitivity_is_csnlps():
    ours = Nmpc(PROBLEM, solver=Riccati(1e-10))
    compared = 0
    for state, theta, _ in draws(20):
        solution = ours.solve(state, theta)
        if strict(solution):
            found, (_, _, policy) = ours.policy_jacobian(solution), theirs("V", state, theta)
            expected = policy()
            size = max(1.0, np.abs(expected).max())
            np.testing.assert_allclose(found, expected, atol=1e-5 * size)
            compared += 1
    assert compared > 6


def test_the_plant_costs_what_mpcrls_example_says():
    outside = gz.cost(np.array([-0.2, 1.5]), np.array([0.5]))
    assert outside == pytest.approx(0.5 * (0.04 + 2.25 + 0.5 * 0.25 + 100 * (0.2 + 0.5)))
    rng = np.random.default_rng(0)
    later, cost, end = gz.plant(gz.START, np.array([0.1]), rng)
    assert -0.1 <= later[0] - (0.35 * 0.15 + 0.00813) <= 0
    assert later[1] == pytest.approx(1.1 * 0.15 + 0.02)
    assert (cost, end) == (gz.cost(gz.START, np.array([0.1])), False)


def test_an_informed_plan_knows_the_plant_and_its_mean_disturbance():
    known = PROBLEM.split(gz.problem(informed=True).theta)
    np.testing.assert_array_equal(known["A"], gz.TRUE_A)
    np.testing.assert_allclose(known["b"], [-0.05, 0.0])

"""Where the truth is known: Riccati's and Lyapunov's equations against plans and simulation."""

import numpy as np
import pytest

from nmpcrl.control import Nmpc, Riccati
from nmpcrl.study.problems import gros_zanon as gz
from nmpcrl.study.problems import lqr, peers

STATE = np.array([0.7, -1.1])
pytestmark = pytest.mark.usefixtures("interpreted")


@pytest.fixture
def nmpc() -> Nmpc:
    return Nmpc(lqr.problem(), solver=Riccati(1e-11))  # of one test: its Python is forgotten


def test_values_and_slopes_are_riccatis_and_the_worth_of_a_gain_is_what_it_costs(nmpc):
    theta = lqr.problem().theta + 0.02 * np.random.default_rng(1).normal(size=16)
    theta = lqr.problem().names.filled(theta, {"R": [[0.4]]})
    solution, step = nmpc.solve(STATE, theta), 1e-6

    def truth(values):
        found = lqr.planned(values)
        return values[0] + STATE @ found.P @ STATE, -found.K @ STATE

    value, action = truth(theta)
    assert solution.value == pytest.approx(value, rel=1e-9)
    np.testing.assert_allclose(solution.action, action, atol=1e-8)
    sides = [[truth(theta + s * e) for s in (step, -step)] for e in np.eye(theta.size)]
    slopes = np.array([(up[0] - down[0]) / (2 * step) for up, down in sides])
    moves = np.array([(up[1] - down[1]) / (2 * step) for up, down in sides]).T
    np.testing.assert_allclose(solution.features, slopes, atol=1e-6)
    np.testing.assert_allclose(nmpc.policy_jacobian(solution), moves, atol=1e-6)
    best, theta = lqr.optimal(), lqr.problem(informed=True).theta
    solution = nmpc.solve(STATE, theta)
    assert solution.value == pytest.approx(STATE @ best.P @ STATE, rel=1e-9)
    np.testing.assert_allclose(solution.action, -best.K @ STATE, atol=1e-8)
    best = lqr.optimal()
    for k in (best.K, lqr.optimal(gz.WRONG_A, gz.WRONG_B).K):
        state, total, rng = lqr.START, 0.0, np.random.default_rng(0)
        for t in range(400):
            state, cost, _ = lqr.plant(state, -k @ state, rng)
            total += gz.GAMMA**t * cost
        assert lqr.worth(k).cost == pytest.approx(total, rel=1e-9)
        assert lqr.worth(k).cost >= best.cost * (1 - 1e-12)
    np.testing.assert_allclose(lqr.worth(best.K).P, best.P, atol=1e-9)
    assert lqr.worth(np.array([[9.0, 9.0]])).cost == np.inf


def shooting(plan, th):
    """A plan of `lqr` by multiple shooting in csnlp."""
    x, _ = plan.state("x", 2, bound_initial=False)
    u, _ = plan.action("u", 1)
    plan.set_affine_dynamics(th["A"], th["B"])
    objective = th["V0"] + gz.GAMMA**gz.HORIZON * (x[:, -1].T @ th["P"] @ x[:, -1])
    for i in range(gz.HORIZON):
        stage = x[:, i].T @ th["Q"] @ x[:, i] + u[:, i].T @ th["R"] @ u[:, i]
        objective += gz.GAMMA**i * stage
    return objective


def test_value_and_action_are_csnlps_and_the_agent_of_the_peer_meets_our_plant(nmpc):
    agent = peers.agent(lqr.problem(), shooting, "ipopt, 1e-10")
    for state in np.random.default_rng(3).normal(size=(5, 2)):
        solution = nmpc.solve(state, lqr.problem().theta)
        with peers.silent():
            action, theirs = agent.state_value(state, True)
        assert float(theirs.f) == pytest.approx(solution.value, rel=1e-7)
        assert float(action) == pytest.approx(solution.action[0], rel=1e-5, abs=1e-7)
    calls = []

    def plant(state, action, rng):
        calls.append((state, action))
        return lqr.plant(state, action, rng)

    world = peers.world(lqr.problem(), plant, lqr.START, 3)
    with peers.silent():
        (returns,) = agent.train(world, episodes=1, seed=0)
    assert len(calls) == 3
    np.testing.assert_array_equal(calls[1][0], lqr.plant(*calls[0], None)[0])
    assert returns == pytest.approx(sum(lqr.plant(*one, None)[1] for one in calls))

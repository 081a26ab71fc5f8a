"""learner = bootstrap x update rule: each pairing by hand, and where each one settles."""

from types import SimpleNamespace

import numpy as np
import pytest

from nmpcrl.control import SolverError
from nmpcrl.learning import (
    Imitation,
    Learner,
    SecondSolve,
    Transition,
    Weights,
    deep_expected_sarsa,
    expected_sarsa,
    frozen,
    gradient_expected_sarsa,
    gradient_tdc,
    q_learning,
    random_direction,
    regularized_deep_expected_sarsa,
    step_matched,
)
from nmpcrl.learning.learners import gradient_td

ALPHA, BETA = 0.1, 0.01
THETA, W = np.array([1.0, 0.5, -1.0]), np.array([0.1, 0.0, 0.2])


@pytest.fixture
def weights() -> Weights:
    return Weights(THETA.copy(), W.copy())


def learners(controller, network):
    return {
        "ES": expected_sarsa(controller, ALPHA),
        "DES": deep_expected_sarsa(controller, network, ALPHA),
        "RDES": regularized_deep_expected_sarsa(controller, network, ALPHA),
        "GES": gradient_expected_sarsa(controller, ALPHA, BETA),
        "TDC": gradient_tdc(controller, ALPHA, BETA),
        "QL": q_learning(controller, ALPHA),
        "frozen": frozen(controller),
        "matched": step_matched(controller, ALPHA, BETA),
        "random": random_direction(controller, ALPHA, np.random.default_rng(0)),
    }


NAMES = tuple(learners(SimpleNamespace(gamma=0.9), None))


def test_the_table_of_pairings(controller, network):
    table = learners(controller, network)
    assert {name: learner.name for name, learner in table.items()} == {n: n for n in table}
    for name in ("ES", "GES", "TDC", "QL", "matched", "random"):
        assert isinstance(table[name].bootstrap, SecondSolve)
    for name in ("DES", "RDES"):
        assert isinstance(table[name].bootstrap, Imitation)
    assert not table["DES"].bootstrap.with_theta
    assert table["RDES"].bootstrap.with_theta
    assert all(learner.gamma == controller.gamma for learner in table.values())


def test_expected_sarsa_by_hand(controller, transition, weights):
    update = expected_sarsa(controller, ALPHA).step(weights, transition(THETA))
    delta = 4.0 + 0.9 * (0.5 + 1.0) - (1.0 + 1.0 - 3.0)
    assert update.delta == pytest.approx(delta)
    expected = THETA + ALPHA * delta * np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(update.weights.theta, expected)
    np.testing.assert_array_equal(update.weights.w, W)
    assert update.successor.value == 1.5


def test_gradient_expected_sarsa_by_hand(controller, transition, weights):
    update = gradient_expected_sarsa(controller, ALPHA, BETA).step(weights, transition(THETA))
    delta = 4.0 + 0.9 * 1.5 + 1.0
    phi, phi_next = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.0, -1.0])
    overlap = 0.1 + 0.6  # w'phi, with the old w
    theta = THETA + ALPHA * (delta * phi - 0.9 * overlap * phi_next)
    np.testing.assert_allclose(update.weights.theta, theta)
    np.testing.assert_allclose(update.weights.w, W + BETA * (delta - overlap) * phi)


@pytest.mark.parametrize("name", ["DES", "RDES"])
def test_the_deep_learners_by_hand(controller, network, transition, weights, name):
    network.batch = 1
    update = learners(controller, network)[name].step(weights, transition(THETA))
    delta = 4.0 + 0.9 * 7.0 + 1.0
    assert update.delta == pytest.approx(delta)
    np.testing.assert_allclose(
        update.weights.theta, THETA + ALPHA * delta * np.array([1.0, 2.0, 3.0])
    )
    assert controller.calls == []  # not one solve more


@pytest.mark.parametrize("name", ["DES", "RDES"])
def test_a_gated_learner_does_not_move_before_its_network_is_ready(
    controller, network, transition, weights, name
):
    learner = learners(controller, network)[name]
    first, second, third = (learner.step(weights, transition(THETA)) for _ in range(3))
    assert first.weights is weights
    assert second.weights is weights
    assert (first.delta, first.successor) == (None, None)
    assert third.delta is not None


@pytest.mark.parametrize("make", [deep_expected_sarsa, regularized_deep_expected_sarsa])
def test_a_literal_learner_moves_from_the_first_step(
    controller, network, transition, weights, make
):
    update = make(controller, network, ALPHA, gated=False).step(weights, transition(THETA))
    assert update.delta == pytest.approx(4.0 + 0.9 * 7.0 + 1.0)


@pytest.mark.parametrize("make", [deep_expected_sarsa, regularized_deep_expected_sarsa])
def test_a_deep_learner_fits_as_often_a_step_as_it_is_told(
    controller, network, transition, weights, make
):
    network.batch = 1
    make(controller, network, ALPHA, fits=4).step(weights, transition(THETA))
    assert network.fits == 4


@pytest.mark.parametrize("name", sorted({*NAMES} - {"random"}))  # it draws
def test_a_step_is_pure(controller, network, transition, weights, name):
    network.batch = 1
    learner, step = learners(controller, network)[name], transition(THETA)
    one, other = learner.step(weights, step), learner.step(weights, step)
    np.testing.assert_array_equal(weights.theta, THETA)
    np.testing.assert_array_equal(weights.w, W)
    np.testing.assert_array_equal(step.solution.features, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(one.weights.theta, other.weights.theta)
    np.testing.assert_array_equal(one.weights.w, other.weights.w)


def test_gradient_td_without_the_next_features_is_refused(controller, network, transition, weights):
    network.batch = 1
    mismatched = Learner(
        "GES by network", Imitation(network, with_theta=True), gradient_td(ALPHA, BETA, 0.9), 0.9
    )
    with pytest.raises(ValueError, match="needs the next state's features: bootstrap by SecondS"):
        mismatched.step(weights, transition(THETA))


def test_a_failed_second_solve_is_the_callers_to_judge(controller, transition, weights):
    step = transition(THETA)

    def fail(*_):
        raise SolverError("no optimum", step.next_state, THETA)

    broken = SimpleNamespace(gamma=0.9, solve=fail)
    with pytest.raises(SolverError):
        expected_sarsa(broken, ALPHA).step(weights, step)


@pytest.mark.parametrize("name", ["ES", "GES", "TDC", "QL", "matched", "random"])
def test_the_next_action_is_the_policys_own(controller, network, transition, weights, name):
    """The next state is solved with u_0 free, even where the value learned has it fixed."""
    step = transition(THETA)
    learners(controller, network)[name].step(weights, step)
    ((state, theta, _, action),) = controller.calls
    assert state is step.next_state
    assert theta is weights.theta
    assert action is None


def test_from_the_same_solution_q_learning_moves_as_es_does(controller, transition, weights):
    step = transition(THETA)
    es, ql = (make(controller, ALPHA).step(weights, step) for make in (expected_sarsa, q_learning))
    np.testing.assert_array_equal(ql.weights.theta, es.weights.theta)
    np.testing.assert_array_equal(ql.weights.w, W)


class Bandit:
    """One state, Q_theta(a) = theta_0 + theta_1 a + theta_2 a^2, and the best action is taken."""

    gamma = 0.9

    def solve(self, state, theta, warm_start=None, action=None):
        a = -theta[1] / (2 * theta[2]) if action is None else action
        features = np.array([1.0, a, a**2])
        return SimpleNamespace(value=features @ theta, features=features)


def test_q_learning_finds_the_value_of_every_action_from_random_ones():
    """Whatever is done, the best is done next: Q(a) = c(a) + gamma min c / (1 - gamma)."""
    bandit, rng = Bandit(), np.random.default_rng(0)
    learner = q_learning(bandit, 0.1)
    weights = Weights(np.array([0.0, 0.0, 1.0]), np.zeros(3))
    for a in rng.uniform(-1, 1, 5000):
        solution = bandit.solve(None, weights.theta, action=a)
        cost = 3 + 2 * (a - 0.5) ** 2
        weights = learner.step(weights, Transition(None, a, cost, None, solution)).weights
    np.testing.assert_allclose(weights.theta, [3.5 + 27, -2, 2], rtol=1e-6)


def ring(controller, learner, steps):
    """Three states in a ring with costs 1, 2, 3; the features tell them apart, so V is exact."""
    states, costs = np.eye(3), (1.0, 2.0, 3.0)
    weights = Weights(np.zeros(3), np.zeros(3))
    for k in range(steps):
        state, after = states[k % 3], states[(k + 1) % 3]
        solution = controller.solve(state, weights.theta)
        step = Transition(state, np.zeros(2), costs[k % 3], after, solution)
        weights = learner.step(weights, step).weights
    return weights


@pytest.mark.parametrize("name", ["ES", "GES", "TDC"])
def test_learning_settles_at_the_bellman_equations_solution(controller, network, name):
    learner = {
        "ES": expected_sarsa(controller, 0.5),
        "GES": gradient_expected_sarsa(controller, 0.4, 0.4),
        "TDC": gradient_tdc(controller, 0.4, 0.4, projection=(0.0, 100.0)),
    }[name]
    exact = np.linalg.solve(np.eye(3) - 0.9 * np.roll(np.eye(3), 1, axis=1), [1.0, 2.0, 3.0])
    weights = ring(controller, learner, 9000)
    np.testing.assert_allclose(weights.theta, exact, rtol=1e-3)
    np.testing.assert_allclose(weights.w, 0, atol=1e-2)  # no TD error is left to track

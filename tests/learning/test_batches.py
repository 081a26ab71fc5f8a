"""Rules with a memory: what is carried, when a batch is full, and what LSTD-Q fits."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Ipopt, Nmpc, Parameter, Problem
from nmpcrl.learning import (
    Adam,
    Descent,
    Exploration,
    Learner,
    SecondSolve,
    Weights,
    batch_semi_gradient,
    expected_sarsa,
    lstd_q,
    policy_gradient,
    random_direction,
    step_matched,
    train,
)
from nmpcrl.study import paper

THETA = np.array([1.0, 0.5, -1.0])


def learner(controller, optimiser, every):
    rule = batch_semi_gradient(optimiser, every)
    return Learner("batch", SecondSolve(controller), rule, controller.gamma)


def drawn(controller, count, theta=THETA, seed=0):
    """Transitions of a linear controller between random states; the last ends the episode."""
    from nmpcrl.learning import Transition

    rng = np.random.default_rng(seed)
    states = rng.normal(size=(count, 2, 3))
    return [
        Transition(s, np.zeros(2), rng.normal(), later, controller.solve(s, theta),
                   last=k == count - 1)
        for k, (s, later) in enumerate(states)
    ]  # fmt: skip


def after(learner, transitions, theta=THETA):
    weights = Weights(theta, np.zeros(theta.size))
    for transition in transitions:
        weights = learner.step(weights, transition).weights
    return weights


def test_a_batch_of_one_step_is_expected_sarsa(controller):
    steps = drawn(controller, 5)
    one = after(learner(controller, Descent(0.01), every=1), steps[:1])
    other = after(expected_sarsa(controller, 0.01), steps[:1])
    np.testing.assert_allclose(one.theta, other.theta)


@pytest.mark.parametrize("every", [4, None])
def test_theta_waits_for_a_full_batch_and_moves_by_its_mean(controller, every):
    steps = drawn(controller, 4)
    batch = learner(controller, Descent(0.1), every)
    np.testing.assert_array_equal(after(batch, steps[:3]).theta, THETA)
    expected = THETA + 0.1 * np.mean(
        [
            (s.cost + 0.9 * s.next_state @ THETA - s.state @ THETA) * s.state
            for s in steps
        ],
        axis=0,
    )  # fmt: skip
    np.testing.assert_allclose(after(batch, steps).theta, expected)


def test_a_batch_of_no_step_is_refused():
    with pytest.raises(ValueError, match="every = 0 must be at least 1, or None for an episode"):
        batch_semi_gradient(Descent(0.1), every=0)


def test_nothing_is_remembered_but_in_the_weights(controller):
    shared, steps = learner(controller, Adam(0.1), 2), drawn(controller, 6)
    alone = after(shared, steps).theta
    first, second = (Weights(THETA, np.zeros(3)) for _ in range(2))
    for step in steps:  # two runs that take turns
        first = shared.step(first, step).weights
        second = shared.step(second, replace(step, cost=-step.cost)).weights
    np.testing.assert_array_equal(first.theta, alone)
    assert not np.allclose(second.theta, alone)


def test_lstd_q_fits_a_linear_value_to_its_targets_in_one_step(controller):
    steps = drawn(controller, 20)
    phi = np.array([step.state for step in steps])
    target = [step.cost + 0.9 * step.next_state @ THETA for step in steps]
    exact = np.linalg.lstsq(phi, target)[0]
    found = after(lstd_q(controller, regularisation=1e-10), steps).theta
    np.testing.assert_allclose(found, exact, rtol=1e-6)


def test_lstd_q_is_lstd_where_it_is_repeated(controller):
    """On one batch that is met again and again, theta goes to the fixed point of Bellman."""
    steps, theta = drawn(controller, 50), THETA
    phi, later = (np.array([getattr(s, name) for s in steps]) for name in ("state", "next_state"))
    matrix = phi.T @ (phi - 0.9 * later)
    fixed = np.linalg.solve(matrix, phi.T @ [s.cost for s in steps])
    contraction = np.linalg.solve(phi.T @ phi, 0.9 * phi.T @ later)
    assert max(abs(np.linalg.eigvals(contraction))) < 0.95
    rule = lstd_q(controller, regularisation=1e-10)
    for _ in range(300):
        theta = after(rule, drawn(controller, 50, theta), theta).theta
    np.testing.assert_allclose(theta, fixed, rtol=1e-4)


def test_the_curvature_of_lstd_q_is_that_of_the_squared_error(quadratic):
    """Against finite differences of the gradient of mean((target - Q)^2) / 2, target held."""
    quadratic.value_hessian = lambda one: quadratic.hessian(one.state, one.theta)
    steps = drawn(quadratic, 4)
    targets = [s.cost + 0.9 * quadratic.value(s.next_state, THETA) for s in steps]

    def gradient(theta):
        return np.mean(
            [
                (quadratic.value(s.state, theta) - target) * quadratic.features(s.state, theta)
                for s, target in zip(steps, targets, strict=True)
            ],
            axis=0,
        )

    eps = 1e-6
    hessian = np.array(
        [(gradient(THETA + eps * e) - gradient(THETA - eps * e)) / (2 * eps) for e in np.eye(3)]
    )
    shift = 1e-3 + max(0, -np.linalg.eigvalsh(hessian)[0])
    expected = THETA - np.linalg.solve(hessian + shift * np.eye(3), gradient(THETA))
    found = after(lstd_q(quadratic, curvature=True), steps).theta
    np.testing.assert_allclose(found, expected, rtol=1e-3)


@pytest.fixture(scope="module")
def tank() -> Nmpc:
    """One state; the gain of the model is learned, within bounds that the data would leave."""
    problem = Problem(
        states=1,
        inputs=1,
        horizon=5,
        gamma=0.9,
        theta={"gain": Parameter(0.5, 0.2, 0.6), "V0": Parameter(0.0, -10, 10)},
        model=lambda x, u, th: 0.9 * x + th["gain"] * u,
        stage=lambda x, u, th: ca.sumsqr(x - 1) + 0.1 * ca.sumsqr(u),
        initial=lambda x, th: th["V0"],
        lower=-1,
        upper=1,
    )
    return Nmpc(problem, solver=Ipopt())


def filling(state, action, rng):
    cost = float((state[0] - 1) ** 2 + 0.1 * action[0] ** 2)
    return 0.9 * state + 0.3 * action + rng.normal(scale=0.01, size=1), cost, False


def trained(learner, nmpc, weights, noise, constrained):
    return train(
        learner, nmpc, weights, noise, constrained=constrained, plant=filling, start=[0.0], rng=5
    )


def noise(episodes, steps):
    return Exploration.draw(np.random.default_rng(0), (episodes, steps, 1), deviation=0.2)


@pytest.mark.parametrize(
    ("make", "constrained"),
    [(lambda nmpc: lstd_q(nmpc, 0.5, every=4), True), (lambda nmpc: policy_gradient(nmpc), False)],
)
def test_a_run_goes_on_from_the_weights_of_any_of_its_steps(tank, make, constrained):
    weights = Weights(tank.problem.theta, np.zeros(2))
    shared = make(tank)
    steps = list(trained(shared, tank, weights, noise(2, 6), constrained))
    assert [step.last for step in steps] == [False] * 5 + [True] + [False] * 5 + [True]
    again = list(trained(shared, tank, weights, noise(2, 6), constrained))
    np.testing.assert_array_equal(steps[-1].weights.theta, again[-1].weights.theta)
    assert not np.array_equal(steps[-1].weights.theta, weights.theta)
    assert steps[6].weights.memory.steps == (3 if constrained else 1)


def test_learners_keep_theta_within_the_bounds_of_the_problem(tank):
    weights = Weights(tank.problem.theta, np.zeros(2))
    for learner, constrained in (
        (expected_sarsa(tank, 1e3), False),
        (lstd_q(tank, regularisation=1e-6, every=1), True),
        (policy_gradient(tank, 1e3, every=3), False),
        (step_matched(tank, 1e3, 1e-3), False),
        (random_direction(tank, 1e3, np.random.default_rng(0)), False),
    ):
        steps = list(trained(learner, tank, weights, noise(1, 8), constrained))
        gains = np.array([step.weights.theta[0] for step in steps if not step.failure])
        assert ((gains >= 0.2) & (gains <= 0.6)).all()
        assert len(set(gains)) > 1


def test_the_papers_controller_has_no_bounds_of_theta():
    assert expected_sarsa(paper.nmpc(), 1e-7).bounds is None

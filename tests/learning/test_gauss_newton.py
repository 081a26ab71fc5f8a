"""Gauss-Newton within a trust region: against other minimisers and finite differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from nmpcrl.control import Nmpc, Problem, SolverError, Task, differential_drive
from nmpcrl.learning import Exploration, Transition, Weights, evaluate, train
from nmpcrl.learning.bootstrap import NextValue
from nmpcrl.learning.gauss_newton import ClosedLoop, TrustRegion, closed_loop, lstd_q_within
from nmpcrl.learning.optimisers import GaussNewton
from nmpcrl.study import paper

THETA = np.array(paper.THETA_INIT)
NOTHING = NextValue(np.nan)
STEPS = 12


class Held:
    """Keeps the gradient and the curvature that it is given, and moves nothing."""

    def init(self, theta):
        return None

    def step(self, memory, theta, gradient, curvature=None):
        self.gradient, self.curvature = gradient, curvature
        return theta, None


@pytest.fixture(scope="module")
def free() -> Nmpc:
    """The paper's robot without obstacles, at rest near its target."""
    task = Task(
        start=np.array([0.3, 0.2, 0.4]), target=np.zeros(3), lower=np.full(3, -9.0),
        upper=np.full(3, 9.0),
    )  # fmt: skip
    return Nmpc(differential_drive(), task)


def random_problem(seed, *, convex):
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, 3))
    H = A @ A.T + 0.1 * np.eye(3) if convex else A + A.T
    return rng.normal(size=3), H, rng.uniform(0.2, 3, 3)


@given(st.integers(0, 1000), st.booleans(), st.floats(0.01, 2))
@settings(max_examples=60)
def test_a_step_in_a_trust_region_is_the_least_of_its_model(seed, convex, radius):
    gradient, H, scale = random_problem(seed, convex=convex)
    theta = np.ones(3)
    moved, _ = TrustRegion(radius, scale).step(None, theta, gradient, H)
    p = moved - theta

    def model(q):
        return gradient @ (scale * q) + (scale * q) @ H @ (scale * q) / 2

    assert np.linalg.norm(p / scale) <= radius * (1 + 1e-9)
    inside = {"type": "ineq", "fun": lambda q: radius**2 - q @ q, "jac": lambda q: -2 * q}
    starts = np.random.default_rng(seed).normal(size=(4, 3))
    others = [minimize(model, radius * q / np.linalg.norm(q), constraints=[inside]) for q in starts]
    least = min(one.fun for one in others if one.success)  # which may lie a little outside
    assert model(p / scale) <= least + 1e-3 * abs(least) + 1e-6


def test_a_wide_region_is_gauss_newton():
    gradient, H, scale = random_problem(3, convex=True)
    wide, _ = TrustRegion(1e6, scale).step(None, np.zeros(3), gradient, H)
    newton, _ = GaussNewton(regularisation=0.0).step(None, np.zeros(3), gradient, H)
    np.testing.assert_allclose(wide, newton, rtol=1e-8)


def test_a_region_needs_a_curvature_and_finite_numbers():
    region = TrustRegion(1.0, np.ones(2))
    with pytest.raises(ValueError, match="TrustRegion needs a curvature"):
        region.step(None, np.zeros(2), np.ones(2))
    moved, _ = region.step(None, np.zeros(2), np.ones(2), np.full((2, 2), np.nan))
    assert not np.isfinite(moved).any()


def test_lstd_q_within_a_region_goes_no_farther(controller, transition, weights):
    one = transition(weights.theta, cost=50.0)
    scale = np.array([1.0, 0.5, 2.0])
    learner = lstd_q_within(controller, TrustRegion(0.1, scale), every=1)
    moved = learner.step(weights, one).weights.theta
    assert np.linalg.norm((moved - weights.theta) / scale) == pytest.approx(0.1)


def one_episode(controller, theta, noise):
    """The summed cost, and the gradient and curvature of J that GN-J makes of the episode."""
    held = Held()
    learner = closed_loop(controller, held)
    weights = Weights(theta, np.zeros(9))
    steps = list(train(learner, controller, weights, noise))
    return sum(step.cost for step in steps), held.gradient, held.curvature


def test_the_gradient_of_j_is_that_of_finite_differences(free):
    """Noise is held; the costs are those of whole episodes."""
    noise = Exploration.draw(np.random.default_rng(1), (1, STEPS, 2), deviation=0.02)
    theta = THETA + 0.1
    _, gradient, _ = one_episode(free, theta, noise)
    h = 1e-4
    for k in range(9):
        up, down = (one_episode(free, theta + s * h * np.eye(9)[k], noise)[0] for s in (1, -1))
        assert gradient[k] == pytest.approx((up - down) / (2 * h), rel=2e-3, abs=2e-5)


def test_the_curvature_of_j_is_that_of_the_sensitivities(free):
    """2 S' diag(Q) S over the visited states, with S by finite differences of whole episodes."""
    silent = Exploration.draw(np.random.default_rng(0), (1, STEPS, 2), deviation=0.0)
    theta, h = THETA + 0.1, 1e-4
    *_, curvature = one_episode(free, theta, silent)
    ends = [
        (evaluate(free, theta + e, STEPS).states - evaluate(free, theta - e, STEPS).states)
        / (2 * h)
        for e in h * np.eye(9)
    ]
    S = np.array(ends)  # (d, steps, n)
    wanted = 2 * np.einsum("itn,n,jtn->ij", S, free.task.weights, S)
    np.testing.assert_allclose(curvature, wanted, rtol=5e-3, atol=1e-5 * np.abs(wanted).max())


def test_an_episode_after_one_that_failed_or_was_left_is_as_it_is_alone(free, monkeypatch):
    both = Exploration.draw(np.random.default_rng(1), (2, STEPS, 2), deviation=0.02)
    alone = Exploration(both.noise[1:], both.scale[1:])
    wanted = one_episode(free, THETA, alone)[1:]
    held, solve, calls = Held(), Nmpc.solve, 0

    def failing(*given, **more):  # which the plan of t = 4 meets, after seven solves a step
        nonlocal calls
        calls += 1
        if calls == 29:
            raise SolverError("broken", np.zeros(3), THETA)
        return solve(*given, **more)

    monkeypatch.setattr(Nmpc, "solve", failing)
    learner = closed_loop(free, held)
    steps = list(train(learner, free, Weights(THETA, np.zeros(9)), both))
    assert [step.time for step in steps if step.failure] == [4]
    for found, right in zip((held.gradient, held.curvature), wanted, strict=True):
        np.testing.assert_array_equal(found, right)
    left = steps[2].weights
    list(train(learner, free, left, alone))
    np.testing.assert_array_equal(held.gradient, wanted[0])


def test_gauss_newton_on_j_lowers_the_cost_of_the_robot(free):
    silent = Exploration.draw(np.random.default_rng(0), (6, STEPS, 2), deviation=0.0)
    learner = closed_loop(free, TrustRegion(0.3, np.ones(9)), (np.zeros(9), np.full(9, 10.0)))
    steps = list(train(learner, free, Weights(THETA, np.zeros(9)), silent))
    assert evaluate(free, steps[-1].weights.theta, STEPS).cost < evaluate(free, THETA, STEPS).cost


def test_an_action_that_noise_took_to_its_bound_does_not_answer_to_theta(free):
    rule = ClosedLoop(free, free, Held())
    state = free.task.start
    solution = free.solve(state, THETA)
    action = np.array([free.upper[0], 0.0])
    slope = rule.policy_slopes(
        Transition(state, action, 1.0, state, solution), THETA, np.zeros((3, 9))
    )
    assert not slope[0].any()
    assert slope[1].any()


def test_gauss_newton_on_j_refuses_a_problem_without_a_task():
    problem = Problem(
        states=1, inputs=1, horizon=3, theta={"a": 1.0},
        model=lambda x, u, th: x + u, stage=lambda x, u, th: th["a"] * x**2 + u**2,
    )  # fmt: skip
    with pytest.raises(ValueError, match="a Problem has neither"):
        closed_loop(Nmpc(problem), TrustRegion(1.0, np.ones(1)))
